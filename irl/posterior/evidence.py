"""What demonstrations say of hypotheses: labels, and the states where runs ended.

A label is a softmax of advantages with inverse temperature β, or with probability ε any of the
state's n actions:

    p = (1 − ε) exp(β A(s, a)) / Σ_b exp(β A(s, b)) + ε / n.

How careful a demonstrator is, is not known, so every β and ε of a grid is tried.
"""

from dataclasses import dataclass

import numpy as np

from irl.demonstrations import Demonstrations
from irl.groups import Groups
from irl.mdp import TransitionModel

BETAS = np.array([3.0, 10.0, 30.0, 100.0, 300.0, 1000.0])
"""Inverse temperatures, where a goal is worth 1."""
EPSILONS = np.array([0.003, 0.03, 0.1, 0.2, 0.35, 0.5])
"""Shares of labels that say nothing."""
_MISTAKEN = 0.01  # probability of going on at a goal, and of ending where there is none


@dataclass(frozen=True, eq=False)
class Evidence:
    """Demonstrations, prepared.

    Attributes:
        states: the distinct labelled states, int64 ``[m]``.
        pairs: all their feasible pairs, int64, state by state, as ``groups`` tells.
        groups: the pairs of each of ``states``.
        label: place in ``pairs`` of every distinct label ``[n]``, and ``count``, how often given.
        goes_on: bool ``[n]``, whether the labelled action may leave the state.
        ends: states where runs ended, int64 ``[k]``, as often as they did.
    """

    states: np.ndarray
    pairs: np.ndarray
    groups: Groups
    label: np.ndarray
    count: np.ndarray
    goes_on: np.ndarray
    ends: np.ndarray

    @classmethod
    def of(cls, model: TransitionModel, shown: Demonstrations) -> "Evidence":
        """Prepare."""
        # What was shown outranks whatever was generalised to its state (`irl.labels`).
        said = shown.counted
        labelled, states = model.pair_index(said.state, said.action), np.unique(said.state)
        groups = Groups.of_widths(model.widths[states])
        within = np.arange(groups.size) - np.repeat(groups.first, groups.widths)
        pairs = np.repeat(model.first_pair[states], groups.widths) + within
        # Picking no entries at all is not an array to SciPy.
        staying = [model.P[row, model.pair_state[row]] for row in labelled]
        return cls(
            states=states,
            pairs=pairs,
            groups=groups,
            label=np.searchsorted(pairs, labelled),
            count=said.count,
            goes_on=np.array(staying, dtype=np.float64) < 1,
            ends=shown.ends[:, 2],
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
        if not self.label.size:
            return total
        group = self.groups.segment[self.label]
        if self.ends.size:  # else runs may go on at a goal: nobody says that one ended
            left = goals[self.states[group]] & self.goes_on[:, None]
            total += (self.count[:, None] * left).sum(axis=0)[:, None, None] * np.log(_MISTAKEN)
        advantage = q - np.maximum.reduceat(q, self.groups.first)[self.groups.segment]
        even = 1 / self.groups.widths[group]
        for b, beta in enumerate(BETAS):
            likely = np.exp(beta * advantage)
            share = likely[self.label] / np.add.reduceat(likely, self.groups.first)[group]
            for e, epsilon in enumerate(EPSILONS):
                p = (1 - epsilon) * share + epsilon * even[:, None]
                total[:, b, e] += self.count @ np.log(p)
        return total
