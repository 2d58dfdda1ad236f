"""The parts of a plan as phases, each with what is watched while it lasts."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from models.motion.moves import CLOSE, OPEN, Grip, Move


class Watch(StrEnum):
    """What a phase depends on, besides that the arm follows its command in time."""

    CUBE = "cube"
    """The cube stays where the hand is going to grasp it."""
    GRIP = "grip"
    """The hand holds the cube."""
    NOTHING = "nothing"
    """The cube is being gripped or has been let go."""


@dataclass(frozen=True)
class Phase:
    """A part of a plan.

    Attributes:
        part: what arm or fingers do.
        watch: what is watched meanwhile.
    """

    part: Move | Grip
    watch: Watch


def phases(plan: Sequence[Move | Grip]) -> tuple[Phase, ...]:
    """What is watched during each part of a plan.

    Until the fingers close, the cube; while they close or open, and after they have let go,
    nothing; at all other times the grip.
    """
    parts = list(plan)
    closes = parts.index(CLOSE) if CLOSE in parts else None
    opens = parts.index(OPEN) if closes is None and OPEN in parts else len(parts)

    def watch(number: int) -> Watch:
        if closes is not None and number <= closes:
            return Watch.CUBE if number < closes else Watch.NOTHING
        return Watch.GRIP if number < opens else Watch.NOTHING

    return tuple(Phase(part, watch(number)) for number, part in enumerate(parts))
