"""Inverse kinematics, judged by forward kinematics and the distance query."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from models.gen3 import closed_form as gen3_ik
from models.gen3.newton import MET
from models.inverse_kinematics.solution import ANGLE_TOLERANCE, POSITION_TOLERANCE, Failure, reaches
from models.inverse_kinematics.solver import closed_form, posture_cost, solve, solve_batch
from models.maps.gripper_poses import gripper_pose
from models.scenes.planning_scene import HOME, MARGIN, PlanningScene


@pytest.fixture(scope="module")
def scene():
    return PlanningScene()


def postures(scene, count, seed):
    low, high = np.maximum(scene.lower, -np.pi), np.minimum(scene.upper, np.pi)
    return np.random.default_rng(seed).uniform(low, high, (count, 7))


def assert_solved(scene, answer, X_WG, seed):
    assert answer.failure is None
    position, angle = scene.error(answer.q, X_WG)
    assert position <= POSITION_TOLERANCE
    assert angle <= ANGLE_TOLERANCE
    assert scene.within_limits(answer.q)
    assert scene.clearance(answer.q).distance > MARGIN
    assert answer.clearance.distance == pytest.approx(scene.clearance(answer.q).distance)
    assert np.abs(answer.q - seed)[scene.continuous].max() <= np.pi + 1e-9


def test_poses_of_random_postures_are_met(scene):
    """Collisions aside: at least 999 of 1,000, each confirmed by the plant."""
    arm = closed_form(scene)
    poses = [scene.forward(q) for q in postures(scene, 1000, seed=1)]
    R, p = (np.array(part) for part in zip(*map(arm.end_effector, poses), strict=True))
    q, met = gen3_ik.solve_first(R, p, np.linspace(-np.pi, np.pi, 64))
    confirmed = [
        status == MET and reaches(scene, answer, X_WG)
        for answer, status, X_WG in zip(q, met, poses, strict=True)
    ]
    assert sum(confirmed) >= 999


def test_poses_of_free_postures_are_solved_free(scene):
    """From home, mostly far away: at least 99.5 %."""
    free = [q for q in postures(scene, 130, seed=2) if scene.is_free(q)][:100]
    poses = [scene.forward(q) for q in free]
    answers = solve_batch(scene, poses)
    solved = [answer for answer in answers if answer.q is not None]
    assert len(solved) == 100
    for answer, X_WG in zip(answers, poses, strict=True):
        assert_solved(scene, answer, X_WG, HOME)


def test_answer_is_the_nearest_of_a_fine_sweep_of_the_redundancy(scene):
    arm = closed_form(scene)
    rng = np.random.default_rng(3)
    for q in [q for q in postures(scene, 30, seed=4) if scene.is_free(q)][:12]:
        X_WG, seed = scene.forward(q), q + rng.uniform(-0.4, 0.4, 7)
        R, p = arm.end_effector(X_WG)
        branches = gen3_ik.solve_batch(R[None], p[None], np.linspace(-np.pi, np.pi, 2000))
        every = scene.wind(branches.reshape(-1, 7)[~np.isnan(branches.reshape(-1, 7)[:, 0])], seed)
        cost = posture_cost(scene, every, seed)
        nearest = next(i for i in np.argsort(cost) if scene.is_free(every[i]))
        answer = solve(scene, X_WG, seed=seed)
        assert_solved(scene, answer, X_WG, seed)
        assert posture_cost(scene, answer.q, seed) <= cost[nearest] + 0.01


def test_a_free_posture_away_from_limits_answers_itself(scene):
    for seed in (HOME, np.array([0.4, 0.7, 2.8, -1.4, 0.2, 0.9, 1.0])):
        answer = solve(scene, scene.forward(seed), seed=seed)
        np.testing.assert_allclose(answer.q, seed, atol=1e-3)


def test_a_posture_at_a_limit_counts_as_further_away(scene):
    middle, edge = np.zeros(7), np.zeros(7)
    edge[5] = scene.upper[5] - 1e-3
    assert posture_cost(scene, middle, middle) == 0.0
    assert posture_cost(scene, edge, edge) == pytest.approx(1.0, abs=0.02)
    # Where it can, the answer moves off the limit.
    answer = solve(scene, scene.forward(edge), seed=edge)
    assert abs(answer.q[5]) < edge[5] or np.linalg.norm(answer.q - edge) < 1e-3


def test_out_of_reach_is_proved_by_distance(scene):
    answer = solve(scene, RigidTransform(np.array([2.0, 0.0, 1.0])))
    assert (answer.q, answer.clearance) == (None, None)
    assert answer.failure == Failure.OUT_OF_REACH
    assert answer.reason() == "out of reach"


@pytest.mark.parametrize(
    ("p_WG", "gripper", "failure"),
    [
        ((0.35, 0.075, 0.725), 5, Failure.JOINT_LIMIT),
        ((0.9, 0.4, 0.6), 0, Failure.NOT_FOUND),
        ((0.5, 0.0, 0.75), 0, Failure.OUT_OF_REACH),  # nearer than the elbow can fold
    ],
)
def test_why_there_is_no_answer(scene, p_WG, gripper, failure):
    answer = solve(scene, gripper_pose(np.array(p_WG), gripper))
    assert (answer.q, answer.failure) == (None, failure)
    assert answer.reason().startswith(failure)


def test_hand_in_the_table_is_blocked(scene):
    answer = solve(scene, gripper_pose(np.array([0.5, 0.0, 0.51]), 0))
    assert answer.failure == Failure.BLOCKED
    assert "table::table" in answer.clearance.bodies
    assert answer.clearance.distance < MARGIN
    assert "table::table" in answer.reason()


def test_the_cube_in_the_way_is_named(scene):
    X_WG = scene.forward(HOME)
    scene.place_cube(X_WG @ RigidTransform(np.array([0.0, 0.05, 0.0])))
    answer = solve(scene, X_WG)
    scene.place_cube(None)
    assert answer.failure == Failure.BLOCKED
    assert "cube::cube" in answer.clearance.bodies


def test_margin_beyond_the_collision_shapes_is_a_self_collision(scene):
    """Wrist and hand are never further apart than 25 mm."""
    answer = solve(scene, scene.forward(HOME), margin=0.03)
    assert answer.failure == Failure.SELF_COLLISION


def test_constraints_of_the_users_own_go_to_the_optimiser(scene):
    X_WG = gripper_pose(np.array([0.55, 0.1, 0.6]), 6)
    free = solve(scene, X_WG)
    first = int(scene.arm_index[0])

    def constrain(ik):
        ik.prog().AddBoundingBoxConstraint(free.q[0] + 0.05, free.q[0] + 0.4, ik.q()[first])

    held = solve(scene, X_WG, seed=free.q, constrain=constrain)
    assert held.failure is None
    assert reaches(scene, held.q, X_WG)
    assert free.q[0] + 0.05 - 1e-6 <= held.q[0] <= free.q[0] + 0.4 + 1e-6
    again = solve(scene, X_WG, seed=free.q, constrain=constrain)
    np.testing.assert_array_equal(held.q, again.q)
