import numpy as np
import pytest

from diagrams.trials.initial_state import draw_noise, held_pose, turn_to_flush
from diagrams.trials.record import TrialConfig
from models.rotations import geodesic_angle, matrix_to_rotation_vector
from models.task.spaces import R_WG, R_WO

NONE = dict.fromkeys(draw_noise(TrialConfig(), np.random.default_rng(0)), 0.0)


@pytest.mark.parametrize("gripper", [0, 5, 7, 9, 10, 11])
@pytest.mark.parametrize("orientation", [0, 1, 13])
def test_the_turn_to_flush_is_a_small_one_that_lays_a_face_on_the_pads(orientation, gripper):
    R_GO = R_WG[gripper].T @ R_WO[orientation]
    turn = turn_to_flush(R_GO)
    closing = np.abs((R_GO @ turn)[1])
    assert np.sort(closing) == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    assert np.linalg.norm(matrix_to_rotation_vector(turn)) <= np.radians(54.8)


def test_a_held_cube_lies_flush_or_as_its_state_says():
    flush = held_pose(0, 10, NONE)
    assert geodesic_angle(flush.rotation().matrix(), R_WG[10].T @ R_WO[0]) < 1e-9
    # 45° off: the edges hold it as it is.
    jammed = held_pose(1, 10, NONE)
    assert geodesic_angle(jammed.rotation().matrix(), R_WG[10].T @ R_WO[1]) < 1e-9


def test_a_cube_that_shows_the_palm_an_edge_is_held_further_out():
    level, tilted = held_pose(0, 10, NONE), held_pose(0, 5, NONE)
    assert level.translation()[2] == 0.0
    assert tilted.translation()[2] > 0.0


def test_noise_has_the_spread_that_the_configuration_says():
    config = TrialConfig()
    rng = np.random.default_rng(1)
    drawn = [draw_noise(config, rng) for _ in range(2000)]
    sd = {name: np.std([noise[name] for noise in drawn]) for name in NONE}
    for name, expected in {"x": config.position_sd, "yaw": config.yaw_sd}.items():
        assert sd[name] == pytest.approx(expected, rel=0.1)
    low, high = config.friction
    assert all(low <= noise["friction"] <= high for noise in drawn)
