"""Plans of single actions, checked again with finer steps than the planner's."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from models.inverse_kinematics.solution import reaches
from models.maps.gripper_poses import grasp_position, gripper_pose
from models.maps.reachability_csv import read_map
from models.motion.failures import Infeasible
from models.motion.moves import CLOSE, OPEN, Grip, Move
from models.motion.planner import APPROACH, ROOM, ActionPlanner
from models.motion.timing import ACCELERATION_LIMIT, SCALE, time_path
from models.scenes.gripper import MAX_OPENING
from models.scenes.planning_scene import HOME, MARGIN
from models.task.spaces import CUBE_EDGE, HORIZONTAL, POSITIONS, TILTED, VERTICAL, Action, Kind

MAP = Path(__file__).parents[3] / "experiments" / "data" / "gen3" / "map.csv"
STEP = 0.01
"""Between two checks [rad]."""
CELL = 8
"""The middle of the lower layer."""


@pytest.fixture(scope="module")
def planner():
    return ActionPlanner(read_map(MAP))


def fine(waypoints):
    """Configurations along a path, `STEP` apart."""
    for a, b in pairwise(waypoints):
        count = int(np.ceil(np.abs(b - a).max() / STEP)) + 1
        yield from (a + (b - a) * share for share in np.linspace(0.0, 1.0, count))


def cube_at(x, y, yaw=0.0):
    return RigidTransform(RollPitchYaw(0.0, 0.0, yaw), np.array([x, y, 0.52]))


def off_centre(rng, position):
    x, y = POSITIONS[position][:2] + rng.uniform(-0.03, 0.03, 2)
    return cube_at(x, y, rng.uniform(-np.pi, np.pi))


@pytest.mark.parametrize("gripper", [*TILTED, 10, 13])
def test_grasp_comes_straight_down_on_the_measured_cube(planner, empty, carrying, gripper):
    rng = np.random.default_rng(gripper)
    position = 2 * int(rng.integers(9))
    X_WO = off_centre(rng, position)
    plan = planner.plan(Action(Kind.GRASP, gripper), position, None, HOME, MAX_OPENING, X_WO)
    approach, close, lift = plan
    assert isinstance(approach, Move) and isinstance(lift, Move) and close == CLOSE

    np.testing.assert_array_equal(approach.waypoints[0], HOME)
    X_WG = gripper_pose(grasp_position(X_WO.translation(), gripper), gripper)
    assert reaches(empty, approach.waypoints[-1], X_WG)
    empty.open_to(MAX_OPENING)
    empty.place_cube(X_WO)
    assert all(empty.is_free(q, 0.9 * MARGIN) for q in fine(approach.waypoints))
    # The last 8 cm are vertical.
    heights = [empty.forward(q).translation() - X_WG.translation() for q in approach.waypoints]
    down = next(i for i, p in enumerate(heights) if np.allclose(p, [0, 0, APPROACH], atol=1e-4))
    for q in fine(approach.waypoints[down:]):
        assert np.linalg.norm((empty.forward(q).translation() - X_WG.translation())[:2]) < 0.002

    np.testing.assert_array_equal(lift.waypoints[0], approach.waypoints[-1])
    np.testing.assert_allclose(
        carrying.wind(lift.waypoints[-1], HOME), planner.posture(position, gripper), atol=1e-9
    )
    empty.place_cube(None)
    empty.open_to(CUBE_EDGE)
    assert all(empty.is_free(q, 1e-3) for q in fine(lift.waypoints))
    empty.open_to(MAX_OPENING)


def test_grasp_opens_closed_fingers_first(planner):
    plan = planner.plan(Action(Kind.GRASP, 10), CELL, None, HOME, 0.0, cube_at(0.55, 0.0))
    assert plan[0] == OPEN
    assert [type(part) for part in plan] == [Grip, Move, Grip, Move]


def test_level_hands_do_not_grasp_from_the_table(planner):
    for gripper in HORIZONTAL:
        with pytest.raises(Infeasible, match="does not reach"):
            planner.plan(
                Action(Kind.GRASP, gripper), CELL, None, HOME, MAX_OPENING, cube_at(0.55, 0.0)
            )


@pytest.mark.parametrize("seed", range(12))
def test_carrying_is_free_along_the_path(planner, carrying, seed):
    rng = np.random.default_rng(seed)
    kind = [Kind.TRANSLATE, Kind.ROTATE][seed % 2]
    position, gripper, target = (int(i) for i in rng.integers(18, size=3))
    q = planner.posture(position, gripper)
    there = (target, gripper) if kind == Kind.TRANSLATE else (position, target)
    goal = planner.posture(*there)
    p_WO = POSITIONS[position] + rng.uniform(-0.01, 0.01, 3)
    X_WO = RigidTransform(RollPitchYaw(rng.uniform(-np.pi, np.pi, 3)), p_WO)
    (move,) = planner.plan(Action(kind, target), position, gripper, q, CUBE_EDGE, X_WO)
    np.testing.assert_array_equal(move.waypoints[0], q)
    np.testing.assert_allclose(carrying.wind(move.waypoints[-1], goal), goal, atol=1e-9)
    carrying.carry(gripper_pose(POSITIONS[position], gripper).inverse() @ X_WO)
    assert all(carrying.is_free(q, 0.45 * MARGIN) for q in fine(move.waypoints))


def test_a_cube_is_not_carried_close_to_the_table_where_there_is_another_way(planner, carrying):
    """Straight, its corner would pass 3 mm above the table."""
    q, goal = planner.posture(2, 16), planner.posture(2, 3)
    X_GO = RigidTransform(RollPitchYaw(0.0, np.pi / 4, 0.0), np.zeros(3))
    X_WO = gripper_pose(POSITIONS[2], 16) @ X_GO
    carrying.carry(X_GO)
    straight = fine([q, carrying.wind(goal, q)])
    assert 0.0 < min(carrying.clearance(each, 0.1).distance for each in straight) < 0.5 * ROOM
    (move,) = planner.plan(Action(Kind.ROTATE, 3), 2, 16, q, CUBE_EDGE, X_WO)
    assert len(move.waypoints) == 3
    assert all(carrying.is_free(each, 0.9 * ROOM) for each in fine(move.waypoints))


def test_a_search_finds_a_way_where_no_via_does(planner, carrying):
    position, gripper, target = 6, 3, 0
    action, q = Action(Kind.ROTATE, target), planner.posture(position, gripper)
    X_WO = RigidTransform(POSITIONS[position])
    without = ActionPlanner(read_map(MAP), search=False)
    with pytest.raises(Infeasible, match="no free path"):
        without.plan(action, position, gripper, q, CUBE_EDGE, X_WO)
    (move,) = planner.plan(action, position, gripper, q, CUBE_EDGE, X_WO)
    goal = planner.posture(position, target)
    np.testing.assert_allclose(carrying.wind(move.waypoints[-1], goal), goal, atol=1e-9)
    assert all(carrying.is_free(q, 0.5 * MARGIN) for q in fine(move.waypoints))
    (again,) = planner.plan(action, position, gripper, q, CUBE_EDGE, X_WO)
    np.testing.assert_array_equal(again.waypoints, move.waypoints)


@pytest.mark.parametrize("seed", range(4))
def test_what_is_commanded_is_free_and_within_the_limits_at_every_moment(
    planner, empty, carrying, seed
):
    """Rounded corners included: what the planner checked is what the arm will do."""
    rng = np.random.default_rng(seed)
    position, gripper = 2 * int(rng.integers(9)), int(rng.choice(VERTICAL))
    X_WO = off_centre(rng, position)
    action = Action(Kind.GRASP, gripper)
    approach, _, lift = planner.plan(action, position, None, HOME, MAX_OPENING, X_WO)
    q, X_held = lift.waypoints[-1], RigidTransform(POSITIONS[position])
    _, withdrawal = planner.plan(Action(Kind.DROP), position, gripper, q, CUBE_EDGE, X_held)
    assert approach.cuts.max() > 0.0 and withdrawal.cuts.max() > 0.0
    empty.open_to(MAX_OPENING)
    for move, cube in ((approach, X_WO), (withdrawal, None)):
        empty.place_cube(cube)
        motion = time_path(move.waypoints, planner.velocity_limit, cuts=move.cuts)
        times = np.linspace(0.0, motion.end_time(), 400)
        assert all(empty.is_free(q, 0.45 * MARGIN) for q in motion.vector_values(times).T)
        velocity, acceleration = (
            np.abs(motion.MakeDerivative(order).vector_values(times)) for order in (1, 2)
        )
        assert (velocity.max(axis=1) <= SCALE * planner.velocity_limit * 1.001).all()
        assert acceleration.max() <= SCALE * ACCELERATION_LIMIT * 1.001
    empty.place_cube(None)


def test_endless_joints_never_turn_more_than_half_way(planner, carrying):
    q = planner.posture(CELL, 10)
    wound = q + 2 * np.pi * np.array([2, 0, 0, 0, -1, 0, 3])
    for gripper in VERTICAL[1:]:
        (move,) = planner.plan(
            Action(Kind.ROTATE, gripper),
            CELL,
            10,
            wound,
            CUBE_EDGE,
            RigidTransform(POSITIONS[CELL]),
        )
        assert np.abs(np.diff(move.waypoints, axis=0)).max() <= np.pi + 1e-9


@pytest.mark.parametrize("gripper", [0, 3, 5, 7, 12])
@pytest.mark.parametrize("position", [CELL, 1])
def test_drop_opens_withdraws_and_goes_home(planner, empty, carrying, position, gripper):
    q = planner.posture(position, gripper)
    X_WO = RigidTransform(POSITIONS[position])
    opening, move = planner.plan(Action(Kind.DROP), position, gripper, q, CUBE_EDGE, X_WO)
    assert opening == OPEN
    np.testing.assert_array_equal(move.waypoints[0], q)
    np.testing.assert_allclose(carrying.wind(move.waypoints[-1], HOME), HOME, atol=1e-9)
    empty.open_to(MAX_OPENING)
    empty.place_cube(None)
    assert all(empty.is_free(q, 0.9 * MARGIN) for q in fine(move.waypoints))


@pytest.mark.parametrize(
    ("action", "position", "gripper", "failure"),
    [
        (Action(Kind.GRASP, 10), CELL, 10, "unfit"),
        (Action(Kind.DROP), CELL, None, "unfit"),
        (Action(Kind.ROTATE, 3), CELL, None, "unfit"),
        (Action(Kind.ROTATE, 10), CELL, 10, "unfit"),
        (Action(Kind.TRANSLATE, CELL), CELL, 10, "unfit"),
        (Action(Kind.DROP), -1, 10, "unfit"),
        (Action(Kind.TRANSLATE, 12), CELL, 1, "out of reach"),
        (Action(Kind.GRASP, HORIZONTAL[0]), CELL, None, "out of reach"),
    ],
)
def test_actions_that_cannot_be_carried_out_fail_by_kind(
    planner, action, position, gripper, failure
):
    q = HOME if gripper is None else planner.posture(CELL, gripper)
    with pytest.raises(Infeasible) as refused:
        planner.plan(action, position, gripper, q, CUBE_EDGE, RigidTransform(POSITIONS[CELL]))
    assert refused.value.failure == failure
    assert refused.value.failure.is_foreseen


def test_plans_do_not_depend_on_what_was_planned_before(planner):
    def plan(who):
        return who.plan(
            Action(Kind.GRASP, 7), CELL, None, HOME, MAX_OPENING, cube_at(0.56, 0.01, 0.3)
        )

    planner.plan(Action(Kind.DROP), CELL, 5, planner.posture(CELL, 5), CUBE_EDGE, cube_at(0.5, 0.0))
    for part, other in zip(plan(planner), plan(ActionPlanner(read_map(MAP))), strict=True):
        if isinstance(part, Move):
            np.testing.assert_array_equal(part.waypoints, other.waypoints)
