"""What an unseen hand has in mind, and what it has done."""

from dataclasses import dataclass

from diagrams.scenarios.courses import Course, Moving
from diagrams.scenarios.draws import Kind, Lead


@dataclass(frozen=True)
class Done:
    """A lead that is over.

    Attributes:
        kind: what it was.
        began: when [s].
        ended: when [s].
        distance: how far the cube came along its course [m].
        turn: how far it was turned [rad].
        acted: whether it did what the scenario wants.
    """

    kind: Kind
    began: float
    ended: float
    distance: float
    turn: float
    acted: bool


@dataclass(frozen=True)
class Memory:
    """What an unseen hand has in mind.

    Attributes:
        leads: still to come, the first of them perhaps in hand.
        since: when the first one's occasion came [s], −1 before.
        course: of the first one once it has begun.
        began: when that was [s].
        pulled: where a yanked cube was when it was out of the hand; None before.
        place: where it is put down then, x and y [m].
        done: what is over.
    """

    leads: tuple[Lead, ...] = ()
    since: float = -1.0
    course: Course | None = None
    began: float = -1.0
    pulled: Moving | None = None
    place: tuple[float, float] = (0.0, 0.0)
    done: tuple[Done, ...] = ()

    def __deepcopy__(self, memo: dict) -> "Memory":
        """Itself: nothing in it changes, and Drake copies states at every update."""
        return self
