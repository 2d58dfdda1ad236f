"""What demonstrations say of hypotheses: labels, and the states where runs ended.

A label is a softmax of advantages with inverse temperature β, or with probability ε any of the
state's n actions:

    p = (1 − ε) exp(β A(s, a)) / Σ_b exp(β A(s, b)) + ε / n.

How careful a demonstrator is, is not known, so every β and ε of a grid is tried.

An answer to a proposal in an audit says more than a label, and is none where it lets pass: the
learner drew what was let pass, not the demonstrator. It is let pass if it is as good as the best,
else with exp(β A), or with probability ε either way. What is done instead of a refused one is a
label besides.

Among equally good actions a person may have a habit, such as turning the wrist least. A small cost
would explain it too, and move other choices besides. So habits are tried as well: none, and one for
each cost, by which all that falls to equally good actions falls to those that have least of it, and
among these, of all other costs together.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from irl.demonstrations import Demonstrations
from irl.groups import Groups
from irl.mdp import TransitionModel
from irl.posterior.verdicts import Verdicts

BETAS = np.array([3.0, 10.0, 30.0, 100.0, 300.0, 1000.0])
"""Inverse temperatures, where a goal is worth 1."""
EPSILONS = np.array([0.003, 0.03, 0.1, 0.2, 0.35, 0.5])
"""Shares of labels that say nothing."""
ALIKE = 0.005
"""Actions whose values differ by less are equally good; half an action's cost."""
HABIT = 0.5
"""Prior probability that there is a habit, shared evenly among all."""
_MISTAKEN = 0.01  # probability of going on at a goal, and of ending where there is none


