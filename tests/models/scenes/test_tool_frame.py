"""Kinova's tool frame and the gripper frame: fixed to one another, there and back."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from models.dh import GEN3_DH, forward_kinematics
from models.scenes.gripper import TCP_FROM_FLANGE
from models.scenes.tool_frame import gripper_to_tool, tool_to_gripper

BASE = np.array([0.0, 0.0, 0.5])


@pytest.fixture(scope="module")
def postures(empty):
    rng = np.random.default_rng(0)
    low, high = np.maximum(empty.lower, -np.pi), np.minimum(empty.upper, np.pi)
    return rng.uniform(low, high, (50, 7))


def test_the_tool_is_120_mm_along_the_approach_and_not_turned(empty, postures):
    """Against the vendor's end effector in Drake, and by its Denavit-Hartenberg parameters."""
    plant = empty.plant
    for q in postures:
        X_WT = gripper_to_tool(empty.forward(q))
        end_effector = plant.GetFrameByName("end_effector_link").CalcPoseInWorld(empty.context)
        wanted = end_effector @ RigidTransform([0.0, 0.0, 0.12])
        assert X_WT.IsNearlyEqualTo(wanted, 1e-12)
        R, p = forward_kinematics(GEN3_DH, q)
        np.testing.assert_allclose(X_WT.translation(), BASE + p + 0.12 * R[:, 2], atol=6e-4)
        np.testing.assert_allclose(X_WT.rotation().matrix(), R, atol=1e-4)


def test_at_zero_the_tool_is_as_high_as_an_arm_reports(empty):
    """1.308 m, by Kinovarobotics/ros_kortex issue 318; the arm was calibrated, the model is not."""
    height = gripper_to_tool(empty.forward(np.zeros(7))).translation()[2] - BASE[2]
    assert height == pytest.approx(1.308, abs=1e-3)


def test_in_numbers():
    """G looking down with y to the world's y: T is 22.5 mm above, its x along G's y."""
    X_WG = RigidTransform(RollPitchYaw(np.pi, 0.0, 0.0), [0.5, 0.1, 0.2])
    X_WT = gripper_to_tool(X_WG)
    np.testing.assert_allclose(X_WT.translation(), [0.5, 0.1, 0.2 + TCP_FROM_FLANGE - 0.12])
    R_WG, R_WT = X_WG.rotation().matrix(), X_WT.rotation().matrix()
    np.testing.assert_allclose(R_WT[:, 0], R_WG[:, 1], atol=1e-15)
    np.testing.assert_allclose(R_WT[:, 1], -R_WG[:, 0], atol=1e-15)
    np.testing.assert_allclose(R_WT[:, 2], R_WG[:, 2], atol=1e-15)


def test_there_and_back(empty, postures):
    for q in postures:
        X = empty.forward(q)
        assert tool_to_gripper(gripper_to_tool(X)).IsNearlyEqualTo(X, 1e-14)
        assert gripper_to_tool(tool_to_gripper(X)).IsNearlyEqualTo(X, 1e-14)
