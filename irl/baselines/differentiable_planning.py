"""Planning that can be differentiated in the reward: V, f and the pull of f on R.

With f = R + γ V (3.15), the reward earned on entering a state, Bellman's equation reads
V = max P f, the maximum over each state's feasible actions, or a smooth stand-in for it. Where W
holds its slopes ∂V/∂Q, ∂f/∂R = (I − γ W P)⁻¹. A gradient g in f therefore becomes, in R,
μ = g + γ (W P)ᵀ μ: one sparse linear system for all rewards together.

A reward r of pairs, earned by acting, is planned for alike. Then f is that of pairs, f = r + γ P V,
which is Q itself, and the gradient becomes g + Wᵀ μ, μ being what γ Pᵀ g becomes above.
"""

from dataclasses import dataclass, field
from functools import cached_property
from itertools import count
from typing import Annotated, Protocol

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import bicgstab

from irl.choices import Limits, Settings, check_range
from irl.errors import InputError
from irl.groups import Groups
from irl.mdp import TransitionModel
from irl.onward import LARGEST, Onward

_SWEEPS = 5  # plain sweeps between two Newton steps
_NEWTON = 1e-3  # relative residual of a Newton step
_NEWTON_STEPS = 2000  # more than any search needs; then the sweeps' contraction takes over
_KRYLOV_STEPS = 300
_PULL_SWEEPS = 500  # that a Krylov solution may need; then the system is solved again, with care
_ROUNDING = 1e-15


class Maximum(Protocol):
    """A maximum over groups of neighbouring entries, and its slopes."""

    def values(self, q: np.ndarray, groups: Groups) -> np.ndarray:
        """Maximum of each group of ``q`` ``[n]``; float64 ``[m]``."""
        ...

    def slopes(self, q: np.ndarray, v: np.ndarray, groups: Groups) -> np.ndarray:
        """∂v/∂q ``[n]`` at ``v = values(q, …)``, each entry in its own group; none below 0."""
        ...

    def expansion(self, n_actions: int) -> float:
        """Largest sum of a group's slopes, a group having up to ``n_actions`` entries."""
        ...


class HardMax:
    """The maximum itself. Among equals the first carries the slope, a subgradient."""

    def values(self, q: np.ndarray, groups: Groups) -> np.ndarray:
        """See ``Maximum``."""
        return groups.maximum(q)

    def slopes(self, q: np.ndarray, v: np.ndarray, groups: Groups) -> np.ndarray:
        """See ``Maximum``."""
        slopes = np.zeros(q.size)
        slopes[groups.first_equal(q, v)] = 1.0
        return slopes

    def expansion(self, n_actions: int) -> float:
        """See ``Maximum``."""
        return 1.0


@dataclass(frozen=True)
class SoftMax(Settings):
    """τ log Σ exp(q / τ): soft value iteration, or with k = 1/τ Li & Burdick's soft maximum.

    Its slopes are the soft-optimal policy. Exceeds the maximum by at most τ log n.

    Attributes:
        temperature: τ, above 0, in the reward's unit.
    """

    temperature: Annotated[float, Limits(0, open_low=True)] = 1.0

    def values(self, q: np.ndarray, groups: Groups) -> np.ndarray:
        """See ``Maximum``."""
        return self.temperature * groups.log_sum_exp(q / self.temperature)

    def slopes(self, q: np.ndarray, v: np.ndarray, groups: Groups) -> np.ndarray:
        """See ``Maximum``."""
        share = np.exp((q - groups.spread(v)) / self.temperature)
        # Their sum is off 1 by v's rounding, which 1/(1 − γ) would multiply.
        return share / groups.spread(groups.sum(share))

    def expansion(self, n_actions: int) -> float:
        """See ``Maximum``."""
        return 1.0


