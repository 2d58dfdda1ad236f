from dataclasses import replace

import numpy as np
import pytest

from diagrams.contact import TIME_STEP
from diagrams.grasp_trial import run_trial, turn_to_flush
from diagrams.trial_record import Outcome, Pair, TrialConfig
from diagrams.trial_rig import TrialRig
from models.errors import ModelError
from models.rotations import matrix_to_rotation_vector, rotation_vector_to_matrix
from models.task.discretise import nearest_orientation
from models.task.spaces import R_WG, R_WO, Kind

QUIET = TrialConfig(position_sd=0.0, yaw_sd=0.0, tilt_sd=0.0, friction=(0.8, 0.8), mass=(0.1, 0.1))


@pytest.fixture(scope="module")
def try_pair():
    """Run a trial: ``try_pair(pair, seed, config)``."""
    rig = TrialRig(TIME_STEP)
    return lambda pair, seed, config=QUIET: run_trial(rig, config, pair, seed)


def facts(record):
    return replace(record, cpu_s=0.0)


def orientation_after(record, pair):
    R = rotation_vector_to_matrix(np.array(record.turn)) @ R_WO[pair.orientation]
    return int(nearest_orientation(R)[0])


@pytest.mark.parametrize("gripper", [10, 5], ids=["vertical", "tilted"])
def test_a_flush_grasp_lifts_the_cube_and_keeps_it_as_it_is(try_pair, gripper):
    pair = Pair(Kind.GRASP, 0, gripper)
    record = try_pair(pair, 0)
    assert record.outcome == Outcome.HELD
    assert record.lift_height > 0.02
    assert record.pad_force == pytest.approx(40.0, rel=0.05)
    assert record.opening == pytest.approx(0.04, abs=1e-3)
    assert record.slip < 5e-4
    assert orientation_after(record, pair) == 0


def test_a_level_release_sets_the_cube_down_on_the_same_face(try_pair):
    pair = Pair(Kind.DROP, 8, 10, 0)
    record = try_pair(pair, 0)
    assert record.outcome == Outcome.FREE
    assert abs(record.lift_height) < 1e-3
    assert record.speed < 1e-3
    assert orientation_after(record, pair) == 8


def test_a_trial_is_the_same_whatever_ran_before_it(try_pair):
    pair = Pair(Kind.DROP, 0, 5, 1)
    first = try_pair(pair, 7, TrialConfig())
    try_pair(Pair(Kind.GRASP, 0, 11), 3, TrialConfig())
    assert facts(try_pair(pair, 7, TrialConfig())) == facts(first)


def test_noise_follows_the_seed_alone(try_pair):
    records = [try_pair(Pair(Kind.GRASP, 0, 10), seed, TrialConfig()) for seed in (1, 1, 2)]
    assert facts(records[0]) == facts(records[1])
    assert records[0].noise != records[2].noise
    assert 0.6 <= records[0].noise["friction"] <= 0.9


@pytest.mark.parametrize("gripper", [0, 5, 7, 9, 10, 11])
@pytest.mark.parametrize("orientation", [0, 1, 13])
def test_the_turn_to_flush_is_a_small_one_that_lays_a_face_on_the_pads(orientation, gripper):
    R_GO = R_WG[gripper].T @ R_WO[orientation]
    turn = turn_to_flush(R_GO)
    closing = np.abs((R_GO @ turn)[1])
    assert np.sort(closing) == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    assert np.linalg.norm(matrix_to_rotation_vector(turn)) <= np.radians(54.8)


@pytest.mark.parametrize(
    "wrong",
    [
        {"time_step": 0.0},
        {"close_s": -1.0},
        {"tilt_sd": float("nan")},
        {"friction": (0.9, 0.6)},
        {"mass": (0.0, 0.1)},
    ],
    ids=lambda wrong: next(iter(wrong)),
)
def test_settings_that_cannot_be_simulated_are_named(wrong):
    with pytest.raises(ModelError, match=next(iter(wrong))):
        TrialConfig(**wrong)
