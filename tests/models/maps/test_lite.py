"""The Gen3 Lite's map: every positive by Drake, every negative with its reason; its file."""

from collections import Counter

import numpy as np
import pytest

from models.gen3_lite.chain import LIMIT, forward
from models.gen3_lite.ik import solve, within_limits
from models.inverse_kinematics.solution import Failure, reaches
from models.maps.gripper_poses import gripper_pose
from models.maps.lite import LiteScene, _entry, build, numerical
from models.maps.lite_csv import write_map
from models.scenes.planning_scene import MARGIN, PlanningScene
from models.scenes.robots import GEN3_LITE
from models.task.spaces import N_GRIPPERS, POSITIONS


@pytest.fixture(scope="module")
def entries():
    return build()


@pytest.fixture(scope="module")
def scene():
    return LiteScene()


def test_every_cell_pose_is_there_once(entries):
    keys = {(*entry.p_WG.tolist(), entry.gripper) for entry in entries}
    assert keys == {(*p.tolist(), g) for p in POSITIONS for g in range(N_GRIPPERS)}
    assert len(entries) == len(keys) == 324


def test_counts(entries):
    """Half the poses: the vertical hand reaches the nearest columns only."""
    assert Counter(entry.value for entry in entries) == {0: 162, 1: 162}
    vertical = [entry for entry in entries if entry.gripper >= 10]
    assert all((entry.value == 1) == (entry.p_WG[0] < 0.52) for entry in vertical)


def test_positives_are_judged_again_by_drake(entries):
    scene = PlanningScene(robot=GEN3_LITE, carrying=True)
    for entry in entries:
        if entry.q is None:
            continue
        assert entry.failure is None
        assert reaches(scene, entry.q, gripper_pose(entry.p_WG, entry.gripper))
        assert scene.is_free(entry.q, MARGIN)
        assert scene.clearance(entry.q) == entry.clearance
        assert 1 <= entry.within_limits <= entry.solutions <= 16


def test_negatives_have_a_reason(entries):
    for entry in entries:
        if entry.value:
            continue
        # No real root; brute force agrees, else the value were 2 or the failure another.
        assert (entry.solutions, entry.within_limits, entry.clearance) == (0, 0, None)
        assert entry.failure in (Failure.OUT_OF_REACH, Failure.NOT_FOUND)


def test_the_value_names_the_procedure(scene, entries):
    known = next(entry for entry in entries if entry.value)
    none = np.empty((0, 6))
    given = known.p_WG, known.gripper
    assert _entry(scene, *given, known.q[None], []).value == 1
    second = _entry(scene, *given, none, [known.q])
    assert (second.value, second.solutions) == (2, 0)
    np.testing.assert_array_equal(second.q, known.q)
    assert _entry(scene, *given, none, []).failure == Failure.NOT_FOUND


def test_solutions_that_are_no_use_are_named(scene):
    X_WG = gripper_pose(np.array([0.45, 0.0, 0.42]), 10)  # inside the table
    (R,), (p,) = scene.end_effector([X_WG])
    solutions = solve(R, p)
    entry = _entry(scene, X_WG.translation(), 10, solutions, [])
    assert (entry.value, entry.failure) == (0, Failure.BLOCKED)
    assert entry.clearance is not None and entry.clearance.distance < MARGIN
    beyond = solutions[~within_limits(solutions)]
    assert len(beyond)
    entry = _entry(scene, X_WG.translation(), 10, beyond, [])
    assert (entry.failure, entry.within_limits) == (Failure.JOINT_LIMIT, 0)


def test_numerical_solver_meets_what_the_arm_reaches():
    rng = np.random.default_rng(0)
    for q in rng.uniform(-LIMIT, LIMIT, (20, 6)):
        R, p = forward(q)
        answers = numerical(R, p, rng)
        assert answers
        for answer in answers:
            assert np.abs(forward(answer)[1] - p).max() < 1e-11


def test_two_builds_give_the_same_file(entries, tmp_path):
    for name, map_ in (("a", entries), ("b", build())):
        write_map(map_, 0, tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
