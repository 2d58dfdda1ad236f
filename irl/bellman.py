"""A preference for VR functions whose reward is simple: the same nearly everywhere.

Any f is Bellman-consistent with *some* reward, R(s) = f(s) − γ max_a Σ P f, thesis (3.18)
with the γ it omits, and the likelihood alone does not care which. Where no demonstration
went, f is then whatever the network extrapolates. Tasks tend to cost the same at each step
and differ only at a goal or hazard, so the deviation of R(s) from one learnt constant is
penalised: quadratically near zero, linearly beyond, so that few exceptions stay affordable.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irl.checkpoint import fingerprint
from irl.choices import check_range
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.neighbourhood import Neighbourhood


@dataclass(frozen=True)
class BellmanBatch:
    """The penalty on one batch of states.

    Attributes:
        seen: pairs and successors of the batch, the batch's states visible too.
        gamma: discount factor.
        delta: deviation, in units of f, where the penalty turns from quadratic to linear.
    """

    seen: Neighbourhood
    gamma: float
    delta: float

    @property
    def states(self) -> np.ndarray:
        """int64 ``[u]``: the states whose f is needed, in the order it is wanted."""
        return self.seen.visible

    def rewards(self, f: np.ndarray) -> np.ndarray:
        """R(s), thesis (3.18) with γ, of the batch's states ``[m]``, from f ``[u]``."""
        seen = self.seen
        f = seen.pin(f)
        best = seen.groups.maximum(seen.P @ f)
        return f[seen.position(seen.states)] - self.gamma * best

    def value_and_gradient(
        self, f: np.ndarray, constant: float | np.ndarray
    ) -> tuple[float, np.ndarray, float]:
        """Mean Huber(R(s) − constant) / δ, R from (3.18), its gradients in f and constant.

        Divided by δ the penalty is |deviation| − δ/2 beyond δ. Where actions tie for the
        maximum, the first carries the gradient.

        Args:
            f: VR values of ``states``, ``[u]``; pinned entries are ignored.
            constant: the common reward, in units of f.

        Returns:
            The mean, float64 ``[u]`` (0 at pinned entries), and the derivative in the constant.
        """
        seen = self.seen
        f = seen.pin(f)
        q = seen.P @ f
        best = seen.groups.maximum(q)
        own = seen.position(seen.states)
        deviation = f[own] - self.gamma * best - constant
        size = np.abs(deviation)
        value = np.where(
            size <= self.delta, size**2 / (2 * self.delta), size - self.delta / 2
        ).mean()
        slope = np.clip(deviation / self.delta, -1.0, 1.0) / deviation.size
        weight = np.zeros(q.size)
        weight[seen.groups.first_equal(q, best)] = -self.gamma * slope
        df = seen.P_transposed @ weight
        df[own] += slope
        df[seen.pinned] = 0.0
        return float(value), df, float(-slope.sum())


class BellmanTerm:
    """Draws batches of states, so that the cost does not grow with the state space."""

    def __init__(
        self,
        model: TransitionModel,
        gamma: float,
        fixed_vr: Mapping[int, float] | None = None,
        *,
        batch: int = 256,
        delta: float = 0.01,
        cautious: bool = False,
    ) -> None:
        """Prepare for batches of ``batch`` states (all, if there are fewer).

        In a ``cautious`` term the last of the batch's states is the pseudo-state of
        `irl.neighbourhood`.

        States without feasible pairs have no (3.18) and pinned ones nothing to learn; neither
        is drawn.

        Raises:
            InputError: if gamma is outside 0…1, or batch or delta is not positive.
        """
        check_range("gamma", gamma, 0, 1)
        check_range("bellman_batch", batch, 1)
        check_range("bellman_delta", delta, 0, open_low=True)
        self._model, self._gamma, self._fixed_vr = model, gamma, dict(fixed_vr or {})
        self._delta, self._cautious = delta, cautious
        eligible = model.widths > 0
        eligible[list(self._fixed_vr)] = False
        self._pool = np.flatnonzero(eligible)
        if self._pool.size == 0:
            raise InputError("bellman_weight: no state has feasible actions; set it to 0")
        self._batch = min(batch, self._pool.size)

    def fingerprint(self) -> str:
        """SHA-256 that tells this penalty from any other."""
        P = self._model.P
        return fingerprint(
            *(self._model.first_pair, P.data, P.indices, P.indptr, self._pool),
            np.array([*self._fixed_vr.items()], dtype=np.float64),
            np.array([self._gamma, self._delta, self._batch, self._cautious]),
        )

    @cached_property
    def whole(self) -> BellmanBatch | None:
        """The penalty on all states at once, if batches are that large; nothing is then drawn."""
        return self._on(self._pool) if self._batch == self._pool.size else None

    def draw(self, rng: np.random.Generator) -> BellmanBatch:
        """The penalty on a fresh batch of distinct states, or on all of them."""
        if self.whole is not None:
            return self.whole
        return self._on(rng.choice(self._pool, self._batch, replace=False, shuffle=False))

    def _on(self, states: np.ndarray) -> BellmanBatch:
        seen = Neighbourhood.of(
            self._model, states, self._fixed_vr, include_states=True, cautious=self._cautious
        )
        return BellmanBatch(seen, self._gamma, self._delta)
