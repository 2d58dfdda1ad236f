"""Hard plans for many hypotheses at once: value iteration on a table of columns, one each.

A hypothesis is a set of goals, where a run ends with a VR value of 1, and a size for each cost.
With f = 1 at its goals, the given value at states of known value, and f = γ V elsewhere,

    V(s) = max_a [Σ_s' P_sa(s') f(s') − Σ_k w_k c_k(s, a)].

Two things make a sweep cheap. Pairs that lead to the same distribution share one product P f, and
pairs that cost alike one sum: there are many fewer of either than pairs. And columns are neighbours
in memory, so that picking a row serves all hypotheses.
"""

from collections.abc import Mapping
from functools import cached_property

import numpy as np
from scipy import sparse

from irl.groups import alike
from irl.mdp import TransitionModel
from irl.posterior.best_actions import best_actions

_SETTLED = 1e-4  # change of a sweep, where a goal is worth 1: far below any cost that matters
_MOST_SWEEPS = 400
_BLOCK = 64  # columns that stay in the processor's cache together


class HardPlans:
    """Plans on one transition model.

    Attributes:
        model: the transition model.
        gamma: discount factor.
        costs: cost of every pair by every name, float32 ``[n_pairs, n_costs]``, from 0.
        fixed: bool ``[n_states]``, where the value is known, and ``value`` that value.
    """

    def __init__(
        self,
        model: TransitionModel,
        gamma: float,
        costs: np.ndarray,
        fixed_vr: Mapping[int, float],
    ) -> None:
        """Prepare what all hypotheses share."""
        self.model, self.gamma = model, gamma
        self.costs = np.ascontiguousarray(costs, dtype=np.float32)
        self.P = model.P.astype(np.float32)
        self.fixed = np.zeros(model.n_states, dtype=bool)
        self.fixed[list(fixed_vr)] = True
        self.value = np.zeros(model.n_states, dtype=np.float32)
        self.value[list(fixed_vr)] = list(fixed_vr.values())

    @cached_property
    def _shared(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """One pair of each distribution and of each cost; of every pair, which of those, int32."""
        mark = np.random.default_rng(1).random((2, self.costs.shape[1]))
        leads, led = _as_met(*self.model.outcomes)
        pays, paid = _as_met(*alike(self.costs @ mark[0] + 1j * (self.costs @ mark[1])))
        return leads, pays, led, paid

    @cached_property
    def _first(self) -> np.ndarray:
        groups = self.model.groups
        return np.append(groups.first, groups.size)

    @cached_property
    def _P_shared(self) -> sparse.csr_matrix:
        return self.P[self._shared[0]]

    def vr_values(self, goals: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """The f of every hypothesis.

        Args:
            goals: bool ``[n_states, n]``.
            sizes: of the costs, ``[n_costs, n]``.

        Returns:
            float32 ``[n_states, n]``.
        """
        blocks = range(0, goals.shape[1], _BLOCK)
        found = [self._solve(goals[:, k : k + _BLOCK], sizes[:, k : k + _BLOCK]) for k in blocks]
        return np.concatenate([np.zeros((self.model.n_states, 0), np.float32), *found], axis=1)

    def _solve(self, goals: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        _, pays, _, _ = self._shared
        cost = self.costs[pays] @ sizes.astype(np.float32)
        held = np.ascontiguousarray(goals | self.fixed[:, None])
        value = np.where(goals, np.float32(1), self.value[:, None])
        f = np.where(held, value, np.float32(0))
        settled, left = f.copy(), np.arange(goals.shape[1])  # columns that still change
        for _ in range(_MOST_SWEEPS):
            before, f = f, self._sweep(f, cost)
            np.copyto(f, value, where=held)
            moving = np.abs(f - before).max(axis=0, initial=0.0) > _SETTLED
            if not moving.any():
                break
            # Fewer columns take less time, but to leave one out at a time would take more.
            if moving.sum() <= 0.75 * left.size:
                settled[:, left] = f
                left = left[moving]
                f, cost, held, value = (
                    np.compress(moving, each, axis=1) for each in (f, cost, held, value)
                )
        settled[:, left] = f
        return settled

    def _sweep(self, f: np.ndarray, cost: np.ndarray) -> np.ndarray:
        """γ max_a [P f − cost], 0 where nothing can be done; ``cost`` is of each distinct one."""
        _, _, led, paid = self._shared
        ahead = np.ascontiguousarray(self._P_shared @ f)
        best = best_actions(ahead, np.ascontiguousarray(cost), led, paid, self._first)
        after = np.zeros_like(f)
        after[self.model.acting] = self.gamma * best
        return after

    def q(self, f: np.ndarray, sizes: np.ndarray, pairs: np.ndarray | None = None) -> np.ndarray:
        """Action values of pairs, ``[n_pairs, n]``; those of a goal's own, as if a run went on.

        Args:
            f: ``[n_states, n]``.
            sizes: ``[n_costs, n]``.
            pairs: which pairs, int64; all if None.
        """
        P, costs = (self.P, self.costs) if pairs is None else (self.P[pairs], self.costs[pairs])
        return P @ f - costs @ sizes.astype(np.float32)


def _as_met(first: np.ndarray, kind: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`alike`, with kinds numbered as pairs meet them: rows picked in turn lie side by side."""
    _, met = np.unique(kind, return_index=True)
    order = np.argsort(met)
    return first[order], np.argsort(order)[kind].astype(np.int32)