@dataclass(frozen=True)
class PNorm(Settings):
    """(Σ qᵖ)^(1/p), for values from 0; negative ones count as 0.

    Exceeds the maximum by the factor n^(1/p) at most, so that Bellman's equation has a solution
    only where γ n^(1/p) < 1.

    Attributes:
        order: p, from 1.
    """

    order: Annotated[float, Limits(1)]

    def values(self, q: np.ndarray, groups: Groups) -> np.ndarray:
        """See ``Maximum``."""
        # Powers of the share of the largest, which cannot overflow.
        peak = np.maximum(groups.maximum(q), 0.0)
        share = np.maximum(q, 0.0) / groups.spread(np.where(peak > 0, peak, 1.0))
        return peak * groups.sum(share**self.order) ** (1 / self.order)

    def slopes(self, q: np.ndarray, v: np.ndarray, groups: Groups) -> np.ndarray:
        """See ``Maximum``; where all of a group is 0, what equal entries above 0 have."""
        share = np.maximum(q, 0.0) / groups.spread(np.where(v > 0, v, 1.0))
        equal = groups.widths ** (1 / self.order - 1)
        return np.where(groups.spread(v) > 0, share ** (self.order - 1), groups.spread(equal))

    def expansion(self, n_actions: int) -> float:
        """See ``Maximum``."""
        return n_actions ** (1 / self.order)


