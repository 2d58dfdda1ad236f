"""The workspace map: its grid, its decisions, and the audit that checks them by Drake alone."""

from dataclasses import replace

import numpy as np
import pytest

from models.errors import ModelError
from models.gen3.closed_form import solve_first
from models.inverse_kinematics.solution import Failure, reaches
from models.inverse_kinematics.sweep import Sweep
from models.maps.gripper_poses import gripper_pose
from models.maps.workspace import CLEARANCE_LIMIT, FAILURES, REACHABLE, Grid, WorkspaceSolver
from models.maps.workspace_audit import audit, is_reachable
from models.maps.workspace_map import WorkspaceMap
from models.scenes.planning_scene import MARGIN, PlanningScene
from models.task.spaces import POSITIONS

GRID = Grid((0.3, -0.2, 0.5), (0.9, 0.2, 0.8), 0.1)


@pytest.fixture(scope="module")
def solver():
    return WorkspaceSolver()


@pytest.fixture(scope="module")
def the_map(solver):
    return WorkspaceMap(GRID, solver.decide(*GRID.poses(0, GRID.total)))


def test_grid_holds_the_cells_of_the_task_and_about_300_000_poses():
    grid = Grid()
    assert 290_000 < grid.total < 320_000
    for axis, coordinates in zip(grid.axes(), POSITIONS.T, strict=True):
        assert set(coordinates) <= set(axis)
    p_WG, gripper = grid.poses(17, 37)
    assert gripper.tolist() == [17, *range(18), 0]
    np.testing.assert_allclose(np.diff(p_WG[[0, 1, 19]], axis=0), [[0, 0, 0.025]] * 2, atol=1e-9)


@pytest.mark.parametrize(
    ("low", "high", "spacing"),
    [((0, 0, 1), (1, 1, 0), 0.1), ((0, 0, 0), (1, 1, np.nan), 0.1), ((0, 0, 0), (1, 1, 1), 0.0)],
)
def test_grids_without_voxels_are_refused(low, high, spacing):
    with pytest.raises(ModelError, match="grid: "):
        Grid(low, high, spacing)


def test_every_positive_passes_drake_and_every_negative_has_a_reason(the_map):
    scene = PlanningScene()
    p_WG, gripper = GRID.poses(0, GRID.total)
    seen = set()
    for p, g in zip(p_WG, gripper, strict=True):
        entry = the_map.find(p, int(g))
        if entry.failure is not None:
            seen.add(entry.failure)
            assert (entry.q, entry.clearance) == (None, None)
            continue
        assert reaches(scene, entry.q, gripper_pose(p, int(g)))
        distance = scene.clearance(entry.q, CLEARANCE_LIMIT).distance
        assert distance > MARGIN
        assert entry.clearance == pytest.approx(distance, abs=1e-6)
    assert {Failure.OUT_OF_REACH, Failure.JOINT_LIMIT, Failure.BLOCKED} <= seen


def test_a_hand_in_the_furniture_is_told_from_an_arm_in_the_way(solver):
    """Asked of Drake at any posture that meets the pose, for poses at the height of the table."""
    p_WG, gripper = Grid((0.2, -0.4, 0.5), (0.6, 0.4, 0.5), 0.1).poses(0, 5 * 9 * 18)
    reason = solver.decide(p_WG, gripper).reason
    scene = PlanningScene()
    arm = Sweep.of(scene)
    for failure in (Failure.BLOCKED, Failure.COLLISION):
        chosen = np.flatnonzero(reason == 1 + FAILURES.index(failure))
        assert len(chosen) > 5
        poses = [gripper_pose(p_WG[i], int(gripper[i])) for i in chosen]
        R, p = (np.array(part) for part in zip(*map(arm.end_effector, poses), strict=True))
        q, _ = solve_first(R, p, np.linspace(-np.pi, np.pi, 64))
        blocked = [scene.hand_is_blocked(posture, MARGIN) for posture in q]
        assert blocked == [failure == Failure.BLOCKED] * len(chosen)


def test_decisions_do_not_depend_on_what_is_decided_together(solver, the_map):
    whole = the_map.decisions
    parts = [solver.decide(*GRID.poses(i, i + 30)) for i in (0, 30)]
    assert np.concatenate([part.reason for part in parts]).tolist() == whole.reason[:60].tolist()
    q = np.concatenate([part.q for part in parts])
    np.testing.assert_array_equal(q, whole.q[: len(q)])


def test_share_and_look_up_by_hash(the_map):
    share = the_map.share
    assert share.shape == GRID.shape
    assert share.max() > 0.8
    assert share[2, 2, 0] == 0.0  # in the table's top
    p_WG = np.array([0.5, 0.0, 0.6])
    voxel = tuple(int(np.abs(a - x).argmin()) for a, x in zip(GRID.axes(), p_WG, strict=True))
    found = [the_map.find(p_WG + 2e-5, g).failure is None for g in range(18)]
    assert np.mean(found) == share[voxel]
    assert the_map.find(p_WG + 1e-3, 0) is None
    with pytest.raises(ModelError, match="orientation 18"):
        the_map.find(p_WG, 18)


def test_a_map_of_another_size_is_refused(the_map):
    with pytest.raises(ModelError, match="reason"):
        WorkspaceMap(Grid(), the_map.decisions)
    with pytest.raises(ModelError, match="rows"):
        WorkspaceMap(GRID, replace(the_map.decisions, q=the_map.decisions.q[1:]))


def test_audit_passes_the_map_and_catches_a_wrong_one(the_map):
    good = audit(the_map, 40, np.random.default_rng(0))
    assert (good.rejected, good.missed, good.sample) == (0, 0, 40)
    assert good.positives == the_map.reachable.sum()
    assert good.false_negative_rate == 0.0

    # One posture bent away; and a map that calls everything unreachable.
    q = the_map.decisions.q.copy()
    q[3, 1] += 0.01
    bent = WorkspaceMap(GRID, replace(the_map.decisions, q=q))
    assert audit(bent, 0, np.random.default_rng(0)).rejected == 1
    reason = np.full_like(the_map.decisions.reason, 1 + FAILURES.index(Failure.NOT_FOUND))
    empty = replace(the_map.decisions, reason=reason, q=q[:0], clearance=q[:0, 0])
    wrong = audit(WorkspaceMap(GRID, empty), 20, np.random.default_rng(0))
    expected = (the_map.decisions.reason == REACHABLE).mean()
    assert wrong.missed == pytest.approx(20 * expected, abs=6)
    assert wrong.false_negative_rate == 1.0


def test_restarts_find_what_is_there_and_nothing_else():
    scene, rng = PlanningScene(), np.random.default_rng(0)
    assert is_reachable(scene, gripper_pose(np.array([0.55, 0.0, 0.6]), 7), rng)
    assert not is_reachable(scene, gripper_pose(np.array([0.55, 0.0, 0.5]), 12), rng)