@dataclass(frozen=True, eq=False)
class Evidence:
    """Demonstrations, prepared.

    Attributes:
        states: the distinct labelled states, int64 ``[m]``.
        pairs: all their feasible pairs, int64, state by state, as ``groups`` tells.
        groups: the pairs of each of ``states``.
        label: place in ``pairs`` of every distinct label ``[n]``, and ``count``, how often given.
        proposal: place in ``pairs`` of every proposal ``[m]``, and ``let_pass``, bool ``[m]``.
        went_on: states that what was shown or let pass may leave, int64 ``[k]``, as often as said.
        ends: states where runs ended, int64 ``[k]``, as often as they did.
        rank: by every habit, from the action that is preferred, int32 ``[habits, pairs]``.
    """

    states: np.ndarray
    pairs: np.ndarray
    groups: Groups
    label: np.ndarray
    count: np.ndarray
    proposal: np.ndarray
    let_pass: np.ndarray
    went_on: np.ndarray
    ends: np.ndarray
    rank: np.ndarray

    @classmethod
    def of(
        cls,
        model: TransitionModel,
        shown: Demonstrations,
        costs: np.ndarray | None = None,
        proposals: Mapping[int, int] | None = None,
    ) -> "Evidence":
        """Prepare.

        Args:
            model: the transition model.
            shown: all demonstrations.
            costs: what habits may be about, ``[n_pairs, n_costs]``; about nothing if None.
            proposals: of an audit, by the number of the run that an answer is, the action proposed.
        """
        labels, verdicts = Verdicts.apart(shown, proposals or {})
        # What was shown outranks whatever was generalised to its state (`irl.labels`).
        said = labels.counted
        labelled = model.pair_index(said.state, said.action)
        tried = model.pair_index(verdicts.state, verdicts.action)
        states = np.union1d(said.state, verdicts.state)
        groups = Groups.of_widths(model.widths[states])
        within = np.arange(groups.size) - np.repeat(groups.first, groups.widths)
        pairs = np.repeat(model.first_pair[states], groups.widths) + within
        going = np.concatenate([np.repeat(labelled, said.count), tried[verdicts.passed]])
        # Picking no entries at all is not an array to SciPy.
        staying = [model.P[row, model.pair_state[row]] for row in going]
        return cls(
            states=states,
            pairs=pairs,
            groups=groups,
            label=np.searchsorted(pairs, labelled),
            count=said.count,
            proposal=np.searchsorted(pairs, tried),
            let_pass=verdicts.passed,
            went_on=model.pair_state[going[np.array(staying, dtype=np.float64) < 1]],
            ends=shown.ends[:, 2],
            rank=_ranks(np.zeros((pairs.size, 0)) if costs is None else costs[pairs]),
        )

    def log_likelihood(self, q: np.ndarray, goals: np.ndarray) -> np.ndarray:
        """How likely all was, for every β and ε.

        Args:
            q: action values of ``pairs`` under every hypothesis, ``[pairs, n]``.
            goals: bool ``[n_states, n]``.

        Returns:
            float64 ``[n, betas, epsilons]``.
        """
        n = q.shape[1]
        total = np.zeros((n, BETAS.size, EPSILONS.size))
        right = np.log1p(-_MISTAKEN) * goals[self.ends].sum(axis=0)
        wrong = np.log(_MISTAKEN) * (~goals[self.ends]).sum(axis=0)
        total += (right + wrong)[:, None, None]
        if not self.pairs.size:
            return total
        if self.ends.size:  # else runs may go on at a goal: nobody says that one ended
            total += (np.log(_MISTAKEN) * goals[self.went_on].sum(axis=0))[:, None, None]
        group, first = self.groups.segment[self.label], self.groups.first
        advantage = q - np.maximum.reduceat(q, first)[self.groups.segment]
        alike = advantage >= -ALIKE
        preferred = [self._preferred(alike, rank) for rank in self.rank]
        even = (1 / self.groups.widths[group])[:, None]
        log_prior = _log_prior(len(preferred))
        for b, beta in enumerate(BETAS):
            likely = np.exp(beta * advantage)
            every = np.add.reduceat(likely, first)[group]
            share = likely[self.label] / every
            tied = np.add.reduceat(likely * alike, first)[group] / every
            shares = [share, *(np.where(alike[self.label], tied * p, share) for p in preferred)]
            passes = np.where(alike, 1.0, likely)[self.proposal]
            verdict = np.where(self.let_pass[:, None], passes, 1 - passes)
            for e, epsilon in enumerate(EPSILONS):
                said = [self.count @ np.log((1 - epsilon) * p + epsilon * even) for p in shares]
                total[:, b, e] += logsumexp(np.array(said) + log_prior[:, None], axis=0)
                total[:, b, e] += np.log((1 - epsilon) * verdict + epsilon / 2).sum(axis=0)
        return total

    def _preferred(self, alike: np.ndarray, rank: np.ndarray) -> np.ndarray:
        """What share of equally good actions' probability a habit gives to labels ``[labels, n]``.

        Args:
            alike: which actions are equally good ``[pairs, n]``.
            rank: by the habit ``[pairs]``.
        """
        ranked = np.where(alike, rank[:, None], np.iinfo(rank.dtype).max)
        least = np.minimum.reduceat(ranked, self.groups.first)[self.groups.segment]
        chosen = ranked == least
        number = np.add.reduceat(chosen, self.groups.first, dtype=np.int32)
        return chosen[self.label] / number[self.groups.segment[self.label]]


def _ranks(costs: np.ndarray) -> np.ndarray:
    """By each cost, and then by all others together, int32 ``[n_costs, pairs]``."""
    others = costs.sum(axis=1, keepdims=True) - costs
    ranks = [
        np.unique(np.round(np.column_stack(both), 9), axis=0, return_inverse=True)[1].reshape(-1)
        for both in zip(costs.T, others.T, strict=True)
    ]
    return np.array(ranks, dtype=np.int32).reshape(len(ranks), len(costs))


def _log_prior(habits: int) -> np.ndarray:
    """Logarithm of the prior probability of no habit, and of each ``[habits + 1]``."""
    return np.log([1 - HABIT] + habits * [HABIT / habits]) if habits else np.zeros(1)
