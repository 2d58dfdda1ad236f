"""What the arm's hand holds stays where it is, however it was gripped."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator

from diagrams.station import TIME_STEP, Station
from models import PlanningScene, solve
from models.maps.gripper_poses import gripper_pose
from models.task.spaces import CUBE_EDGE

X_WG = gripper_pose(np.array([0.5, 0.0, 0.65]), 10)
SECONDS = 6.0


@pytest.fixture(scope="module")
def q():
    return solve(PlanningScene(), X_WG).q


def moved(q, degrees, time_step):
    """How far a cube moves in a hand that stands still [mm], [deg]."""
    yaw = np.radians(degrees)
    askew = RigidTransform(RotationMatrix.MakeZRotation(yaw), np.zeros(3))
    station = Station(time_step=time_step)
    simulator = Simulator(station)
    root = simulator.get_mutable_context()
    width = CUBE_EDGE * (np.cos(yaw) + np.sin(yaw)) + 1e-4
    station.initialize(root, X_WO=X_WG @ askew, q=q, width=width)
    station.GetInputPort("arm.position_command").FixValue(root, q)
    station.GetInputPort("gripper.position_command").FixValue(root, [0.0])

    def X_GO():
        tcp = station.GetOutputPort("tcp.pose").Eval(root)
        return tcp.inverse() @ station.GetOutputPort("object.pose").Eval(root)

    simulator.AdvanceTo(1.0)
    before = X_GO()
    simulator.AdvanceTo(1.0 + SECONDS)
    X = before.inverse() @ X_GO()
    angle = X.rotation().ToAngleAxis().angle()
    return 1e3 * np.linalg.norm(X.translation()), np.degrees(angle)


@pytest.mark.parametrize(("degrees", "turn"), [(35.0, 1.5), (45.0, 0.1)])
def test_a_cube_that_was_gripped_askew_creeps_little_and_less_with_half_the_step(q, degrees, turn):
    way, angle = moved(q, degrees, TIME_STEP)
    assert way < 0.15
    assert angle < turn
    finer, less = moved(q, degrees, TIME_STEP / 2)
    assert finer <= way
    assert less <= angle + 0.01
