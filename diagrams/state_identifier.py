"""Which state the environment is in, from measured poses (thesis 5.8.1)."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from models.task.discretise import identify

LEAST_FORCE = 10.0
"""Pad force [N] below which nothing is held; a closed empty gripper has none at its stop."""
OPENINGS = (0.035, 0.062)
"""Openings [m] between which the pads can be on the cube: 40 mm flush, 56.6 mm on its edges."""
REACH = 0.03
"""Largest distance [m] of a held cube's centre from the tool centre point."""


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
