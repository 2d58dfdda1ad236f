"""Forward kinematics, winding and distances of the planning scene."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from models.dh import GEN3_DH, forward_kinematics
from models.errors import ModelError
from models.scenes.planning_scene import HOME, PlanningScene
from models.task.spaces import GRIPPER_NAMES, R_WG

BASE_HEIGHT, TOOL = 0.5, 0.1425


def random_postures(scene, count, seed=0):
    low, high = np.maximum(scene.lower, -np.pi), np.minimum(scene.upper, np.pi)
    return np.random.default_rng(seed).uniform(low, high, (count, 7))


def test_forward_kinematics_agrees_with_denavit_and_hartenberg(empty):
    """The table rounds the vendor's offsets: half a millimetre at the flange."""
    Q = random_postures(empty, 50)
    R_BE, p_BE = forward_kinematics(GEN3_DH, Q)
    for q, R, p in zip(Q, R_BE, p_BE, strict=True):
        X_WG = empty.forward(q)
        # Gripper frame: the vendor's tool frame turned by -90° about z, and moved along it.
        flange = X_WG @ RigidTransform(RollPitchYaw(0, 0, np.pi / 2), np.array([0, 0, -TOOL]))
        p_WE = p + np.array([0, 0, BASE_HEIGHT])
        assert np.linalg.norm(flange.translation() - p_WE) < 5e-4
        np.testing.assert_allclose(flange.rotation().matrix(), R, atol=1e-4)


def test_jacobian_is_the_slope_of_forward_kinematics(empty):
    step = 1e-6
    for q in random_postures(empty, 3):
        J = empty.jacobian(q)
        for i in range(7):
            ahead, behind = (empty.forward(q + s * np.eye(7)[i] * step) for s in (1, -1))
            speed = (ahead.translation() - behind.translation()) / (2 * step)
            np.testing.assert_allclose(J[3:, i], speed, atol=1e-7)
            turn = ahead.rotation().matrix() @ behind.rotation().matrix().T
            turn = (turn - turn.T) / (4 * step)
            spin = [turn[2, 1], turn[0, 2], turn[1, 0]]
            np.testing.assert_allclose(J[:3, i], spin, atol=1e-7)


def test_error_measures_position_and_angle(empty):
    X = empty.forward(HOME)
    moved = RigidTransform(RollPitchYaw(0.0, 0.3, 0.0), np.array([0.0, 0.02, 0.0]))
    position, angle = empty.error(HOME, X @ moved)
    assert position == pytest.approx(0.02)
    assert angle == pytest.approx(0.3)
    assert max(empty.error(HOME, X)) < 1e-12


def test_winding_keeps_the_pose_and_the_limited_joints(empty):
    turns = 2 * np.pi * np.array([3, 0, -2, 0, 1, 0, -5])
    np.testing.assert_allclose(empty.wind(HOME + turns, HOME), HOME, atol=1e-12)
    beyond = HOME + 2 * np.pi
    np.testing.assert_allclose(empty.wind(beyond, HOME)[[1, 3, 5]], beyond[[1, 3, 5]])


def test_limits_are_the_vendors(empty):
    np.testing.assert_array_equal(empty.continuous, [True, False] * 3 + [True])
    np.testing.assert_allclose(empty.upper[[1, 3, 5]], [2.24, 2.57, 2.09])
    assert empty.within_limits(HOME)
    assert not empty.within_limits(HOME + 3.0)


def test_home_is_free_with_and_without_the_cube(empty, carrying):
    assert empty.is_free(HOME, 0.02)
    assert carrying.is_free(HOME, 0.02)


def test_clearance_names_the_cube_in_the_way(empty):
    before_a_pad = RigidTransform(np.array([0.0, 0.045, 0.045]))
    empty.place_cube(empty.forward(HOME) @ before_a_pad)
    clearance = empty.clearance(HOME)
    empty.place_cube(None)
    assert "cube::cube" in clearance.bodies
    assert 0.0 < clearance.distance < 0.024
    assert "cube::cube" not in (empty.clearance(HOME).bodies or ())


