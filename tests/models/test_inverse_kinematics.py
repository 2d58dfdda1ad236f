"""Inverse kinematics, judged by forward kinematics."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from models.gripper_poses import gripper_pose
from models.inverse_kinematics import (
    ANGLE_TOLERANCE,
    LIMIT_MARGIN,
    POSITION_TOLERANCE,
    Failure,
    follow,
    solve,
    solve_all,
)
from models.kinematics import HOME, MARGIN, PlanningScene


@pytest.fixture(scope="module")
def scene():
    return PlanningScene()


def free_postures(scene, count):
    rng = np.random.default_rng(7)
    low = np.maximum(scene.lower, -np.pi) + 0.2
    high = np.minimum(scene.upper, np.pi) - 0.2
    postures = []
    while len(postures) < count:
        q = rng.uniform(low, high)
        if scene.is_free(q, 0.01):
            postures.append(q)
    return postures


def test_round_trip_from_random_free_postures(scene):
    rng = np.random.default_rng(8)
    for q in free_postures(scene, 100):
        X_WG = scene.forward(q)
        seed = q + rng.uniform(-0.15, 0.15, 7)
        answer = solve(scene, X_WG, seed=seed, rng=np.random.default_rng(0))
        assert answer.failure is None
        position, angle = scene.error(answer.q, X_WG)
        assert position <= POSITION_TOLERANCE
        assert angle <= ANGLE_TOLERANCE
        assert scene.within_limits(answer.q)
        assert answer.clearance.distance > MARGIN
        assert np.abs(answer.q - seed)[scene.continuous].max() <= np.pi + 1e-9


def test_far_seed_and_the_same_random_numbers_give_the_same_answer(scene):
    X_WG = gripper_pose(np.array([0.55, 0.1, 0.6]), 6)
    first, again = (solve(scene, X_WG, rng=np.random.default_rng(3)) for _ in range(2))
    np.testing.assert_array_equal(first.q, again.q)


def test_candidates_come_nearest_first_and_differ(scene):
    X_WG = gripper_pose(np.array([0.55, 0.0, 0.6]), 7)
    rng = np.random.default_rng(0)
    answers = solve_all(scene, X_WG, seed=HOME, attempts=20, candidates=4, rng=rng)
    distances = [np.linalg.norm(answer.q - HOME) for answer in answers]
    assert len(answers) == 4
    assert distances == sorted(distances)
    rng = np.random.default_rng(0)
    best = solve(scene, X_WG, attempts=20, candidates=4, rng=rng)
    np.testing.assert_array_equal(best.q, answers[0].q)


def test_following_stays_near_and_within_limits(scene):
    X_WG = scene.forward(HOME)
    nearby = RigidTransform(X_WG.rotation(), X_WG.translation() + np.array([0.02, -0.03, 0.02]))
    q = follow(scene, nearby, HOME)
    assert np.abs(q - HOME).max() < 0.3
    assert (q[~scene.continuous] < scene.upper[~scene.continuous] - LIMIT_MARGIN + 1e-12).all()
    assert follow(scene, RigidTransform(np.array([3.0, 0.0, 1.0])), HOME) is None


def test_out_of_reach_is_not_found(scene):
    answer = solve(scene, RigidTransform(np.array([2.0, 0.0, 1.0])))
    assert answer.q is None
    assert answer.failure == Failure.NOT_FOUND
    assert answer.clearance is None


def test_hand_in_the_table_is_blocked(scene):
    answer = solve(scene, gripper_pose(np.array([0.5, 0.0, 0.51]), 0), attempts=20)
    assert answer.failure == Failure.BLOCKED
    assert "table::table" in answer.clearance.bodies
    assert answer.clearance.distance < MARGIN


def test_margin_beyond_the_collision_shapes_is_a_collision(scene):
    """Wrist and hand are never further apart than 25 mm, and neither is furniture."""
    answer = solve(scene, scene.forward(HOME), margin=0.03)
    assert answer.failure == Failure.COLLISION
