"""Single poses: what they are judged by, and the turn of the wrist."""

import numpy as np
import pytest

from models.inverse_kinematics.solution import Failure, reaches
from models.maps.gripper_poses import Layer, grasp_position, gripper_pose
from models.maps.pose_solver import CLOSED_MARGIN, PoseSolver
from models.scenes.planning_scene import HOME, MARGIN, PlanningScene
from models.task.spaces import CUBE_EDGE, VERTICAL

CELL = np.array([0.55, 0.0, 0.55])
CUBE = np.array([0.55, 0.0, 0.52])


@pytest.fixture(scope="module")
def solver():
    return PoseSolver(seed=0)


def test_streams_of_random_numbers_depend_on_the_pose_alone(solver):
    first = solver.alone(Layer.CELL, CELL, 8)
    solver.alone(Layer.CELL, CELL, 9)
    again = PoseSolver(seed=0).alone(Layer.CELL, CELL, 8)
    np.testing.assert_array_equal([e.q for e in first], [e.q for e in again])


def test_answers_are_wound_towards_home(solver):
    for entry in solver.alone(Layer.CELL, CELL, 6):
        assert np.abs(entry.q - HOME)[::2].max() <= np.pi + 1e-9


def test_vertical_hands_differ_in_joint_seven_alone(solver):
    first = solver.alone(Layer.CELL, CELL, VERTICAL[0])[0]
    scene = PlanningScene(carrying=True)
    for gripper in VERTICAL[1:]:
        turned = solver.turned(first, gripper)
        np.testing.assert_array_equal(turned.q[:6], first.q[:6])
        assert reaches(scene, turned.q, gripper_pose(CELL, gripper))
        assert turned.attempts == 0
    assert solver.turned(first, 5) is None


def test_grasp_on_the_table_is_judged_open_and_closed(solver):
    entry = solver.alone(Layer.GRASP, grasp_position(CUBE, 10), 10)[0]
    scene = PlanningScene()
    assert scene.is_free(entry.q, MARGIN)
    scene.open_to(CUBE_EDGE)
    assert not scene.is_free(entry.q, MARGIN)
    assert scene.is_free(entry.q, CLOSED_MARGIN)
    assert entry.clearance.distance == pytest.approx(0.0012, abs=1e-4)


def test_tilted_hands_would_touch_the_table_without_the_retreat(solver):
    """Why grasps stop short of the cube's centre."""
    assert solver.alone(Layer.GRASP, grasp_position(CUBE, 5), 5)[0].value == 1
    assert solver.alone(Layer.GRASP, CUBE, 5)[0].value == 0


def test_level_hand_at_a_cube_on_the_table_is_blocked(solver):
    entry = solver.alone(Layer.GRASP, grasp_position(CUBE, 0), 0)[0]
    assert entry.value == 0
    assert entry.q is None
    assert entry.failure == Failure.BLOCKED
