"""The cube's pose in the hand, from measured poses of both: it stays from grasp to release.

Each measurement refines the mean of those before. What lies far from that is set aside; if the
next ones agree with it, the cube has slipped, and the mean begins anew from there.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from models.rotations import geodesic_angle, require_rotation
from models.task.spaces import Array

SLIP_DISTANCE, SLIP_ANGLE = 0.010, np.radians(10.0)
"""From the mean so far to a measurement that may be of a slip [m], [rad].

Twice what a noise of 5 mm and 5° does; a cube that is swung creeps by less than 3 mm and 5° in an
action.
"""
AGREE = 3
"""So many measurements in a row far from the mean are a slip, fewer are noise."""
MEMORY = 12
"""Older measurements than so many count less and less, because a held cube creeps."""


@dataclass(frozen=True, eq=False)
class InHand:
    """What is known of a held cube's pose in the hand G; nothing to begin with.

    Attributes:
        R_GO: the cube's orientation in the hand ``[3, 3]``.
        p_GO: its centre in the hand ``[3]`` [m].
        count: how many measurements speak for that, `MEMORY` at most; 0 while nothing is held.
        slips: how often the cube has slipped since it was grasped.
        spread: of these measurements about their mean: mean square distance [m²], angle [rad²].
    """

    R_GO: Array = field(default_factory=lambda: np.eye(3))
    p_GO: Array = field(default_factory=lambda: np.zeros(3))
    count: int = 0
    slips: int = 0
    spread: tuple[float, float] = (0.0, 0.0)
    _far: tuple[tuple[Array, Array], ...] = ()

    def __deepcopy__(self, memo: dict) -> "InHand":
        """Itself: nothing in it changes, and Drake copies states at every update."""
        return self

    def released(self) -> "InHand":
        """What is known once the hand is empty: nothing."""
        return NOTHING if self.count else self

    def measured(
        self, R_WG: ArrayLike, p_WG: ArrayLike, R_WO: ArrayLike, p_WO: ArrayLike
    ) -> "InHand":
        """What is known after one more measurement.

        Args:
            R_WG: the hand's orientation ``[3, 3]``.
            p_WG: its tool centre point ``[3]`` [m].
            R_WO: the held cube's orientation ``[3, 3]``.
            p_WO: its centre ``[3]`` [m].

        Raises:
            ModelError: if a matrix is not a rotation.
        """
        R_GW = require_rotation(R_WG, "R_WG").T
        R = R_GW @ require_rotation(R_WO, "R_WO")
        p = R_GW @ (np.asarray(p_WO, dtype=float) - np.asarray(p_WG, dtype=float))
        if not self.count:
            return InHand(R, p, 1)
        if not self._is_far(R, p):
            return self._refined(R, p)
        far = (*self._far, (R, p))
        if len(far) < AGREE:
            return replace(self, _far=far)
        slipped = InHand(*far[0], 1, self.slips + 1)
        for R, p in far[1:]:
            slipped = slipped._refined(R, p)
        return slipped

    @property
    def error(self) -> tuple[float, float]:
        """Standard error of the mean in any one direction [m], and about any one axis [rad].

        Infinite for a single measurement, of which none tells how far off it is.
        """
        if self.count < 2:
            return np.inf, np.inf
        distance, angle = (float(np.sqrt(s / 3.0 / (self.count - 1))) for s in self.spread)
        return distance, angle

    def _refined(self, R: Array, p: Array) -> "InHand":
        """With one more measurement that agrees with those before."""
        count = min(self.count + 1, MEMORY)
        off = float(np.linalg.norm(p - self.p_GO)), float(geodesic_angle(R, self.R_GO))
        # Welford's recursion for a mean and the mean square about it.
        distance, angle = (
            s + ((count - 1) / count * d**2 - s) / count
            for s, d in zip(self.spread, off, strict=True)
        )
        return InHand(
            nearest_rotation(self.R_GO + (R - self.R_GO) / count),
            self.p_GO + (p - self.p_GO) / count,
            count,
            self.slips,
            (distance, angle),
        )

    def _is_far(self, R: Array, p: Array) -> bool:
        distance = float(np.linalg.norm(p - self.p_GO))
        return distance > SLIP_DISTANCE or float(geodesic_angle(R, self.R_GO)) > SLIP_ANGLE


NOTHING = InHand()
"""Of an empty hand, or one that has just closed."""


def nearest_rotation(M: Array) -> Array:
    """The rotation nearest to a mean of such ``[3, 3]``."""
    U, _, Vt = np.linalg.svd(M)
    return U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
