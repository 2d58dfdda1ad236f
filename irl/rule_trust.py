"""How far a generalisation rule can be trusted, told from demonstrations alone (§5.10.1).

Where a label follows from one run for a state that another run passes through, the two can be
compared. A rule that is right agrees as often as two runs do that pass through the same state, the
demonstrator having several actions that are equally good; one that is wrong never does. What ended
a run is judged apart: a drop where the work is done says little about drops elsewhere.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irl.demonstrations import Demonstrations
from irl.generalisation import Generalisation
from irl.pairs import pair_key, split_key

ON_THE_WAY, AT_THE_END = KINDS = ("on the way", "at the end")
"""Kinds of sources: whether a pair was the last of its run."""
_ANY_ACTION = 1 << 32  # more than int32 can name: rules don't know how many a task has
_GRID = (np.arange(100) + 0.5) / 100


@dataclass(frozen=True)
class Trust:
    """What is known of a rule, applied to sources of a kind.

    Attributes:
        share: the share of its labels that are right, by expectation.
        states: the number of states where they could be compared with what was shown.
        agreed: how many of them agreed; fractions where several labels meet.
    """

    share: float
    states: int
    agreed: float


def rule_trust(
    demonstrations: Demonstrations, generalisation: Generalisation, rules: Sequence[str]
) -> dict[str, dict[str, Trust]]:
    """Trust in each of ``rules``, by kind of source.

    Beforehand a rule is as likely to be always right as to be right in any share of cases; so
    without evidence it is trusted by three quarters.

    Args:
        demonstrations: runs; generalised labels among them don't count.
        generalisation: the rules.
        rules: names.

    Raises:
        InputError: if a rule is unknown.
    """
    shown = demonstrations.select(~demonstrations.generalised)
    last, visits = shown.last_of_runs, _Visits(shown)
    trust: dict[str, dict[str, Trust]] = {}
    for rule in rules:
        (k,) = generalisation.rule_indices([rule])
        met = {}
        for kind in KINDS:
            sources = shown.select(last == (kind == AT_THE_END))
            met[kind] = visits.agreement(generalisation, k, sources)
        # Actions that tie are those of the states that the rule speaks of.
        alike, pairs = visits.self_agreement(np.union1d(*(states for states, _ in met.values())))
        trust[rule] = {
            kind: Trust(
                _expected_share(agreed.sum(), states.size, (alike * pairs).sum(), pairs.sum()),
                states.size,
                float(agreed.sum()),
            )
            for kind, (states, agreed) in met.items()
        }
    return trust


class _Visits:
    """How often what was shown in each state."""

    def __init__(self, shown: Demonstrations) -> None:
        self._key = pair_key(shown.state, shown.action, _ANY_ACTION)
        self._state = shown.state

    def agreement(
        self, g: Generalisation, rule: int, sources: Demonstrations
    ) -> tuple[np.ndarray, np.ndarray]:
        """States with derived and with shown labels, and the share of pairs that agree in each."""
        rows = np.flatnonzero(g.rule == rule)
        given = _count(pair_key(g.state[rows], g.action[rows], _ANY_ACTION),
                       pair_key(sources.state, sources.action, _ANY_ACTION))  # fmt: skip
        by_group = np.bincount(g.group[rows], given)
        rows, given = rows[by_group[g.group[rows]] > 0], given[by_group[g.group[rows]] > 0]
        # Nothing follows from a state for itself.
        own = pair_key(g.group[rows], g.state[rows], _ANY_ACTION)
        names, place = np.unique(own, return_inverse=True)
        derived = by_group[g.group[rows]] - np.bincount(place, given, names.size)[place]
        state = g.state[rows].astype(np.int64)
        there = _count(state, self._state)
        same = _count(pair_key(state, g.action[rows], _ANY_ACTION), self._key)
        states, place = np.unique(state, return_inverse=True)
        meetings = np.bincount(place, derived * there, states.size)
        agreed = np.bincount(place, derived * same, states.size)
        met = meetings > 0
        return states[met], agreed[met] / meetings[met]

    def self_agreement(self, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The share of pairs of visits that agree, of ``states`` visited more than once.

        Returns:
            The shares, and of how many pairs without a visit in common.
        """
        keys, count = np.unique(self._key, return_counts=True)
        state, _ = split_key(keys, _ANY_ACTION)
        n = _count(states, self._state)
        states, n = states[n > 1], n[n > 1]
        here = np.isin(state, states)
        pairs = (count * (count - 1))[here]
        alike = np.bincount(np.searchsorted(states, state[here]), pairs, states.size)
        return alike / (n * (n - 1)), n // 2


def _count(values: np.ndarray, among: np.ndarray) -> np.ndarray:
    """How often each of ``values`` is found among others."""
    ordered = np.sort(among)
    right = np.searchsorted(ordered, values, side="right")
    return right - np.searchsorted(ordered, values)


def _expected_share(agreed: float, n: float, alike: float, revisited: float) -> float:
    """E[p], where derived labels agree with probability p·c, and shown ones with c.

    A grid over both; c is uniform beforehand, and p half a spike at 1, half uniform.
    """
    c = _GRID[:, None]

    def likelihood(p: np.ndarray) -> np.ndarray:
        right = agreed * np.log(p * c) + (n - agreed) * np.log1p(-p * c)
        return right + alike * np.log(c) + (revisited - alike) * np.log1p(-c)

    spike, slab = likelihood(np.ones((1, 1))), likelihood(_GRID[None, :])
    peak = max(spike.max(), slab.max())
    always = np.exp(spike - peak).mean()
    some = np.exp(slab - peak).mean(axis=0)
    return float((always + (some * _GRID).mean()) / (always + some.mean()))
