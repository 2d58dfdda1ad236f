"""The Gaussian that a posterior of rewards is shaped like about its summit (Laplace).

Many demonstrations leave the posterior a hundred times narrower than the prior, and steps as long
as the prior is wide are then nearly all refused. Steps of the posterior's own shape are not: the
chains of ``irl.baselines.birl`` walk in coordinates in which this Gaussian is the standard one.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from irl.baselines.ascent import RidgeConfig, ridge_ascend
from irl.baselines.features import Features
from irl.baselines.lp_basis import entry_values
from irl.baselines.planned_likelihood import PlannedLikelihood
from irl.planning import transition_matrix

LARGEST = 10_000_000
"""Entries of the table ∂Q/∂ω above which it is not made, and the prior's own shape is taken."""


@dataclass(frozen=True)
class Shape:
    """N(mean, L Lᵀ).

    Attributes:
        mean: ``[d]``.
        factor: L, ``[d, d]``.
        inverse: of L.
    """

    mean: np.ndarray
    factor: Features
    inverse: Features

    def at(self, z: np.ndarray) -> np.ndarray:
        """The weights of standard coordinates ``[d]``."""
        return self.mean + self.factor @ z

    def coordinates(self, weights: np.ndarray) -> np.ndarray:
        """The standard coordinates of weights ``[d]``."""
        return self.inverse @ (weights - self.mean)


def posterior_shape(
    likelihood: PlannedLikelihood,
    phi: Features,
    labels: float,
    prior_scale: float,
    start: np.ndarray,
) -> Shape:
    """Climb from ``start`` to a summit of the posterior, and measure how it falls off there.

    The curvature is Fisher's information, β² Σ_s n_s Cov_π(∂Q(s, ·)/∂ω), the greedy policy under
    the summit's reward held fixed, and the prior's 1 / scale².

    Args:
        likelihood: of a label, in the mean.
        phi: Φ, ``[n_states, d]``, or of pairs ``[n_pairs, d]``.
        labels: how many labels there are.
        prior_scale: standard deviation of every weight beforehand.
        start: where to begin, ``[d]``.
    """
    d = phi.shape[1]
    if likelihood.planner.model.n_pairs * d > LARGEST:
        one = sparse.identity(d, format="csr")
        return Shape(np.zeros(d), one * prior_scale, one / prior_scale)
    price = RidgeConfig(l2=1 / (labels * prior_scale**2))
    mean = ridge_ascend(lambda weights: likelihood.in_weights(phi, weights), start, price)
    information = np.eye(d) / prior_scale**2 + labels * _fisher(likelihood, phi, mean)
    # Of C⁻¹ = K Kᵀ, the inverse of K transposed is a factor of C.
    root = np.linalg.cholesky(information)
    return Shape(mean, np.linalg.inv(root).T, root.T)


def _fisher(likelihood: PlannedLikelihood, phi: Features, weights: np.ndarray) -> np.ndarray:
    """Fisher's information ``[d, d]`` of a label, in the mean."""
    seen, planner, model = likelihood.problem.seen, likelihood.planner, likelihood.planner.model
    q = planner.q(planner.solve(phi @ weights))
    greedy = np.where(model.widths > 0, model.table(q).argmax(axis=1), -1)
    P = transition_matrix(model, greedy)
    if planner.of_pairs:
        earned = np.zeros((model.n_states, phi.shape[1]))
        earned[model.acting] = phi[model.pair_index(model.acting, greedy[model.acting])]
        worth = entry_values(P, earned, planner.gamma)  # ∂V/∂ω
        slopes = phi[seen.rows] + planner.gamma * (model.P[seen.rows] @ worth)
    else:
        slopes = model.P[seen.rows] @ entry_values(P, phi, planner.gamma)  # ∂Q/∂ω
    pi = np.exp(seen.groups.log_softmax(likelihood.beta * q[seen.rows]))
    expected = np.add.reduceat(pi[:, None] * slopes, seen.groups.first)
    surplus = slopes - expected[seen.groups.segment]
    weight = pi * seen.groups.spread(likelihood.problem.state_share)
    return likelihood.beta**2 * surplus.T @ (weight[:, None] * surplus)
