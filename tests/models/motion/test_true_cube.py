"""Plans go by the cube as it lies: in the hand where it was measured, on the table flat."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from experiments.kit.shipped_data import load_planner
from models.errors import ModelError
from models.inverse_kinematics.solution import reaches
from models.inverse_kinematics.solver import IkSolver
from models.maps.gripper_poses import gripper_pose
from models.motion.cube import lying
from models.motion.failures import ActionFailure, Infeasible
from models.motion.families import families, first_that_works
from models.motion.moves import CLOSE, OPEN, Move
from models.motion.straight import straight_up
from models.scenes.gripper import MAX_OPENING
from models.scenes.planning_scene import HOME, MARGIN, PlanningScene
from models.task.spaces import (
    CUBE_EDGE,
    HORIZONTAL,
    N_XY,
    POSITIONS,
    R_WG,
    REST_HEIGHT,
    TABLE_TOP,
    VERTICAL,
    Action,
    Kind,
)

CELL = 8
CORNERS = 0.02 * np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8)


@pytest.fixture(scope="module")
def planner():
    return load_planner()


@pytest.mark.parametrize("gripper", [3, 5, 8, 10, 14])
@pytest.mark.parametrize("offset", [0.0, 0.02, 0.04])
def test_the_carried_cube_is_as_far_from_the_table_as_its_lowest_corner(
    planner, carrying, gripper, offset
):
    """The distance by hand: table top to the lowest of eight corners."""
    rng = np.random.default_rng(gripper)
    direction = rng.normal(size=3)
    X_GO = RigidTransform(
        RollPitchYaw(rng.uniform(-np.pi, np.pi, 3)), offset * direction / np.linalg.norm(direction)
    )
    X_WG = gripper_pose(POSITIONS[CELL], gripper)
    q = planner.posture(CELL, gripper)
    carrying.carry(X_GO)
    lowest = (X_WG @ X_GO @ CORNERS)[2].min() - TABLE_TOP
    found = carrying.clearance(q, 0.1)
    nearest_other = PlanningScene(carrying=False)
    nearest_other.open_to(CUBE_EDGE)
    assert found.distance == pytest.approx(
        min(lowest, nearest_other.clearance(q, 0.1).distance), abs=1e-5
    )


def test_an_empty_hand_carries_nothing(empty):
    with pytest.raises(ModelError, match="carrying=True"):
        empty.carry(RigidTransform())


@pytest.mark.parametrize(("down", "fits"), [(0.005, True), (0.035, False)])
def test_a_cube_that_hangs_low_is_not_carried_into_the_table(planner, down, fits):
    """The cylinder that all turns of a centred cube fill fits either way."""
    gripper, above, below = 10, 9, 8
    p_WO = POSITIONS[above] - [0.0, 0.0, down]
    X_WO = RigidTransform(RollPitchYaw(0.6, 0.6, 0.0), p_WO)
    lowest = (X_WO @ CORNERS)[2].min() - (POSITIONS[above] - POSITIONS[below])[2]
    assert (lowest > TABLE_TOP + MARGIN) == fits
    action, q = Action(Kind.TRANSLATE, below), planner.posture(above, gripper)
    if fits:
        (move,) = planner.plan(action, above, gripper, q, CUBE_EDGE, X_WO)
        assert isinstance(move, Move)
    else:
        with pytest.raises(Infeasible) as refused:
            planner.plan(action, above, gripper, q, CUBE_EDGE, X_WO)
        assert refused.value.failure == ActionFailure.NO_ROOM


def test_what_is_said_to_be_held_but_is_far_from_the_hand_is_lost(planner):
    q, far = planner.posture(9, 10), RigidTransform(POSITIONS[9] - [0.0, 0.0, 0.08])
    with pytest.raises(Infeasible) as refused:
        planner.plan(Action(Kind.TRANSLATE, 8), 9, 10, q, CUBE_EDGE, far)
    assert refused.value.failure == ActionFailure.GRIP_LOST


@pytest.mark.parametrize("seed", range(5))
def test_a_cube_on_the_table_lies_flat_whatever_was_measured(seed):
    rng = np.random.default_rng(seed)
    yaw, face = RotationMatrix.MakeZRotation(rng.uniform(-3, 3)), rng.integers(6)
    turns = [(0, 0), (np.pi, 0), (np.pi / 2, 0), (-np.pi / 2, 0), (0, np.pi / 2), (0, -np.pi / 2)]
    true = RigidTransform(
        yaw @ RollPitchYaw(*turns[face], 0.0).ToRotationMatrix(), [0.55, 0.02, REST_HEIGHT]
    )
    axis = rng.normal(size=2)
    axis = np.append(axis / np.linalg.norm(axis), 0.0)  # level, so that the yaw is not touched
    angle = np.radians(8.0)
    K = np.cross(np.eye(3), axis)
    tilt = RotationMatrix(np.eye(3) - np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)
    seen = RigidTransform(tilt @ true.rotation(), true.translation() + np.array([0.0, 0.0, 0.007]))
    assert lying(seen).IsNearlyEqualTo(true, 1e-9)


def test_a_grasp_goes_down_as_far_as_the_cube_lies(planner, empty):
    """Whatever height and tilt were measured: the hand would stop short, or touch the table."""
    seen = RigidTransform(RollPitchYaw(0.09, 0.0, 0.0), [0.56, 0.01, 0.527])
    approach, close, _ = planner.plan(Action(Kind.GRASP, 10), CELL, None, HOME, MAX_OPENING, seen)
    assert close == CLOSE
    at = empty.forward(approach.waypoints[-1]).translation()
    np.testing.assert_allclose(at, [0.56, 0.01, REST_HEIGHT], atol=2e-5)


@pytest.mark.parametrize("gripper", [1, 5, 10])
def test_other_families_reach_the_same_pose_by_another_posture(planner, carrying, gripper):
    X_WG, q = gripper_pose(POSITIONS[CELL], gripper), planner.posture(CELL, gripper)
    carrying.carry(RigidTransform())
    others = families(X_WG, q, IkSolver(carrying))
    assert others
    for other in others:
        assert reaches(carrying, other, X_WG) and carrying.is_free(other, MARGIN)
        assert np.abs(other - q).max() > 0.1


def test_the_next_family_is_tried_where_the_first_leads_nowhere():
    def plan(q):
        if q[0] < 2:
            raise Infeasible(ActionFailure.NO_PATH, f"not from {q[0]:.0f}")
        return "way"

    first, second, third = (np.full(7, float(i)) for i in range(3))
    assert first_that_works(plan, first, lambda: [second, third]) == "way"
    with pytest.raises(Infeasible, match="not from 0"):
        first_that_works(plan, first, lambda: [second])


@pytest.mark.parametrize("width", [MAX_OPENING, 0.0])
def test_a_hand_that_stands_about_the_cube_rises_before_it_opens_and_begins_anew(
    planner, empty, width
):
    X_WO = RigidTransform([*POSITIONS[CELL][:2], REST_HEIGHT])
    approach, _, _ = planner.plan(Action(Kind.GRASP, 10), CELL, None, HOME, MAX_OPENING, X_WO)
    about = approach.waypoints[-1]
    moved = RigidTransform(X_WO.rotation(), X_WO.translation() + np.array([0.03, 0.03, 0.0]))
    plan = planner.plan(Action(Kind.GRASP, 10), CELL, None, about, width, moved)
    away, *opening, again, close, _ = plan
    assert close == CLOSE and opening == ([OPEN] if width == 0.0 else [])
    first, last = (empty.forward(q).translation() for q in away.waypoints[[0, -1]])
    assert last[2] > first[2] + 0.045
    np.testing.assert_allclose(last[:2], first[:2], atol=1e-4)
    np.testing.assert_array_equal(again.waypoints[0], away.waypoints[-1])
    np.testing.assert_allclose(
        empty.forward(again.waypoints[-1]).translation(), moved.translation(), atol=2e-5
    )


def test_a_hand_between_cells_goes_to_its_cell_before_it_drops(planner, carrying):
    q = straight_up(planner._empty_hand(CUBE_EDGE, None), planner.posture(CELL, 10), 0.03)[-1]
    X_WO = RigidTransform(POSITIONS[CELL] + [0.0, 0.0, 0.03])
    there, opening, _ = planner.plan(Action(Kind.DROP), CELL, 10, q, CUBE_EDGE, X_WO)
    assert opening == OPEN
    assert reaches(carrying, there.waypoints[-1], gripper_pose(POSITIONS[CELL], 10))


@pytest.mark.parametrize(("dx", "dy"), [(0.06, 0.0), (-0.05, 0.04), (0.03, -0.09), (0.05, 0.13)])
def test_a_cube_beside_the_grid_is_grasped_where_it_lies(planner, empty, dx, dy):
    """Up to where the table ends or the arm: with some hand at least."""
    x, y = 0.55 + np.sign(dx) * 0.05 + dx, np.sign(dy) * 0.1 + dy
    position = int(np.linalg.norm(POSITIONS[: 2 * N_XY : 2, :2] - [x, y], axis=1).argmin()) * 2
    X_WO = RigidTransform(RollPitchYaw(0.0, 0.0, 0.3), [x, y, REST_HEIGHT])
    hands = [g for g in range(len(R_WG)) if g not in HORIZONTAL]
    reached = 0
    for gripper in hands:
        try:
            _, _, lift = planner.plan(
                Action(Kind.GRASP, gripper), position, None, HOME, MAX_OPENING, X_WO
            )
        except Infeasible:
            continue
        reached += 1
        end = empty.forward(lift.waypoints[-1]).translation()
        np.testing.assert_allclose(end, POSITIONS[position], atol=1e-4)
    assert reached >= len(VERTICAL)
