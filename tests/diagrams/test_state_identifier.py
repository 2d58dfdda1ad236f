import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialVelocity

from diagrams.state_identifier import StateIdentifier, is_held, lying_state
from models.task.spaces import LOST, POSITIONS, R_WG, R_WO, REST_HEIGHT, State


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


@pytest.mark.parametrize(
    ("X_WO", "speed", "lies"),
    [
        (RigidTransform([0.55, 0.0, 0.52]), 0.0, True),
        (RigidTransform([0.55, 0.0, 0.5225]), 0.005, True),
        (RigidTransform([0.55, 0.0, 0.525]), 0.0, False),
        (RigidTransform([0.55, 0.0, 0.52]), 0.05, False),
        (RigidTransform(RotationMatrix.MakeXRotation(0.1), [0.55, 0.0, 0.52]), 0.0, False),
        (RigidTransform([0.7, 0.0, 0.52]), 0.0, False),
        (RigidTransform([0.55, 0.0, 0.02]), 0.0, False),
    ],
)
def test_a_cube_lies_where_it_is_flat_and_at_rest_on_the_grid(X_WO, speed, lies):
    V_WO = SpatialVelocity(np.zeros(3), np.array([speed, 0.0, 0.0]))
    assert lying_state(X_WO, V_WO) == (State(8, 0).index if lies else LOST)
