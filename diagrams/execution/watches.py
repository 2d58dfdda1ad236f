"""What is measured while an action is under way, and when that says that it went wrong.

Measurements are noisy: none ends an action by itself. The cube counts as moved when the mean of the
last looks has; a grip or an arm that is not as it should be must be so at some looks in a row.
"""

from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform

from diagrams.execution.phases import Watch
from diagrams.state_identifier import LEAST_FORCE, OPENINGS
from models.motion.failures import ActionFailure
from models.rotations import geodesic_angle
from models.task.tracking import nearest_rotation

LOOK = 0.1
"""Between two looks [s]."""
RECENT = 5
"""So many looks at the cube make a mean."""
MOVED, TURNED = 0.012, np.radians(12.0)
"""From where the cube was planned to the mean of recent looks, if it has moved [m], [rad].

A noise of 5 mm and 5° leaves such a mean within 3 mm and 3° of the truth, two times in three.
"""
PATIENCE = {ActionFailure.GRIP_LOST: 2, ActionFailure.OBSTRUCTED: 4}
"""Looks in a row that must find the same fault with the grip, or with the arm."""
BEHIND = 0.0235
"""From where a plan has the arm to where it is, if it does not follow [rad].

The plan nearly stands by then (`diagrams.execution.clock`). One that takes 50 ms to arrive
leaves a joint behind by 0.021 rad at its limit of speed.
"""


@dataclass(frozen=True, eq=False)
class Measured:
    """What is seen at one look; None where nothing measures it.

    Attributes:
        behind: from where the plan has the joints to where they are, the largest [rad].
        opening: between the pads [m].
        force: of each pad [N].
        X_WO: the cube's pose.
    """

    behind: float | None = None
    opening: float | None = None
    force: float | None = None
    X_WO: RigidTransform | None = None


@dataclass(frozen=True, eq=False)
class Vigil:
    """What was seen so far of an action.

    Attributes:
        planned: the cube's pose that the action was planned with.
        fault: what the last look found fault with; None if with nothing.
        doubts: how many looks in a row have found that.
        recent: the cube's last poses, the latest last.
        failure: what went wrong; None so far.
    """

    planned: RigidTransform
    fault: ActionFailure | None = None
    doubts: int = 0
    recent: tuple[RigidTransform, ...] = ()
    failure: ActionFailure | None = None

    def looked(self, watch: Watch, seen: Measured) -> "Vigil":
        """What is known after one more look; itself if there is nothing new."""
        fault = _fault(watch, seen)
        after = self
        if fault is not None:
            doubts = self.doubts + 1 if fault == self.fault else 1
            failure = fault if doubts >= PATIENCE[fault] else None
            after = replace(self, fault=fault, doubts=doubts, failure=failure)
        elif self.fault is not None:
            after = replace(self, fault=None, doubts=0)
        if watch != Watch.CUBE or seen.X_WO is None or after.failure:
            return after
        after = replace(after, recent=(*after.recent, seen.X_WO)[-RECENT:])
        if len(after.recent) == RECENT and after._cube_moved():
            return replace(after, failure=ActionFailure.DISPLACED)
        return after

    def _cube_moved(self) -> bool:
        place = np.mean([X.translation() for X in self.recent], axis=0)
        turn = nearest_rotation(np.mean([X.rotation().matrix() for X in self.recent], axis=0))
        return bool(
            np.linalg.norm(place - self.planned.translation()) > MOVED
            or geodesic_angle(turn, self.planned.rotation().matrix()) > TURNED
        )


def _fault(watch: Watch, seen: Measured) -> ActionFailure | None:
    """What a look finds fault with by itself."""
    if seen.behind is not None and seen.behind > BEHIND:
        return ActionFailure.OBSTRUCTED
    if watch == Watch.GRIP and seen.force is not None and seen.opening is not None:
        holds = seen.force >= LEAST_FORCE and OPENINGS[0] <= seen.opening <= OPENINGS[1]
        return None if holds else ActionFailure.GRIP_LOST
    return None
