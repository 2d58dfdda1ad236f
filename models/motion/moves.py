"""What a plan consists of: joint paths, and fingers on their way."""

from dataclasses import dataclass

import numpy as np

from models.scenes.gripper import MAX_OPENING


@dataclass(frozen=True)
class Move:
    """A joint path.

    Attributes:
        waypoints: ``[n, 7]`` [rad], n ≥ 2; the joints move in proportion between two of them.
        cuts: how far before and after each waypoint its corner may be rounded ``[n]`` [rad],
            as `PathPlanner.corner_cuts` proves; None rests at every corner.
    """

    waypoints: np.ndarray
    cuts: np.ndarray | None = None


@dataclass(frozen=True)
class Grip:
    """Fingers on their way to an opening.

    Attributes:
        width: commanded distance of the pads [m]; a cube between them stops them earlier.
        seconds: time to wait.
    """

    width: float
    seconds: float


CLOSE, OPEN = Grip(0.0, 1.3), Grip(MAX_OPENING, 1.6)
"""Until the force has built up; until the fingers are wide open, from however tight a grip."""
