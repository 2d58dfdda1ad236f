import numpy as np
import pytest
from pydrake.common.eigen_geometry import Quaternion
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialVelocity
from pydrake.systems.analysis import Simulator

from diagrams.state_identifier import (
    REST_SPAN,
    StateIdentifier,
    carried_state,
    is_held,
    lying_state,
)
from diagrams.station import Station
from models.scenes.planning_scene import HOME as Q_HOME
from models.task.spaces import GOAL_STATE, LOST, POSITIONS, R_WG, R_WO, REST_HEIGHT, State


def identify(X_WO, X_WG, opening, force):
    identifier = StateIdentifier()
    context = identifier.CreateDefaultContext()
    identifier.GetInputPort("object.pose").FixValue(context, AbstractValue.Make(X_WO))
    identifier.GetInputPort("tcp.pose").FixValue(context, AbstractValue.Make(X_WG))
    identifier.GetInputPort("gripper.position_measured").FixValue(context, [opening])
    identifier.GetInputPort("gripper.force_measured").FixValue(context, [force])
    return int(identifier.GetOutputPort("task.state").Eval(context)[0])


HOME = RigidTransform(RotationMatrix(R_WG[0]), [0.6, 0.0, 0.9])


@pytest.mark.parametrize("state", [State(2, 0), State(0, 13), State(16, 47)])
def test_a_cube_on_the_table_is_free(state):
    p = [*POSITIONS[state.position][:2], REST_HEIGHT]
    X_WO = RigidTransform(RotationMatrix(R_WO[state.orientation]), p)
    assert identify(X_WO, HOME, 0.085, 0.0) == state.index


@pytest.mark.parametrize("state", [State(3, 5, 10), State(0, 24, 5), State(17, 40, 0)])
def test_a_gripped_cube_is_held_where_the_gripper_is(state):
    X_WG = RigidTransform(RotationMatrix(R_WG[state.gripper]), POSITIONS[state.position])
    p_WO = POSITIONS[state.position] + 0.005 * R_WG[state.gripper][:, 2]
    X_WO = RigidTransform(RotationMatrix(R_WO[state.orientation]), p_WO)
    assert identify(X_WO, X_WG, 0.0396, 40.0) == state.index


def test_off_the_table_is_lost():
    assert identify(RigidTransform([0.9, 0.0, 0.02]), HOME, 0.085, 0.0) == LOST


@pytest.mark.parametrize(
    ("distance", "opening", "force"),
    [(0.0, 0.0, 40.0), (0.0, 0.085, 40.0), (0.0, 0.04, 0.0), (0.05, 0.04, 40.0)],
    ids=["closed on nothing", "open", "no force", "something else in the hand"],
)
def test_not_held(distance, opening, force):
    assert not is_held(np.array([distance, 0.0, 0.0]), opening, force)


LIES = RigidTransform([0.55, 0.0, 0.52])


def turned(angle):
    return RigidTransform(RotationMatrix.MakeZRotation(angle), LIES.translation())


@pytest.mark.parametrize(
    ("X_WO", "X_before", "lies"),
    [
        (LIES, LIES, True),
        (LIES, RigidTransform([0.5502, 0.0, 0.52]), True),
        (LIES, RigidTransform([0.551, 0.0, 0.52]), False),
        (LIES, turned(0.005), True),
        (LIES, turned(0.05), False),
        (RigidTransform([0.55, 0.0, 0.5225]), None, True),
        (RigidTransform([0.55, 0.0, 0.525]), None, False),
        (RigidTransform(RotationMatrix.MakeXRotation(0.1), [0.55, 0.0, 0.52]), None, False),
        (RigidTransform([0.7, 0.0, 0.52]), None, False),
        (RigidTransform([0.55, 0.0, 0.02]), None, False),
    ],
)
def test_a_cube_lies_where_it_is_flat_and_at_rest_on_the_grid(X_WO, X_before, lies):
    found = lying_state(X_WO, X_before or X_WO)
    assert found == (State(8, 0).index if lies else LOST)


def test_a_cube_that_the_solver_lets_tremble_is_at_rest():
    """As an episode left one: it rocks by 0.05° about its diagonal, and that does not die away."""
    station = Station(time_step=0.002)
    simulator = Simulator(station)
    root = simulator.get_mutable_context()
    tremble = RotationMatrix(Quaternion(0.999999793, 4.541e-4, -4.540e-4, 8.12e-5))
    station.initialize(root, X_WO=RigidTransform(tremble, [0.499847, -0.000247, 0.520006]))
    station.GetInputPort("arm.position_command").FixValue(root, Q_HOME)
    station.GetInputPort("gripper.position_command").FixValue(root, [0.085])
    plant, cube = station.plant, station.plant.GetBodyByName("cube")
    context = plant.GetMyMutableContextFromRoot(root)
    velocity = SpatialVelocity([0.0877, -0.0877, 0.0], [-0.00176, -0.00176, 0.011])
    plant.SetFreeBodySpatialVelocity(context=context, body=cube, V_JpJc=velocity)
    poses, speeds = [], []
    for step in range(500):
        simulator.AdvanceTo(0.002 * (step + 1))
        poses.append(RigidTransform(cube.EvalPoseInWorld(context)))
        speeds.append(cube.EvalSpatialVelocityInWorld(context).translational())
    assert np.linalg.norm(speeds[-100:], axis=1).max() > 0.01
    span = round(REST_SPAN / 0.002)
    names = {lying_state(*pair) for pair in zip(poses[span:], poses[:-span], strict=True)}
    assert names == {GOAL_STATE}


def test_a_held_cube_is_judged_where_it_rests_in_the_hand():
    state = State(3, 5, 10)
    X_WG = RigidTransform(RotationMatrix(R_WG[state.gripper]), POSITIONS[state.position])
    X_WO = RigidTransform(RotationMatrix(R_WO[state.orientation]), POSITIONS[state.position])
    rests = X_WG.inverse() @ X_WO
    assert carried_state(X_WO, X_WG, rests) == state.index
    slides = RigidTransform([0.0, 0.0, 0.002]) @ rests
    turns = RigidTransform(RotationMatrix.MakeXRotation(0.1), [0.0, 0.0, 0.0]) @ rests
    assert carried_state(X_WO, X_WG, slides) == carried_state(X_WO, X_WG, turns) == LOST
