"""How a cube that was let go falls, lands and comes to rest, and the hand withdraws.

The table has no edge here. How far a cube goes is what a class of pairs shares; whether that ends
beyond the edge of the real one differs from cell to cell, and is for `counts` to say.
"""

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity

from diagrams.falls.scene import AT_REST, Fall, FallScene, Hand, travel
from diagrams.gripper_controller import KNUCKLE_SPEED
from diagrams.trials.references import SPEED
from models.scenes import gripper

LOOK = 0.3
"""A cube at rest is looked at for so long [s]."""
_OPEN = float(gripper.knuckle_angle(gripper.MAX_OPENING))


@dataclass(frozen=True)
class Release:
    """A hand, and the cube between its fingers.

    Attributes:
        hand: where it is.
        opens: whether the fingers go on to open, at their speed; else they stay as they are.
        X_WO: pose of the cube.
        V_WO: its spatial velocity.
    """

    hand: Hand
    opens: bool
    X_WO: RigidTransform
    V_WO: SpatialVelocity


def come_to_rest(
    scene: FallScene,
    release: Release,
    rise: float,
    limit: float,
    *,
    friction: float,
    mass: float,
    restitution: float,
) -> Fall:
    """Simulate until the cube lies still, the hand has risen, and the cube lies still again.

    Args:
        scene: where.
        release: what hand and cube do to begin with.
        rise: by how much the hand rises once the cube lies still [m].
        limit: longest time to wait until it does, each time [s].
        friction: coefficient, of everything.
        mass: of the cube [kg].
        restitution: of cube and table, as `set_restitution` takes it.

    Returns:
        The fall, at its end.

    Raises:
        SimulatorFault: if Drake fails.
    """
    hand = release.hand
    fall = Fall(
        scene, release.X_WO, release.V_WO, friction=friction, mass=mass, restitution=restitution
    )
    if release.opens:
        wide = Hand(hand.X_WB, _OPEN)
        fall.advance((hand.knuckle - _OPEN) / KNUCKLE_SPEED, hand, wide)
        hand = wide
    _wait(fall, hand, limit)
    if rise:
        above = Hand(RigidTransform([0.0, 0.0, rise]) @ hand.X_WB, hand.knuckle)
        fall.advance(rise / SPEED, hand, above)
        _wait(fall, above, limit)
    return fall


def _wait(fall: Fall, hand: Hand, limit: float) -> None:
    """Simulate on until the cube lies still, or for as long as the limit [s]."""
    moved, waited = np.inf, 0.0
    while moved > AT_REST and waited < limit:
        before = fall.X_WO
        fall.advance(LOOK, hand, hand)
        moved, waited = travel(before, fall.X_WO), waited + LOOK
