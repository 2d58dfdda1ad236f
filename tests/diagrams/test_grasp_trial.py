import numpy as np
import pytest

from diagrams.grasp_trial import Outcome, Pair, TrialConfig, TrialRig
from models.rotations import rotation_vector_to_matrix
from models.task.discretise import nearest_orientation
from models.task.spaces import R_WO, Kind

QUIET = TrialConfig(position_sd=0.0, yaw_sd=0.0, tilt_sd=0.0, friction=(0.8, 0.8), mass=(0.1, 0.1))


@pytest.fixture(scope="module")
def rig():
    return TrialRig()


@pytest.fixture(scope="module")
def quiet_rig():
    return TrialRig(QUIET)


def facts(record):
    return {key: value for key, value in record.as_dict().items() if key != "cpu_s"}


def orientation_after(record, pair):
    R = rotation_vector_to_matrix(np.array(record.turn)) @ R_WO[pair.orientation]
    return int(nearest_orientation(R)[0])


@pytest.mark.parametrize("gripper", [10, 5], ids=["vertical", "tilted"])
def test_a_flush_grasp_lifts_the_cube_and_keeps_it_as_it_is(quiet_rig, gripper):
    pair = Pair(Kind.GRASP, 0, gripper)
    record = quiet_rig.run(pair, 0)
    assert record.outcome == Outcome.HELD
    assert record.lift_height > 0.02
    assert record.pad_force == pytest.approx(40.0, rel=0.05)
    assert record.opening == pytest.approx(0.04, abs=1e-3)
    assert record.slip < 5e-4
    assert orientation_after(record, pair) == 0


def test_a_level_release_sets_the_cube_down_on_the_same_face(quiet_rig):
    pair = Pair(Kind.DROP, 8, 10, 0)
    record = quiet_rig.run(pair, 0)
    assert record.outcome == Outcome.FREE
    assert abs(record.lift_height) < 1e-3
    assert record.speed < 1e-3
    assert orientation_after(record, pair) == 8


def test_a_trial_is_the_same_whatever_ran_before_it(rig):
    pair = Pair(Kind.DROP, 0, 5, 1)
    first = rig.run(pair, 7)
    rig.run(Pair(Kind.GRASP, 0, 11), 3)
    assert facts(rig.run(pair, 7)) == facts(first)


def test_noise_follows_the_seed_alone(rig):
    records = [rig.run(Pair(Kind.GRASP, 0, 10), seed) for seed in (1, 1, 2)]
    assert facts(records[0]) == facts(records[1])
    assert records[0].noise != records[2].noise
    assert 0.6 <= records[0].noise["friction"] <= 0.9
