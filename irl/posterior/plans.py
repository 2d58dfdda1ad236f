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
import torch
from scipy import sparse

from irl.groups import alike
from irl.mdp import TransitionModel

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
    def _shared(self) -> tuple[np.ndarray, np.ndarray, torch.Tensor, torch.Tensor]:
        """One pair of each distribution and of each cost; of every pair in turn, which of those.

        The last two are ``[most actions, acting states]``: a state with fewer actions repeats its
        last, which changes no maximum.
        """
        model = self.model
        widths = model.widths[model.acting]
        turn = np.minimum(np.arange(widths.max(initial=1))[:, None], widths - 1)
        pair = turn + model.first_pair[model.acting]
        led = _in_turn(*model.outcomes, pair)
        mark = np.random.default_rng(1).random((2, self.costs.shape[1]))
        paid = _in_turn(*alike(self.costs @ mark[0] + 1j * (self.costs @ mark[1])), pair)
        return led[0], paid[0], torch.from_numpy(led[1]), torch.from_numpy(paid[1])

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
        ahead, dear = torch.from_numpy(self._P_shared @ f), torch.from_numpy(cost)
        best = ahead.index_select(0, led[0]).sub_(dear.index_select(0, paid[0]))
        gained, spent = torch.empty_like(best), torch.empty_like(best)
        for k in range(1, len(led)):
            torch.index_select(ahead, 0, led[k], out=gained)
            torch.index_select(dear, 0, paid[k], out=spent)
            torch.maximum(best, gained.sub_(spent), out=best)
        after = np.zeros_like(f)
        after[self.model.acting] = self.gamma * best.numpy()
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


def _in_turn(
    first: np.ndarray, kind: np.ndarray, asked: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """`alike`, of ``asked`` alone, with kinds numbered as they are asked for.

    Rows that are picked in turn then lie side by side.
    """
    _, met = np.unique(kind[asked], return_index=True)
    order = np.argsort(met)
    return first[order], np.argsort(order)[kind[asked]]
