"""State preferences: states known beforehand to be worth more, or less, than learnt."""

from dataclasses import dataclass, field

import numpy as np

from irl.errors import InputError
from irl.integers import integers

SHARE = 0.2  # of |f|, gained or lost (thesis §4.2)


@dataclass(frozen=True)
class StatePreferences:
    """Disjoint sets of state indices, int64 arrays.

    Raises:
        InputError: if they are not state indices, or a state is in both.
    """

    preferred: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    avoided: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def __post_init__(self) -> None:
        """Sort and check the sets."""
        for name in ("preferred", "avoided"):
            states = integers(getattr(self, name), f"state preferences: {name}")
            object.__setattr__(self, name, np.unique(states))
        both = np.intersect1d(self.preferred, self.avoided)
        if both.size:
            raise InputError(
                f"state preferences: state {both[0]} is both preferred and avoided; "
                "name it in one set only"
            )

    def apply(self, f: np.ndarray) -> np.ndarray:
        """DiscountState of thesis Algorithm 4.1: a new f ``[n_states]``, ±20 % of |f|.

        Raises:
            InputError: if a state is out of range.
        """
        adjusted = np.array(f, dtype=np.float64)
        for states, sign in ((self.preferred, 1.0), (self.avoided, -1.0)):
            if states.size and (states[0] < 0 or states[-1] >= adjusted.size):
                raise InputError(
                    f"state preferences: states must lie in 0…{adjusted.size - 1}, "
                    f"got {states[0]}…{states[-1]}"
                )
            adjusted[states] += sign * SHARE * np.abs(adjusted[states])
        return adjusted
