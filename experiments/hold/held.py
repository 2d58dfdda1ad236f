"""What became of a cube that was held through a swing."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from models.arrays import Array
from models.task.spaces import CUBE_EDGE

SETTLE, AFTER = 0.15, 0.1
"""How long the hand is at rest before a swing, and after it [s]."""
LOOK = 2e-3
"""Between two looks at the cube [s]."""
SLIP = 1e-3
"""Beyond which a cube slips [m]."""
GONE = CUBE_EDGE / 2
"""From where the cube was put; beyond it is lost [m]."""
HOLDS, SLIPS, LOST = "holds", "slips", "lost"
VERDICTS = (HOLDS, SLIPS, LOST)
_MOVES = 1e-3  # knuckle speed below which it rests: the pad moves by 0.05 mm/s [rad/s]


@dataclass(frozen=True)
class Held:
    """How a cube was held.

    Attributes:
        verdict: of `VERDICTS`.
        slip: largest distance of the cube's centre in the hand from where it was before the swing
            [m]; of a lost cube up to where it was given up.
        turn: largest angle in the hand from how it was before the swing [rad].
        chatter: sign changes of the knuckle's speed from one look to the next.
        force: on each pad along their normal: least, mean and largest [N].
    """

    verdict: str
    slip: float
    turn: float
    chatter: int
    force: tuple[float, float, float]


def is_gone(X_GO: RigidTransform) -> bool:
    """Whether a cube is too far from where it was put to come back."""
    return bool(np.linalg.norm(X_GO.translation()) > GONE)


def judge(X_GO: Sequence[RigidTransform], knuckle_speed: Array, force: Array) -> Held:
    """Judge by looks since the swing began, up to its end or up to where the cube was gone.

    Args:
        X_GO: pose of the cube in the hand ``[n]``, n ≥ 1; it was put at the identity.
        knuckle_speed: ``[n]`` [rad/s].
        force: on each pad along their normal, mean of the two ``[n]`` [N].
    """
    rest = RigidTransform() if is_gone(X_GO[0]) else X_GO[0]
    since = [rest.inverse() @ X for X in X_GO]
    slip = max(float(np.linalg.norm(X.translation())) for X in since)
    turn = max(float(X.rotation().ToAngleAxis().angle()) for X in since)
    moving = np.sign(knuckle_speed[np.abs(knuckle_speed) > _MOVES])
    lost = is_gone(X_GO[-1]) or force[-1] == 0.0
    return Held(
        LOST if lost else SLIPS if slip > SLIP else HOLDS,
        slip,
        turn,
        int(np.count_nonzero(np.diff(moving))),
        (float(force.min()), float(force.mean()), float(force.max())),
    )
