"""Maximum causal entropy behaviour with a number of moves to go, Ziebart (2010), chapter 9.

With k moves to go the softest behaviour takes a with probability exp(Q_k(s, a) − V_k(s)), where
Q_k = P (R + V_{k−1}) as in (3.2) without discount and V_k is the log-sum-exp of Q_k instead of
its maximum. The reward R is earned on entering a state.

The recursion runs hundreds of times an iteration of learning, so a model is regrouped once: states
by their number of actions, most first, and after the first action of every state the second of
every state that has one, and so on (jagged diagonals). Sums over a state's own actions are then
additions of contiguous blocks, without padding, however many actions a state has.
"""

import numpy as np
import torch

from irl.mdp import TransitionModel


class SoftWalks:
    """One model, prepared for many rewards.

    Attributes:
        model: the transition model.
        pairs: int64 ``[n_pairs]``: which row of ``model.P`` each column of a policy belongs to.
    """

    def __init__(self, model: TransitionModel) -> None:
        """Regroup ``model``."""
        width = model.widths
        self.model = model
        self._states = np.argsort(-width, kind="stable")
        # Per place k: how many states have more than k actions; they are the first so many.
        self._counts = [int((width > k).sum()) for k in range(width.max(initial=0))]
        ends = np.cumsum(self._counts, dtype=np.int64)
        self._blocks = [
            (slice(end - count, end), slice(count))
            for end, count in zip(ends, self._counts, strict=True)
        ]
        begin = model.first_pair[self._states]
        self.pairs = np.concatenate(
            [begin[:0], *(begin[:count] + k for k, count in enumerate(self._counts))]
        )
        self._P = model.P[self.pairs][:, self._states]
        self._onward = self._P.T

    def backward(self, state_reward: np.ndarray, horizon: int) -> tuple[np.ndarray, np.ndarray]:
        """Soft choices and values with 0…horizon moves to go, from the end.

        Args:
            state_reward: R, ``[n_states]``, earned on entering a state.
            horizon: largest number of moves.

        Returns:
            Probabilities ``[horizon, n_pairs]``, row k − 1 for k moves to go, columns as in
            ``pairs``; and V ``[horizon + 1, n_states]``, 0 with no move to go and in states
            without actions.
        """
        n, acting = self.model.n_states, sum(self._counts[:1])
        reward = np.asarray(state_reward, dtype=np.float64)[self._states]
        policy = np.empty((horizon, self.model.n_pairs))
        V = np.zeros((horizon + 1, n))
        peak, total, entered = np.empty(acting), np.empty(acting), np.empty(n)
        # Torch's exponential and logarithm are vectorised where NumPy's may not be; it sees the
        # same memory.
        policy_, V_, total_ = map(torch.from_numpy, (policy, V, total))
        for k in range(horizon):
            q = self._P @ np.add(reward, V[k], out=entered)
            p = policy[k]
            peak[:] = q[:acting]
            for block, first in self._blocks[1:]:
                np.maximum(peak[first], q[block], out=peak[first])
            for block, first in self._blocks:
                np.subtract(q[block], peak[first], out=p[block])
            torch.exp(policy_[k], out=policy_[k])
            total[:] = p[:acting]
            for block, first in self._blocks[1:]:
                total[first] += p[block]
            torch.log(total_, out=V_[k + 1, :acting])
            V[k + 1, :acting] += peak
            np.reciprocal(total, out=total)
            for block, first in self._blocks:
                p[block] *= total[first]
        in_order = np.empty_like(V)
        in_order[:, self._states] = V
        return policy, in_order

    def entries(self, policy: np.ndarray, starts: np.ndarray) -> np.ndarray:
        """How often each state is entered in expectation, forwards from the starts.

        Args:
            policy: as ``backward`` returns it, ``[horizon, n_pairs]``.
            starts: ``[horizon + 1, n_states]``, what begins in s with k moves to go.

        Returns:
            float64 ``[n_states]``; the start itself is not an entry.
        """
        begins = np.asarray(starts.any(axis=1))
        flow = np.empty(self.model.n_pairs)
        entered, total = np.zeros(self.model.n_states), np.zeros(self.model.n_states)
        for k in range(len(policy), 0, -1):
            present = entered + starts[k, self._states] if begins[k] else entered
            for block, first in self._blocks:
                np.multiply(policy[k - 1, block], present[first], out=flow[block])
            entered = self._onward @ flow
            total += entered
        in_order = np.empty_like(total)
        in_order[self._states] = total
        return in_order
