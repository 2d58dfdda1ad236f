"""What a page needs of a view of the station, whatever draws it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from pydrake.math import RigidTransform

SPEED = 2.0
"""How much faster than the robot a preview is."""
FRAME = 1.0 / 30.0
"""Between two pictures of a preview [s]."""
SURE = 0.98
"""From this probability of its likeliest outcome an action is not called a toss-up."""
LEAST = 0.02
"""Outcomes below this probability have no ghost and no words."""


@dataclass(frozen=True, eq=False)
class Posture:
    """Where everything is.

    Attributes:
        q: joint angles ``[7]`` [rad].
        width: distance of the pads [m].
        X_WO: the cube's pose; None if it is out of sight.
    """

    q: np.ndarray
    width: float
    X_WO: RigidTransform | None


@dataclass(frozen=True, eq=False)
class Preview:
    """How an action would be carried out, and what may come of it.

    Attributes:
        state: index of the state it begins in.
        action: index of the action.
        outcomes: what may follow, the likeliest first, each with its probability.
        postures: one a picture, `FRAME` seconds apart.
    """

    state: int
    action: int
    outcomes: tuple[tuple[int, float], ...]
    postures: tuple[Posture, ...]

    @property
    def duration(self) -> float:
        """How long it is [s]."""
        return FRAME * (len(self.postures) - 1)

    @property
    def odds(self) -> str:
        """The probabilities of a toss-up, such as ``59 % / 41 %``; empty if it is none."""
        if not self.outcomes or self.outcomes[0][1] >= SURE:
            return ""
        return " / ".join(f"{100 * p:.0f} %" for _, p in self.outcomes if p >= LEAST)

    def at(self, seconds: float) -> Posture:
        """Where everything is, some seconds after the start; at the end for ever after."""
        last = len(self.postures) - 1
        return self.postures[min(max(0, int(seconds / FRAME)), last)]


class Viewer(Protocol):
    """What a page needs of a view: another one, such as a camera's, may take its place."""

    def show(self, state: int) -> None:
        """Show a state."""

    def preview(self, state: int, action: int) -> Preview:
        """Plan an action's motion; shows nothing yet."""

    def pose(self, posture: Posture) -> None:
        """Show one picture of a motion."""

    def ghosts(self, states: Sequence[int]) -> None:
        """Show where the cube may come to be, the likeliest first, until `show`."""
