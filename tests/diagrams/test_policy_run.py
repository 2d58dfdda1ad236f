import numpy as np
import pytest
from pydrake.math import RigidTransform

from diagrams.camera import StillCamera
from diagrams.policy_controller import Verdict
from diagrams.policy_run import PolicyRun, start_pose
from experiments.kit.shipped_data import load_planner
from models.task.discretise import nearest_orientation
from models.task.spaces import GOAL_POSITION, GOAL_STATE, N_STATES, Action, Kind, State

FAR = State(14, 0)  # at (0.6, 0), already the right way up
GRASP, DROP = Action(Kind.GRASP, 10).index, Action(Kind.DROP).index
CARRY = Action(Kind.TRANSLATE, GOAL_POSITION).index


@pytest.fixture(scope="module")
def run():
    policy = np.full(N_STATES + 1, -1)
    policy[FAR.index] = GRASP
    policy[State(14, 0, 10).index] = CARRY
    policy[State(GOAL_POSITION, 0, 10).index] = DROP
    return PolicyRun(policy, load_planner(), goal_states=np.array([GOAL_STATE]))


@pytest.fixture(scope="module")
def played(run):
    return run.play(FAR.index, np.random.default_rng(0))


def test_the_arm_picks_carries_and_places_the_cube(played):
    assert played.fault == played.reason == ""
    assert played.episode.verdict == Verdict.GOAL
    assert [step.action for step in played.episode.steps] == [GRASP, CARRY, DROP]
    assert [step.next_state for step in played.episode.steps] == [
        State(14, 0, 10).index,
        State(GOAL_POSITION, 0, 10).index,
        GOAL_STATE,
    ]


def test_pictures_show_the_cube_where_it_is(played):
    camera = StillCamera(
        size=(320, 240), view_from=(0.9, -0.5, 0.9), view_at=(0.55, 0.0, 0.52), field_of_view=0.4
    )
    before, after = (camera.picture(played.postures[i]) for i in (0, -1))
    assert before.shape == (240, 320, 3)

    def yellow(picture):
        red, green, blue = picture.astype(int).transpose(2, 0, 1)
        return (red > 150) & (green > 110) & (blue < 90) & (green - blue > 60)

    columns = [np.flatnonzero(yellow(picture).any(axis=0)).mean() for picture in (before, after)]
    assert abs(columns[0] - columns[1]) > 15


def test_start_poses_stay_in_their_state_and_follow_the_seed():
    poses = [start_pose(FAR.index, np.random.default_rng(seed)) for seed in (0, 0, 1)]
    assert poses[0].IsExactlyEqualTo(poses[1])
    assert not poses[0].IsExactlyEqualTo(poses[2])
    for X_WO in poses:
        assert X_WO.translation() == pytest.approx([0.6, 0.0, 0.52], abs=0.015)
        assert nearest_orientation(X_WO.rotation().matrix())[0] == 0
    with pytest.raises(ValueError, match="not free"):
        start_pose(State(14, 0, 10).index, np.random.default_rng(0))


def test_what_drake_cannot_simulate_is_a_fault_and_what_we_get_wrong_is_not(run, monkeypatch):
    nowhere = RigidTransform([0.6, 0.0, np.nan])
    monkeypatch.setattr("diagrams.policy_run.start_pose", lambda *_: nowhere)
    monkeypatch.setattr("diagrams.station.finite_pose", lambda X, _: X)
    failed = run.play(FAR.index, np.random.default_rng(0))
    assert not failed.success
    assert "non-finite" in failed.reason and "\n" not in failed.reason
    assert failed.fault.startswith(failed.reason) and "AdvanceTo" in failed.fault

    monkeypatch.undo()
    mistaken = {}
    with pytest.raises(KeyError):
        run.play(FAR.index, np.random.default_rng(0), progress=lambda *_: mistaken["absent"])
