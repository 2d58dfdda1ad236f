"""Iterative inverse kinematics, judged by forward kinematics."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from models.inverse_kinematics.optimised import LIMIT_MARGIN, Starts, follow, search
from models.inverse_kinematics.solution import Failure, reaches
from models.maps.gripper_poses import gripper_pose
from models.scenes.planning_scene import HOME, MARGIN, PlanningScene


@pytest.fixture(scope="module")
def scene():
    return PlanningScene()


def find(scene, X_WG, seed=HOME, attempts=20, **options):
    return search(scene, X_WG, Starts(seed, attempts, np.random.default_rng(3)), **options)


def test_answers_are_exact_and_free(scene):
    rng = np.random.default_rng(7)
    low, high = np.maximum(scene.lower, -np.pi) + 0.2, np.minimum(scene.upper, np.pi) - 0.2
    free = [q for q in rng.uniform(low, high, (40, 7)) if scene.is_free(q, 0.01)][:30]
    for q in free:
        X_WG = scene.forward(q)
        answer = find(scene, X_WG, seed=q + rng.uniform(-0.15, 0.15, 7))[0]
        assert answer.failure is None
        assert reaches(scene, answer.q, X_WG)
        assert answer.clearance.distance > MARGIN


def test_the_same_random_numbers_give_the_same_answer(scene):
    X_WG = gripper_pose(np.array([0.55, 0.1, 0.6]), 6)
    first, again = (find(scene, X_WG)[0] for _ in range(2))
    np.testing.assert_array_equal(first.q, again.q)


def test_candidates_come_nearest_first_and_differ(scene):
    answers = find(scene, gripper_pose(np.array([0.55, 0.0, 0.6]), 7), candidates=4)
    distances = [np.linalg.norm(answer.q - HOME) for answer in answers]
    assert len(answers) == 4
    assert distances == sorted(distances)
    assert np.diff(distances).min() > 0.0


def test_following_stays_near_and_within_limits(scene):
    X_WG = scene.forward(HOME)
    nearby = RigidTransform(X_WG.rotation(), X_WG.translation() + np.array([0.02, -0.03, 0.02]))
    q = follow(scene, nearby, HOME)
    assert np.abs(q - HOME).max() < 0.3
    assert (q[~scene.continuous] < scene.upper[~scene.continuous] - LIMIT_MARGIN + 1e-12).all()
    assert follow(scene, RigidTransform(np.array([3.0, 0.0, 1.0])), HOME) is None


def test_reasons_for_no_answer(scene):
    afar = find(scene, RigidTransform(np.array([2.0, 0.0, 1.0])), attempts=2)[0]
    assert (afar.q, afar.failure, afar.attempts) == (None, Failure.NOT_FOUND, 2)
    blocked = find(scene, gripper_pose(np.array([0.5, 0.0, 0.51]), 0))[0]
    assert blocked.failure == Failure.BLOCKED
    near = find(scene, scene.forward(HOME), margin=0.03, attempts=1)[0]
    assert near.failure == Failure.SELF_COLLISION
