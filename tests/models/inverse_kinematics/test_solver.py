"""Inverse kinematics, judged by forward kinematics and the distance query."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from models.errors import ModelError
from models.inverse_kinematics.optimised import Starts, follow, search
from models.inverse_kinematics.solution import ANGLE_TOLERANCE, POSITION_TOLERANCE, Failure, reaches
from models.inverse_kinematics.solver import IkSolver, solve
from models.maps.gripper_poses import gripper_pose
from models.scenes.planning_scene import HOME, MARGIN, PlanningScene
from models.scenes.robots import GEN3, GEN3_LITE

ROBOTS = {"gen3": GEN3, "gen3_lite": GEN3_LITE}


@pytest.fixture(scope="module", params=ROBOTS.values(), ids=ROBOTS)
def solver(request):
    return IkSolver(PlanningScene(robot=request.param))


@pytest.fixture(scope="module")
def home(solver):
    return solver.scene.robot.home


@pytest.fixture(scope="module")
def scene(solver):
    return solver.scene


def postures(scene, count, seed):
    low, high = np.maximum(scene.lower, -np.pi), np.minimum(scene.upper, np.pi)
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


def assert_solved(scene, answer, X_WG, seed):
    assert answer.failure is None
    position, angle = scene.error(answer.q, X_WG)
    assert position <= POSITION_TOLERANCE
    assert angle <= ANGLE_TOLERANCE
    assert scene.within_limits(answer.q)
    assert scene.clearance(answer.q).distance > MARGIN
    assert answer.clearance.distance == pytest.approx(scene.clearance(answer.q).distance)
    assert np.abs(answer.q - seed)[scene.continuous].max(initial=0.0) <= np.pi + 1e-9


def test_poses_of_free_postures_are_solved_free(scene, solver, home):
    """From home, mostly far away: at least 99.5 %."""
    free = [q for q in postures(scene, 300, seed=2) if scene.is_free(q)][:100]
    poses = [scene.forward(q) for q in free]
    answers = [solver.solve(X_WG) for X_WG in poses]
    solved = [answer for answer in answers if answer.q is not None]
    assert len(solved) == len(free) == 100
    for answer, X_WG in zip(answers, poses, strict=True):
        assert_solved(scene, answer, X_WG, home)


AWAY = {
    "gen3": np.array([0.4, 0.7, 2.8, -1.4, 0.2, 0.9, 1.0]),
    "gen3_lite": np.array([0.3, 0.4, 1.2, 0.5, -0.6, 0.2]),
}


def of(robot, table):
    """What a table says of a robot."""
    return table[next(name for name in ROBOTS if ROBOTS[name].station == robot.station)]


def test_a_free_posture_away_from_limits_answers_itself(scene, solver, home):
    for seed in (home, of(scene.robot, AWAY)):
        answer = solver.solve(scene.forward(seed), seed=seed)
        np.testing.assert_allclose(answer.q, seed, atol=1e-3)
    # Home is where a search starts if it is not told.
    np.testing.assert_allclose(solver.solve(scene.forward(home)).q, home, atol=1e-3)


def test_out_of_reach_is_proved_by_distance(solver):
    answer = solver.solve(RigidTransform(np.array([2.0, 0.0, 1.0])))
    assert (answer.q, answer.clearance) == (None, None)
    assert answer.failure == Failure.OUT_OF_REACH
    assert answer.reason() == "out of reach"


REASONS = {
    "gen3": [
        ((0.35, 0.075, 0.725), 5, Failure.JOINT_LIMIT),
        ((0.9, 0.4, 0.6), 0, Failure.NOT_FOUND),
        ((0.5, 0.0, 0.75), 0, Failure.OUT_OF_REACH),  # nearer than the elbow can fold
    ],
    "gen3_lite": [
        ((0.2, 0.0, 0.75), 0, Failure.JOINT_LIMIT),
        ((0.25, 0.0, 0.75), 0, Failure.NOT_FOUND),
        ((0.9, 0.4, 0.6), 0, Failure.OUT_OF_REACH),
        ((0.2, 0.0, 0.65), 0, Failure.SELF_COLLISION),
    ],
}


def test_why_there_is_no_answer(scene, solver):
    for p_WG, gripper, failure in of(scene.robot, REASONS):
        answer = solver.solve(gripper_pose(np.array(p_WG), gripper))
        assert (answer.q, answer.failure) == (None, failure)
        assert answer.reason().startswith(failure)


def test_hand_in_the_table_is_blocked(solver):
    answer = solver.solve(gripper_pose(np.array([0.5, 0.0, 0.51]), 0))
    assert answer.failure == Failure.BLOCKED
    assert "table::table" in answer.clearance.bodies
    assert answer.clearance.distance < MARGIN
    assert "table::table" in answer.reason()


def test_the_cube_in_the_way_is_named(scene, solver, home):
    X_WG = scene.forward(home)
    scene.place_cube(X_WG @ RigidTransform(np.array([0.0, 0.05, 0.0])))
    answer = solver.solve(X_WG)
    scene.place_cube(None)
    assert answer.failure == Failure.BLOCKED
    assert "cube::cube" in answer.clearance.bodies


def test_margin_beyond_the_collision_shapes_is_a_self_collision():
    """Wrist and hand of the Gen3 are never further apart than 25 mm."""
    scene = PlanningScene()
    answer = solve(scene, scene.forward(HOME), margin=0.03)
    assert answer.failure == Failure.SELF_COLLISION


def test_constraints_of_the_users_own_go_to_the_optimiser(scene, solver):
    X_WG = scene.forward(of(scene.robot, AWAY))
    free = solver.solve(X_WG)
    first = int(scene.arm_index[0])
    # Six joints leave a pose no choice near by.
    low, high = (0.05, 0.4) if len(scene.arm_index) > 6 else (-0.1, 0.1)

    def constrain(ik):
        ik.prog().AddBoundingBoxConstraint(free.q[0] + low, free.q[0] + high, ik.q()[first])

    held = solver.solve(X_WG, seed=free.q, constrain=constrain)
    assert held.failure is None
    assert reaches(scene, held.q, X_WG)
    assert free.q[0] + low - 1e-6 <= held.q[0] <= free.q[0] + high + 1e-6
    again = solver.solve(X_WG, seed=free.q, constrain=constrain)
    np.testing.assert_array_equal(held.q, again.q)


def test_answers_do_not_depend_on_what_was_asked_before(scene, solver):
    poses = [scene.forward(q) for q in postures(scene, 25, seed=6)]
    seeds = postures(scene, 25, seed=7)
    before = [solver.solve(X, seed=q) for X, q in zip(poses, seeds, strict=True)]
    again = [solver.solve(X, seed=q) for X, q in zip(poses[::-1], seeds[::-1], strict=True)]
    # A solver of the same scene, measured wherever the last question left the robot.
    short = [solve(scene, X, seed=q) for X, q in zip(poses, seeds, strict=True)]
    assert sum(answer.q is not None for answer in before) > 10
    for others in (again[::-1], short):
        for answer, other in zip(before, others, strict=True):
            np.testing.assert_array_equal(answer.q, other.q)
            assert (answer.failure, answer.clearance) == (other.failure, other.clearance)


def test_what_has_no_closed_form_here_goes_to_the_optimiser():
    """The Gen3 Lite with another limit on a joint is another arm."""
    lite = PlanningScene(robot=GEN3_LITE)
    lite.upper[0] = 2.0
    solver = IkSolver(lite)
    assert solver.closed_form is None
    q = np.array([0.3, 0.4, 1.2, 0.5, -0.6, 0.2])
    answer = solver.solve(lite.forward(q), seed=q + 0.1)
    assert answer.failure is None
    assert reaches(lite, answer.q, lite.forward(q))


@pytest.mark.parametrize("margin", [np.nan, np.inf, "wide", None, 1j])
def test_a_margin_is_a_number(scene, solver, home, margin):
    X_WG = scene.forward(home)
    for ask in (
        lambda: solver.solve(X_WG, margin=margin),
        lambda: search(scene, X_WG, Starts(home), margin=margin),
    ):
        with pytest.raises(ModelError, match="margin"):
            ask()


@pytest.mark.parametrize(
    "spoil", [lambda q: q[:-1], lambda q: q * np.nan, lambda q: q + 1j, lambda q: "home"]
)
def test_a_seed_is_a_posture(scene, solver, home, spoil):
    X_WG, seed = scene.forward(home), spoil(home)
    for ask in (
        lambda: solver.solve(X_WG, seed=seed),
        lambda: search(scene, X_WG, Starts(seed)),
        lambda: follow(scene, X_WG, seed),
    ):
        with pytest.raises(ModelError, match=r"seed|start"):
            ask()


@pytest.mark.parametrize("X_WG", [np.eye(4), None, RigidTransform([0.0, np.inf, 0.0])])
def test_a_pose_is_a_rigid_transform(scene, solver, home, X_WG):
    for ask in (lambda: solver.solve(X_WG), lambda: follow(scene, X_WG, home)):
        with pytest.raises(ModelError, match="X_WG"):
            ask()


def test_scenes_are_scenes_and_attempts_are_counted():
    with pytest.raises(ModelError, match="scene: str"):
        IkSolver("scene")
    with pytest.raises(ModelError, match="attempts: 0"):
        IkSolver(PlanningScene(), attempts=0)


def test_a_pose_with_a_joint_at_its_limit_is_solved(scene, solver):
    rng = np.random.default_rng(8)
    for q in postures(scene, 60, 8):
        joint = rng.choice(np.flatnonzero(~scene.continuous))
        q[joint] = rng.choice([-1.0, 1.0]) * scene.upper[joint]
        if scene.is_free(q, 2.0 * MARGIN):
            assert_solved(scene, solver.solve(scene.forward(q), seed=q), scene.forward(q), q)