def test_cube_on_the_table_is_no_collision(empty):
    empty.place_cube(RigidTransform(np.array([0.55, 0.0, 0.52])))
    assert empty.is_free(HOME, 0.002)
    empty.place_cube(None)


def test_clearance_names_the_table(empty):
    q = np.array([0.0, 1.6, np.pi, -0.6, 0.0, -0.3, np.pi / 2])
    clearance = empty.clearance(q)
    assert clearance.distance < 0.0
    assert any(name.startswith("table") for name in clearance.bodies)
    assert not empty.is_free(q)


def test_carried_cylinder_contains_the_cube_however_turned(carrying):
    """Against an obstacle ahead, the hand with the cube is nearer than the empty hand."""
    scene = PlanningScene()
    scene.open_to(0.04)
    obstacle = carrying.forward(HOME) @ RigidTransform(np.array([0.0, 0.0, 0.07]))
    for each in (scene, carrying):
        each.place_cube(obstacle)
    nearer = carrying.clearance(HOME).distance
    assert nearer == pytest.approx(0.07 - 0.02 - 0.02 * np.sqrt(2), abs=1e-5)
    assert nearer < scene.clearance(HOME).distance
    carrying.place_cube(None)


def test_most_random_postures_are_free(empty):
    """A pair that always touched would leave no posture free."""
    free = [empty.is_free(q, 0.0) for q in random_postures(empty, 100, seed=1)]
    assert sum(free) > 50


def test_closing_axis_is_level_and_camera_on_the_upper_side():
    """How the gripper frame is to be read: y closes, the camera is on -x."""
    # The table prints 125° where 125.26° would be level.
    assert np.abs(R_WG[:, 2, 1]).max() < 0.005
    for R, name in zip(R_WG, GRIPPER_NAMES, strict=True):
        if not name.startswith("vertical"):
            assert -R[2, 0] > 0.5, name


NO_POSTURES = {
    "too few": HOME[:6],
    "too many": np.append(HOME, 0.0),
    "a batch": HOME[None],
    "not a number": np.where(np.arange(7) == 3, np.nan, HOME),
    "infinite": np.where(np.arange(7) == 2, np.inf, HOME),
    "complex": HOME + 0j,
    "text": [str(angle) for angle in HOME],
    "nothing": None,
}


@pytest.mark.parametrize("q", NO_POSTURES.values(), ids=NO_POSTURES)
def test_what_is_no_posture_is_refused_and_drake_does_not_end_the_program(empty, q):
    X_WG = empty.forward(HOME)
    for ask in (
        empty.forward,
        empty.clearance,
        empty.is_free,
        empty.jacobian,
        empty.within_limits,
        lambda q: empty.error(q, X_WG),
        lambda q: empty.hand_is_blocked(q, 0.002),
    ):
        with pytest.raises(ModelError, match=r"^q"):
            ask(q)


@pytest.mark.parametrize("number", [np.nan, "wide", None, 1j, [0.01, 0.02]])
def test_widths_and_distances_are_numbers(empty, number):
    with pytest.raises(ModelError, match="width"):
        empty.open_to(number)
    with pytest.raises(ModelError, match="limit of distances"):
        empty.is_free(HOME, number)


@pytest.mark.parametrize("X", [np.eye(4), "here", RigidTransform([np.nan, 0.0, 0.0])])
def test_poses_are_rigid_transforms(empty, X):
    with pytest.raises(ModelError, match="X_WO"):
        empty.place_cube(X)
    with pytest.raises(ModelError, match="X_WG"):
        empty.error(HOME, X)


def test_a_robot_is_one():
    with pytest.raises(ModelError, match="robot: 'gen3'"):
        PlanningScene(robot="gen3")


def test_everything_is_nearer_than_infinity(empty):
    assert np.isfinite(empty.clearance(HOME, np.inf).distance)


def test_a_joint_at_its_limit_is_within_by_a_rounding(empty):
    at = HOME + (empty.upper[5] - HOME[5]) * np.eye(7)[5]
    assert empty.within_limits(at + 1e-12)
    assert not empty.within_limits(at + 1e-6)
