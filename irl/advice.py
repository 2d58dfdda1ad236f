"""Advice about actions: what an expert prefers or wants avoided in a cluster of states.

Advice never enters training. It adjusts the action values afterwards, as UpdateQ does in
thesis Algorithm 4.1, so that it can be given, changed and withdrawn without learning anew.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from irl.choices import check_choice
from irl.errors import InputError
from irl.integers import integers

BONUS = 0.2  # share of |Q| that a preferred action gains (thesis §4.2)
AVOIDED_VALUE = -2.0  # what UpdateQ writes; below any Σ P f, as f > −1
AVOID_MODES = ("mask", "doubt", "thesis")
PREFER_MODES = ("ignore", "thesis")


@dataclass(frozen=True)
class Advice:
    """Two disjoint tables, bool ``[n_states, n_actions]``."""

    preferred: np.ndarray
    avoided: np.ndarray

    @classmethod
    def none(cls, n_states: int, n_actions: int) -> "Advice":
        """No advice about anything."""
        shape = (n_states, n_actions)
        return cls(np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool))

    def add(
        self, states: Iterable[int], preferred: Iterable[int], avoided: Iterable[int]
    ) -> "Advice":
        """Take in one answer about a cluster; where it contradicts earlier ones, it wins.

        An expert who speaks twice of the same state has usually been asked about a smaller or
        a different cluster since, and knows the earlier answer.

        Args:
            states: the cluster.
            preferred: actions to prefer in all of its states.
            avoided: actions to avoid there.

        Returns:
            The advice with the answer in it; this one is unchanged.

        Raises:
            InputError: if an action is in both sets, or an index is out of range.
        """
        n_states, n_actions = self.preferred.shape
        cluster = _indices("states", states, n_states)
        good = _indices("preferred actions", preferred, n_actions)
        bad = _indices("avoided actions", avoided, n_actions)
        both = np.intersect1d(good, bad)
        if both.size:
            raise InputError(
                f"advice: action {both[0]} is both preferred and avoided; name it in one set only"
            )
        prefer, avoid = self.preferred.copy(), self.avoided.copy()
        for actions, table, other in ((good, prefer, avoid), (bad, avoid, prefer)):
            table[np.ix_(cluster, actions)] = True
            other[np.ix_(cluster, actions)] = False
        return Advice(prefer, avoid)

    def but_for(self, states: np.ndarray) -> "Advice":
        """The same, but that nothing is avoided in the marked states, bool ``[n_states]``."""
        return Advice(self.preferred, self.avoided & ~states[:, np.newaxis])

    def apply(
        self, q: np.ndarray, mask: np.ndarray, avoid: str = "mask", prefer: str = "thesis"
    ) -> np.ndarray:
        """UpdateQ of thesis Algorithm 4.1: a new Q ``[n_states, n_actions]``.

        With ``prefer="thesis"`` a preferred action gains 20 % of |Q|, and where that leaves it
        level with the best of the others, it comes first. An avoided one is excluded (−∞) with
        ``avoid="mask"``, and with ``"doubt"`` (`irl.policy_update` says what is doubted); with
        ``avoid="thesis"`` it gets the constant −2, or less where others are worth no more.
        Excluding *every* feasible action would leave a state without policy, though the advice was
        given for its cluster and not for it; there, nothing is excluded.

        Args:
            q: action values, anything where infeasible.
            mask: bool of the same shape, the feasible pairs; −∞ is returned elsewhere.
            avoid: a name in ``AVOID_MODES``.
            prefer: ``"ignore"`` or ``"thesis"``.

        Raises:
            InputError: if ``avoid`` or ``prefer`` is none of their names.
        """
        check_choice("avoid", avoid, AVOID_MODES)
        check_choice("prefer", prefer, PREFER_MODES)
        advised = np.where(mask, q, -np.inf)
        better = self.preferred & np.isfinite(advised) & (prefer == "thesis")
        advised[better] += BONUS * np.abs(advised[better])
        left = mask & ~self.avoided
        if avoid == "thesis":
            least = np.where(left & np.isfinite(advised), advised, np.inf).min(
                axis=1, initial=np.inf
            )
            value = np.where(least > AVOIDED_VALUE, AVOIDED_VALUE, np.nextafter(least, -np.inf))
            advised = np.where(self.avoided & mask, value[:, None], advised)
        else:
            advised[self.avoided & left.any(axis=1, keepdims=True)] = -np.inf
        # |Q| may be 0, and so may be the gain.
        most = advised.max(axis=1, keepdims=True, initial=-np.inf)
        first = better & (advised == most)
        level = ((advised == most) & ~first).any(axis=1, keepdims=True)
        return np.where(first & level, np.nextafter(advised, np.inf), advised)


def _indices(name: str, values: Iterable[int], limit: int) -> np.ndarray:
    listed = values if isinstance(values, np.ndarray) else list(values)
    return np.unique(integers(listed, f"advice: {name}", below=limit))
