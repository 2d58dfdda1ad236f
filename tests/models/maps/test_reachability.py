"""The shipped reachability map, and how an unknown pose joins it."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from models.errors import ModelError
from models.inverse_kinematics.solution import reaches
from models.inverse_kinematics.solver import solve
from models.maps.gripper_poses import Layer, gripper_pose, pose_key, standard_poses
from models.maps.pose_solver import CLOSED_MARGIN, PoseSolver
from models.maps.reachability import ReachabilityMap, nearest_posture, same_approach
from models.maps.reachability_csv import read_map
from models.scenes.planning_scene import HOME, MARGIN, PlanningScene
from models.task.spaces import CUBE_EDGE, HORIZONTAL, N_GRIPPERS, POSITIONS, VERTICAL

MAP = Path(__file__).parents[3] / "experiments" / "data" / "gen3" / "map.csv"


@pytest.fixture
def shipped():
    return read_map(MAP)


def test_every_standard_pose_is_there_once(shipped):
    keys = {pose_key(p, g) for g in range(N_GRIPPERS) for _, p in standard_poses(g)}
    assert {pose_key(entry.p_WG, entry.gripper) for entry in shipped.entries} == keys


def test_counts(shipped):
    """318 cells; all grasps but the level ones; vias but those of a level hand too near."""
    reachable = Counter(entry.layer for entry in shipped.entries if entry.value)
    assert reachable == {Layer.CELL: 318, Layer.VIA: 159, Layer.GRASP: 117}
    grasps = [e for e in shipped.entries if e.layer == Layer.GRASP]
    assert all(e.value == (e.gripper not in HORIZONTAL) for e in grasps)


def test_postures_are_judged_again_by_drake(shipped):
    empty, carrying = PlanningScene(), PlanningScene(carrying=True)
    for entry in shipped.entries:
        if entry.q is None:
            assert entry.failure is not None
            continue
        scene = empty if entry.layer == Layer.GRASP else carrying
        empty.open_to(0.085)
        assert reaches(scene, entry.q, gripper_pose(entry.p_WG, entry.gripper))
        assert scene.is_free(entry.q, MARGIN)
        assert np.abs(entry.q - HOME)[scene.continuous].max() <= np.pi + 1e-6
        if entry.layer == Layer.GRASP:
            empty.open_to(CUBE_EDGE)
            assert empty.is_free(entry.q, CLOSED_MARGIN)


def test_vertical_hands_share_the_posture_of_the_arm(shipped):
    for p_W in POSITIONS:
        first = shipped.posture(p_W, VERTICAL[0])
        for gripper in VERTICAL[1:]:
            np.testing.assert_array_equal(shipped.posture(p_W, gripper)[:6], first[:6])


def test_neighbouring_cells_have_neighbouring_postures(shipped):
    for gripper in range(N_GRIPPERS):
        known = [e for e in shipped.entries if e.gripper == gripper and e.layer == Layer.CELL]
        lower = {pose_key(e.p_WG, 0)[:2]: e.q for e in known if e.p_WG[2] < 0.57}
        upper = {pose_key(e.p_WG, 0)[:2]: e.q for e in known if e.p_WG[2] > 0.57}
        steps = [
            np.abs((lower[xy] - upper[xy] + np.pi) % (2 * np.pi) - np.pi).max()
            for xy in lower
            if lower[xy] is not None and upper[xy] is not None
        ]
        # One cell is only reached by another posture.
        assert sum(step > 1.0 for step in steps) <= (gripper == 3)


def test_families_by_approach():
    assert [len(same_approach(g)) for g in range(N_GRIPPERS)] == [0] * 11 + list(range(1, 8))


def test_a_pose_left_out_is_solved_into_its_family_again(shipped):
    p_WG, gripper = POSITIONS[1], 6
    entry = shipped.find(p_WG, gripper)
    others = [e for e in shipped.entries if e is not entry]
    again = ReachabilityMap(others).solve_and_add(p_WG, gripper, Layer.CELL)
    assert again.value == 1
    assert np.abs(again.q - entry.q).max() < 0.5


def test_unknown_pose_is_solved_once_and_kept(shipped):
    p_WG = np.array([0.52, 0.05, 0.57])
    assert shipped.find(p_WG, 12) is None
    with pytest.raises(ModelError, match=r"no pose at \[0.52, 0.05, 0.57\] m with gripper 12"):
        shipped.posture(p_WG, 12)
    entry = shipped.solve_and_add(p_WG, 12)
    assert entry.layer == Layer.ADDED
    assert entry.value == 1
    assert shipped.solve_and_add(p_WG + 3e-5, 12) is entry
    np.testing.assert_array_equal(shipped.posture(p_WG, 12), entry.q)


def test_added_poses_do_not_change_later_answers(shipped):
    p_WG = np.array([0.52, 0.05, 0.57])
    alone = ReachabilityMap(shipped.entries).solve_and_add(p_WG, 6)
    shipped.solve_and_add(p_WG + np.array([0.005, 0.0, 0.0]), 6)
    np.testing.assert_array_equal(shipped.solve_and_add(p_WG, 6).q, alone.q)


def test_answers_are_the_same_bits_whatever_was_asked_before(shipped):
    """Other orientations of the same approach, and other positions that count as the same."""
    p_WG = np.array([0.52, 0.06, 0.57])
    fresh, asked = ReachabilityMap(shipped.entries), ReachabilityMap(shipped.entries)
    alone = [ReachabilityMap(shipped.entries).solve_and_add(p_WG, g) for g in VERTICAL]
    for gripper, entry in zip(VERTICAL[::-1], alone[::-1], strict=True):
        asked.solve_and_add(p_WG + 3e-5, gripper)
        for known in (fresh, asked):
            np.testing.assert_array_equal(known.solve_and_add(p_WG, gripper).q, entry.q)
    for gripper, entry in zip(VERTICAL, alone, strict=True):
        np.testing.assert_array_equal(fresh.solve_and_add(p_WG, gripper).q, entry.q)


def test_pose_out_of_reach_is_added_with_its_reason():
    known = ReachabilityMap()
    entry = known.solve_and_add(np.array([1.5, 0.0, 0.6]), 5)
    assert (entry.value, entry.q, entry.failure) == (0, None, "out of reach")
    X_WG = gripper_pose(entry.p_WG, 5)
    assert solve(PlanningScene(), X_WG).failure == entry.failure


def test_nearest_posture_looks_at_reachable_poses_of_the_orientation(shipped):
    p_WG = np.array([0.61, 0.1, 0.61])
    q = nearest_posture(p_WG, 5, shipped.entries)
    np.testing.assert_array_equal(q, shipped.posture(np.array([0.6, 0.1, 0.6]), 5))
    q = nearest_posture(p_WG, 3, shipped.entries)
    assert q is not None and shipped.posture(np.array([0.6, 0.1, 0.6]), 3) is None
    assert nearest_posture(p_WG, 3, []) is None


def test_solver_is_built_when_needed():
    known = ReachabilityMap(seed=4)
    assert isinstance(known.solver, PoseSolver)
    assert known.solver.seed == 4
