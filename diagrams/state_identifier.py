"""Which state the environment is in, from measured poses (thesis 5.8.1)."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from models.rotations import geodesic_angle
from models.task.discretise import identify
from models.task.spaces import LOST, REST_HEIGHT

LEAST_FORCE = 10.0
"""Pad force [N] below which nothing is held; a closed empty gripper has none at its stop."""
OPENINGS = (0.035, 0.062)
"""Openings [m] between which the pads can be on the cube: 40 mm flush, 56.6 mm on its edges."""
REACH = 0.03
"""Largest distance [m] of a held cube's centre from the tool centre point."""

FLAT_HEIGHT, FLAT_ANGLE = 0.003, np.radians(3.0)
"""How far a cube that lies flat may be above or below, and tilted [m], [rad]."""
REST_SPAN, REST_TRAVEL, REST_TURN = 0.2, 0.0005, np.radians(1.0)
"""How far a cube at rest may travel and turn in a time [s], [m], [rad].

Its speed at one moment says little: the solver lets a lying cube tremble, within 0.04 mm, at up to
0.016 m/s and 0.7 rad/s.
"""


def is_held(p_GO: np.ndarray, opening: float, force: float) -> bool:
    """Whether the gripper holds the cube.

    Args:
        p_GO: the cube's centre from the tool centre point ``[3]`` [m]; any axes.
        opening: between the pads [m].
        force: of each pad [N].
    """
    return (
        force >= LEAST_FORCE
        and OPENINGS[0] <= opening <= OPENINGS[1]
        and float(np.linalg.norm(p_GO)) <= REACH
    )


def identify_state(X_WO: RigidTransform, X_WG: RigidTransform, held: bool) -> int:
    """Index of the state: cube at X_WO, tool centre point at X_WG, the cube held or not."""
    found = identify(
        X_WO.rotation().matrix(),
        X_WO.translation(),
        X_WG.rotation().matrix(),
        X_WG.translation(),
        held,
    )
    return int(found.state)


def tilt(X_WO: RigidTransform) -> float:
    """By how much the face of a cube that is nearest to being down is not level [rad]."""
    return float(np.arccos(min(1.0, float(np.abs(X_WO.rotation().matrix()[2]).max()))))


def lying_state(X_WO: RigidTransform, X_before: RigidTransform) -> int:
    """Index of the state of a cube that lies at rest on the table, flat on a face; else *lost*.

    Success is judged by this, from what the simulator knows: whatever hand and sensors tell does
    not count.

    Args:
        X_WO: the cube's true pose.
        X_before: the same `REST_SPAN` seconds before.
    """
    state = identify_state(X_WO, RigidTransform(), False)
    flat = abs(X_WO.translation()[2] - REST_HEIGHT) <= FLAT_HEIGHT and tilt(X_WO) <= FLAT_ANGLE
    return state if flat and _rests(X_WO, X_before) else LOST


def carried_state(X_WO: RigidTransform, X_WG: RigidTransform, X_before: RigidTransform) -> int:
    """Index of the state of a held cube that rests in the hand; else *lost*.

    Success is judged by this where the goal is to hold the cube.

    Args:
        X_WO: the cube's true pose.
        X_WG: the tool centre point's.
        X_before: the cube's in the hand, X_GO, `REST_SPAN` seconds before.
    """
    X_GO = X_WG.inverse() @ X_WO
    return identify_state(X_WO, X_WG, True) if _rests(X_GO, X_before) else LOST


def _rests(X: RigidTransform, X_before: RigidTransform) -> bool:
    """Whether a pose stayed, by what `REST_SPAN` allows."""
    turn = geodesic_angle(X.rotation().matrix(), X_before.rotation().matrix())
    travel = float(np.linalg.norm(X.translation() - X_before.translation()))
    return travel <= REST_TRAVEL and float(turn) <= REST_TURN


class StateIdentifier(LeafSystem):
    """Turns measured poses into the index of a task state.

    ::

                                   ┌─────────────────┐
                    object.pose ───┤                 │
                       tcp.pose ───┤ StateIdentifier ├── task.state
      gripper.position_measured ───┤                 │
         gripper.force_measured ───┤                 │
                                   └─────────────────┘

    `task.state` is the index of `models.task`, a vector of one: free, held or *lost*.
    """

    def __init__(self) -> None:
        """Declare the ports."""
        super().__init__()
        pose = AbstractValue.Make(RigidTransform())
        self._object = self.DeclareAbstractInputPort("object.pose", pose)
        self._tcp = self.DeclareAbstractInputPort("tcp.pose", pose)
        self._opening = self.DeclareVectorInputPort("gripper.position_measured", 1)
        self._force = self.DeclareVectorInputPort("gripper.force_measured", 1)
        self.DeclareVectorOutputPort("task.state", 1, self._calc_state)

    def _calc_state(self, context: Context, output: BasicVector) -> None:
        X_WO, X_WG = self._object.Eval(context), self._tcp.Eval(context)
        p_GO = X_WO.translation() - X_WG.translation()
        held = is_held(p_GO, self._opening.Eval(context)[0], self._force.Eval(context)[0])
        output[0] = identify_state(X_WO, X_WG, held)
