"""A stand-in for knowing that it is enough: the policy stopped changing."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

STILL, ROUNDS = 0.005, 5
"""Share of states whose action may change in a round, and rounds in a row, to be called settled."""


@dataclass(frozen=True)
class Enough:
    """Whether a learner has learnt enough, and why.

    Attributes:
        enough: whether.
        reason: in plain words, whichever it is.
        stands_in: whether this is no measure of what was learnt, but that the policy stopped
            changing.
        figures: what it rests on, by name.
    """

    enough: bool
    reason: str
    stands_in: bool
    figures: dict[str, Any]


@dataclass
class Settled:
    """How much the policy changed from round to round.

    Attributes:
        changed: the share of states with another action than a round before, of each round.
    """

    changed: list[float] = field(default_factory=list)
    _last: np.ndarray | None = None

    def add(self, action: np.ndarray) -> None:
        """Take up the policy of one more round, int64 ``[n_states]``."""
        if self._last is not None:
            acting = action >= 0
            self.changed.append(float((action != self._last)[acting].mean()))
        self._last = action

    def enough(self) -> Enough:
        """Whether it stopped changing."""
        latest = self.changed[-ROUNDS:]
        still = len(latest) == ROUNDS and max(latest) <= STILL
        figures = {"changed": latest[-1] if latest else None}
        if still:
            reason = (
                f"in {ROUNDS} rounds no more than {max(latest):.1%} of my choices changed; whether "
                "they are right I cannot tell"
            )
        elif latest:
            reason = f"{latest[-1]:.1%} of my choices changed with the last answers"
        else:
            reason = "I was shown too little to compare"
        return Enough(still, reason, True, figures)
