"""Maximum-likelihood inverse reinforcement learning with a linear reward: thesis (3.13), (3.14).

The demonstrator is taken to choose a in s with probability proportional to exp(β Q*(s, a))
among the feasible actions, Q* being optimal for R = Φ ω (3.10), earned on entering a state.

The gradient follows the greedy policy π. With f = R + γ V* (3.15), f = Φ ω + γ P_π f, so that
∂f/∂ω = (I − γ P_π)⁻¹ Φ. For the gradient g of the likelihood in f only Φᵀ μ is needed, where
μ = g + γ P_πᵀ μ: one fixed point for all weights together. Where π is not unique, f has a kink
and this is one of its subgradients.
"""

import numpy as np
from scipy import sparse

from irl.baselines.features import Features, state_features
from irl.choices import check_range
from irl.demonstrations import Demonstrations
from irl.likelihood import LikelihoodProblem
from irl.mdp import TransitionModel
from irl.planning import transition_matrix, value_iteration

_PRECISION = 1e-11  # of V and μ, so that rounding does not hide the last gains in likelihood


def linear_mlirl(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray | None = None,
    *,
    gamma: float,
    beta: float = 1.0,
    tolerance: float = 1e-4,
    max_iterations: int = 200,
) -> tuple[np.ndarray, np.ndarray]:
    """Climb (3.14) from ω = 0; the rate α doubles after a gain and halves without one.

    Flawless demonstrations have no likeliest ω: the longer the ascent, the larger ω. Then
    ``tolerance`` decides how far it goes.

    Args:
        model: the transition model.
        demonstrations: labelled pairs, in any order.
        features: Φ, ``[n_states, d]``; one indicator per state if absent.
        gamma: discount factor in [0, 1).
        beta: inverse temperature β, above 0.
        tolerance: largest gradient entry at which the ascent ends.
        max_iterations: the ascent ends after so many evaluations in any case.

    Returns:
        R ``[n_states]``, earned on entering a state, and ω ``[d]``.

    Raises:
        InputError: if there is no demonstration, a pair is infeasible, a number is out of range,
            or the features are not finite or have a wrong shape.
    """
    check_range("beta", beta, 0.0, open_low=True)
    phi = state_features(model, features)
    problem = LikelihoodProblem.build(model, demonstrations.state, demonstrations.action)
    weights, rate = np.zeros(phi.shape[1]), 1.0
    value, gradient = value_and_gradient(model, problem, phi, weights, gamma, beta)
    for _ in range(max_iterations):
        if np.abs(gradient).max(initial=0.0) <= tolerance:
            break
        further = weights + rate * gradient
        there = value_and_gradient(model, problem, phi, further, gamma, beta)
        if there[0] > value:
            weights, (value, gradient) = further, there
            rate *= 2
        else:
            rate /= 2
    return phi @ weights, weights


def value_and_gradient(
    model: TransitionModel,
    problem: LikelihoodProblem,
    features: Features,
    weights: np.ndarray,
    gamma: float,
    beta: float,
) -> tuple[float, np.ndarray]:
    """Mean log-likelihood (3.13) of the demonstrations, and a (sub)gradient in ω.

    Args:
        model: the transition model.
        problem: the demonstrations, prepared.
        features: Φ, ``[n_states, d]``.
        weights: ω, ``[d]``.
        gamma: discount factor in [0, 1).
        beta: inverse temperature, above 0.

    Returns:
        The mean (≤ 0), and float64 ``[d]``.

    Raises:
        InputError: if gamma is out of range.
    """
    reward = features @ weights
    V, Q = value_iteration(model, reward, gamma, tolerance=_PRECISION)
    f = reward + gamma * V
    value, df, _ = problem.value_and_gradient(f[problem.states], beta)
    g = np.zeros(model.n_states)
    g[problem.states] = df
    greedy = np.where(np.isfinite(Q).any(axis=1), Q.argmax(axis=1), -1)
    return value, features.T @ _accumulate(transition_matrix(model, greedy), g, gamma)


def _accumulate(P: sparse.csr_matrix, g: np.ndarray, gamma: float) -> np.ndarray:
    """Solve μ = g + γ Pᵀ μ, a contraction by γ in the sum of absolute entries."""
    back = P.T.tocsr()
    total, change = g.copy(), g
    while np.abs(change).sum() > _PRECISION * (1 - gamma):
        change = gamma * (back @ change)
        total += change
    return total
