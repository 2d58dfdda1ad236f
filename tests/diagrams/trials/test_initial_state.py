from dataclasses import fields

import numpy as np
import pytest

from diagrams.faults import simulating
from diagrams.trials.initial_state import (
    MOST_DRAWS,
    NotHeld,
    begin,
    draw_noise,
    held_pose,
    turn_to_flush,
)
from diagrams.trials.record import Noise, Outcome, TrialConfig, TrialRecord
from models.rotations import geodesic_angle, matrix_to_rotation_vector
from models.task.spaces import R_WG, R_WO

NONE = Noise(**{field.name: 0.0 for field in fields(Noise)})


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
    for name, expected in {"x": config.position_sd, "yaw": config.yaw_sd}.items():
        sd = np.std([getattr(noise, name) for noise in drawn])
        assert sd == pytest.approx(expected, rel=0.1)
    low, high = config.friction
    assert all(low <= noise.friction <= high for noise in drawn)


def begun(attempt):
    return begin(attempt, TrialConfig(), np.random.default_rng(3))


def test_initial_states_are_drawn_until_the_hand_holds_the_cube():
    drawn = []

    def third(noise):
        drawn.append(noise)
        if len(drawn) < 3:
            raise NotHeld
        return TrialRecord(Outcome.HELD, slip=1.0)

    record = begun(third)
    assert record == TrialRecord(Outcome.HELD, slip=1.0, noise=drawn[2], draws=3)
    assert len(set(drawn)) == 3


def test_a_cube_never_held_and_a_simulator_that_fails_are_faults_with_a_reason():
    def never(noise):
        raise NotHeld

    def fails(noise):
        with simulating():
            raise RuntimeError("the solver gave up")

    record = begun(never)
    assert (record.outcome, record.draws) == (Outcome.FAULT, MOST_DRAWS)
    assert record.reason == "the hand held the cube in none of 10 initial states"
    record = begun(fails)
    assert (record.outcome, record.draws) == (Outcome.FAULT, 1)
    assert record.reason == "the solver gave up"
    assert "in fails" in record.fault


@pytest.mark.parametrize("error", [ValueError, KeyError, RuntimeError, SystemExit])
def test_a_mistake_of_ours_is_not_a_fault_of_the_simulator(error):
    def mistaken(noise):
        raise error("ours")

    with pytest.raises(error, match="ours"):
        begun(mistaken)