@dataclass
class Planner:
    """Solves V = max P (R + γ V) for one reward after another, each from the last solution.

    Or V = max (r + γ P V), if the reward is that of pairs.

    Sweeps of value iteration alternate with Newton steps, (I − γ W P) ΔV = residual, which for
    the hard maximum is policy iteration. The sweeps' contraction guarantees the result; the steps
    make it cheap, at any discount: where a Krylov method does not take them, factors do.

    Attributes:
        model: the transition model; V = 0 in states without actions.
        gamma: discount factor in [0, 1).
        maximum: the maximum, or what stands in for it.
        tolerance: largest error of V, as far as rounding permits.
        of_pairs: whether rewards are r ``[n_pairs]``, earned by acting, and so f and gradients.
        V: the last solution ``[n_states]``, where the next search begins.
    """

    model: TransitionModel
    gamma: float
    maximum: Maximum = field(default_factory=HardMax)
    tolerance: float = 1e-10
    of_pairs: bool = False
    V: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        """Begin from V = 0.

        Raises:
            InputError: if gamma is outside [0, 1), or the maximum expands too much for it.
        """
        check_range("gamma", self.gamma, 0, 1, open_high=True)
        widest = int(self.model.widths.max(initial=1))
        self._rate = self.gamma * self.maximum.expansion(widest)
        if self._rate >= 1:
            raise InputError(
                f"gamma: {self.gamma} is too large for {self.maximum} with {widest} actions: "
                "γ n^(1/p) must be below 1; choose a higher order"
            )
        self.V = np.zeros(self.model.n_states)
        self._entry = np.zeros(self.model.n_pairs if self.of_pairs else self._P.shape[0])
        self._warm = np.zeros(self.model.n_states)
        self._krylov = True

    @cached_property
    def _P(self) -> sparse.csr_matrix:
        """What every distinct distribution leads to: many fewer rows than pairs."""
        return self.model.P[self.model.outcomes[0]]

    @cached_property
    def _identity(self) -> sparse.csr_matrix:
        return sparse.identity(self.model.n_states, format="csr")

    def solve(self, reward: np.ndarray) -> np.ndarray:
        """Plan under a reward ``[n_states]``, earned on entering a state, or of pairs.

        Returns:
            f = R + γ V, float64 ``[n_states]``; Q = P f. Of pairs, f = r + γ P V ``[n_pairs]``.

        Raises:
            InputError: if the reward is not finite or has a wrong shape.
        """
        reward = np.asarray(reward, dtype=np.float64)
        size = self.model.n_pairs if self.of_pairs else self.model.n_states
        if reward.shape != (size,) or not np.isfinite(reward).all():
            raise InputError(f"reward: finite values [{size}] wanted, got {list(reward.shape)}")
        # Folded once: a sweep is one matrix product.
        self._entry = entry = reward if self.of_pairs else self._P @ reward
        V = self.V
        for round_ in count():
            for _ in range(_SWEEPS):
                q, last = self._q(entry, V), V
                V = self._values(q)
            change = np.abs(V - last).max(initial=0.0)
            # The contraction bounds what is left: |V − V*| ≤ rate / (1 − rate) · last change.
            if self._rate * change <= max(
                self.tolerance * (1 - self._rate), 1e-14 * np.abs(V).max(initial=0.0)
            ):
                break
            if round_ < _NEWTON_STEPS:
                q = self._q(entry, V)
                after = self._values(q)
                step = self._newton(q, after, after - V)
                if step is not None:
                    V = V + step
        self.V = V
        return self._q(reward, V) if self.of_pairs else reward + self.gamma * V

    def q(self, f: np.ndarray) -> np.ndarray:
        """The values ``[n_pairs]`` of what `solve` returned."""
        return f if self.of_pairs else self.model.P @ f

    def pull(self, g: np.ndarray) -> np.ndarray:
        """Turn a gradient in f into one in the reward, at the reward solved last.

        Args:
            g: ∂L/∂f, ``[n_states]``, or of pairs ``[n_pairs]``.

        Returns:
            ∂L/∂R, float64, as many.
        """
        q = self._q(self._entry, self.V)
        v = self._values(q)
        if not self.of_pairs:
            return self._carried(q, v, g)
        mu = self._carried(q, v, self.gamma * (self.model.P.T @ g))
        return g + self._slopes(q, v) * mu[self.model.pair_state]

    def _carried(self, q: np.ndarray, v: np.ndarray, g: np.ndarray) -> np.ndarray:
        """The μ of μ = g + γ (W P)ᵀ μ, ``[n_states]``, at values of the pairs and states."""
        size = np.abs(g).max(initial=0.0)
        if size == 0.0:
            return np.zeros(g.size)
        # Of size 1: SciPy takes products of small residuals for a breakdown.
        return size * self._carried_on(q, v, g / size)

    def _carried_on(self, q: np.ndarray, v: np.ndarray, g: np.ndarray) -> np.ndarray:
        """`_carried`, of a g whose largest entry is 1; begun where the last such one ended."""
        back = self._onward(q, v, self.gamma).T.tocsr()
        enough = self.tolerance * np.abs(g).sum()
        mu, failed = bicgstab(
            self._identity - back, g, x0=self._warm, rtol=self.tolerance, maxiter=_KRYLOV_STEPS
        )
        if not np.isfinite(mu).all():
            mu = g.copy()
        # A contraction in the sum of absolute entries finishes what the Krylov method left.
        for sweep in count():
            after = g + back @ mu
            change, mu = np.abs(after - mu).sum(), after
            left = self._rate * change
            if left <= max(enough * (1 - self._rate), _ROUNDING * np.abs(mu).sum()):
                break
            if failed or sweep == _PULL_SWEEPS:
                weight = self._onward(q, v, 1.0).T.tocsr()
                exact = Onward(weight, self.gamma, krylov=not failed).solve(g)
                if exact is not None:
                    mu = exact
                    break
                failed = 0
        self._warm = mu
        return mu

    def _newton(self, q: np.ndarray, v: np.ndarray, residual: np.ndarray) -> np.ndarray | None:
        """(I − γ W P)⁻¹ residual, nearly; None if that is too much to ask."""
        if self._krylov:
            system = self._identity - self._onward(q, v, self.gamma)
            step, failed = bicgstab(system, residual, rtol=_NEWTON, maxiter=_KRYLOV_STEPS)
            if not failed:
                return step
            self._krylov = residual.size > LARGEST
        return Onward(self._onward(q, v, 1.0), self.gamma, krylov=False).solve(residual)

    def _q(self, entry: np.ndarray, V: np.ndarray) -> np.ndarray:
        """Values of the pairs; ``entry`` is of every pair, or else of every distribution."""
        ahead, kind = self.gamma * (self._P @ V), self.model.outcomes[1]
        return entry + ahead[kind] if self.of_pairs else (entry + ahead)[kind]

    def _values(self, q: np.ndarray) -> np.ndarray:
        V = np.zeros(self.model.n_states)
        V[self.model.acting] = self.maximum.values(q, self.model.groups)
        return V

    def _slopes(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """∂V/∂Q, ``[n_pairs]``, at the given values of the pairs, and v = `_values` of them."""
        return self.maximum.slopes(q, v[self.model.acting], self.model.groups)

    def _onward(self, q: np.ndarray, v: np.ndarray, gamma: float) -> sparse.csr_matrix:
        """γ W P at the same, ``[n_states, n_states]``."""
        model = self.model
        weight = gamma * self._slopes(q, v)
        used = np.flatnonzero(weight)
        first = np.searchsorted(model.pair_state[used], np.arange(model.n_states + 1))
        choice = sparse.csr_matrix(
            (weight[used], used, first), shape=(model.n_states, model.n_pairs)
        )
        return choice @ model.P
