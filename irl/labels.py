"""Labels with their counts: what a set of demonstrations says of each state, however it is ordered.

What was *shown* in a state outranks whatever was generalised to it: the demonstrator knows better
than a rule. Of the highest rank that a state has, every label counts, as often as it was given, so
that one slip weighs one tenth of ten answers and not all of them.
"""

from dataclasses import dataclass

import numpy as np

from irl.groups import Groups


@dataclass(frozen=True, eq=False)
class Labels:
    """Distinct pairs of a state and an action, of each state those of its highest rank alone.

    Ascending by state, then by action, whatever the order that labels came in.

    Attributes:
        state: int64 ``[n]``.
        action: int64 ``[n]``.
        count: int64 ``[n]``, at least 1: how often the pair was given.
        shown: bool ``[n]``, whether it was demonstrated; the same for all pairs of a state.
        first: int64 ``[n]``, the row of the demonstrations in which it was given first.
    """

    state: np.ndarray
    action: np.ndarray
    count: np.ndarray
    shown: np.ndarray
    first: np.ndarray

    @classmethod
    def of(cls, state: np.ndarray, action: np.ndarray, shown: np.ndarray) -> "Labels":
        """Count labels, each ``[n]``; ``shown``: whether they were demonstrated, bool."""
        ranked = np.flatnonzero(shown | ~np.isin(state, state[shown]))
        (states, actions), first, count = np.unique(
            np.stack([state[ranked], action[ranked]]),
            axis=1,
            return_index=True,
            return_counts=True,
        )
        first = ranked[first]
        return cls(states, actions, count, shown[first], first)

    def __len__(self) -> int:
        """Number of distinct pairs."""
        return self.state.size

    def most_frequent(self) -> "Labels":
        """One label a state: the most frequent, and of equally frequent ones the first given."""
        order = np.lexsort((self.first, -self.count, self.state))
        chosen = order[Groups.of_sorted(self.state[order]).first]
        return Labels(
            self.state[chosen],
            self.action[chosen],
            self.count[chosen],
            self.shown[chosen],
            self.first[chosen],
        )

    def policy(self, n_states: int) -> np.ndarray:
        """The action of ``most_frequent`` in every state, int64 ``[n_states]``; −1 for none."""
        one = self.most_frequent()
        policy = np.full(n_states, -1, dtype=np.int64)
        policy[one.state] = one.action
        return policy
