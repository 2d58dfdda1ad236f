import numpy as np
import pytest

from models.errors import ModelError
from models.rotations import (
    geodesic_angle,
    matrix_to_rotation_vector,
    rotation_vector_to_matrix,
    rotation_x,
    rotation_z,
)
from models.task.tracking import NOTHING

R_GO, P_GO = rotation_z(0.4) @ rotation_x(0.2), np.array([0.001, -0.002, 0.004])


def measure(known, R, p, rng, *, sd=0.0, angle=0.0):
    """One more measurement from a hand somewhere, with noise."""
    R_WG, p_WG = rotation_vector_to_matrix(rng.normal(size=3)), rng.normal(size=3)
    R_noise = rotation_vector_to_matrix(rng.normal(0.0, angle, 3))
    p_noise = rng.normal(0.0, sd, 3)
    return known.measured(R_WG, p_WG, R_WG @ R @ R_noise, p_WG + R_WG @ (p + p_noise))


def test_the_pose_in_the_hand_does_not_depend_on_where_the_hand_is():
    rng = np.random.default_rng(0)
    known = NOTHING
    for _ in range(5):
        known = measure(known, R_GO, P_GO, rng)
        assert pytest.approx(R_GO) == known.R_GO
        assert known.p_GO == pytest.approx(P_GO)
    assert (known.count, known.slips) == (5, 0)
    assert known.released().count == 0


def test_noise_of_5_mm_and_5_degrees_averages_out_and_is_no_slip():
    rng = np.random.default_rng(1)
    known = NOTHING
    # Of a vector's rms as the issue of scenarios means it: each component a √3 less.
    for _ in range(60):
        sd, angle = 0.005 / np.sqrt(3), np.radians(5.0) / np.sqrt(3)
        known = measure(known, R_GO, P_GO, rng, sd=sd, angle=angle)
    assert known.slips == 0
    assert known.p_GO == pytest.approx(P_GO, abs=0.002)
    assert np.degrees(geodesic_angle(known.R_GO, R_GO)) < 2.0


def test_its_error_is_how_far_the_mean_is_off_in_one_direction_and_about_one_axis():
    rng = np.random.default_rng(3)
    sd, angle, off, told = 0.002, np.radians(2.0), [], []
    for _ in range(200):
        known = NOTHING
        assert known.error == (np.inf, np.inf)
        for _ in range(8):
            known = measure(known, R_GO, P_GO, rng, sd=sd, angle=angle)
        turn = matrix_to_rotation_vector(R_GO.T @ known.R_GO)
        off.append([*(known.p_GO - P_GO), *turn])
        told.append(known.error)
    true = np.sqrt(np.mean(np.square(off), axis=0)).reshape(2, 3).mean(axis=1)
    np.testing.assert_allclose(np.sqrt(np.mean(np.square(told), axis=0)), true, rtol=0.1)
    # Of what is measured well there is none.
    exact = NOTHING
    for _ in range(5):
        exact = measure(exact, R_GO, P_GO, rng)
    assert max(exact.error) < 1e-7


def test_a_jump_is_a_slip_once_it_is_seen_again_and_a_single_one_is_not():
    rng = np.random.default_rng(2)
    known = NOTHING
    for _ in range(20):
        known = measure(known, R_GO, P_GO, rng)
    R_slipped, p_slipped = R_GO @ rotation_x(np.radians(15.0)), P_GO + np.array([0.015, 0.0, 0.0])
    once = measure(known, R_slipped, p_slipped, rng)
    assert once.slips == 0 and once.p_GO == pytest.approx(P_GO)
    back = measure(once, R_GO, P_GO, rng)
    for _ in range(2):
        back = measure(back, R_slipped, p_slipped, rng)
    assert back.slips == 0
    after = measure(back, R_slipped, p_slipped, rng)
    assert (after.slips, after.count) == (1, 3)
    assert after.p_GO == pytest.approx(p_slipped)
    assert pytest.approx(R_slipped) == after.R_GO


def test_what_is_no_rotation_is_refused():
    with pytest.raises(ModelError, match="R_WO"):
        NOTHING.measured(np.eye(3), np.zeros(3), 2 * np.eye(3), np.zeros(3))
