"""Maximum-likelihood inverse reinforcement learning with a linear reward: thesis (3.13), (3.14).

The demonstrator is taken to choose a in s with probability proportional to exp(β Q*(s, a))
among the feasible actions, Q* being optimal for R = Φ ω (3.10), earned on entering a state.

The gradient follows the greedy policy: see ``irl.baselines.differentiable_planning``. Where that
policy is not unique, f has a kink and this is one of its subgradients.
"""

import numpy as np

from irl.baselines.ascent import Callback, ascend
from irl.baselines.differentiable_planning import HardMax
from irl.baselines.features import state_features
from irl.baselines.planned_likelihood import PlannedLikelihood
from irl.demonstrations import Demonstrations
from irl.mdp import TransitionModel


def linear_mlirl(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray | None = None,
    *,
    gamma: float,
    beta: float = 1.0,
    tolerance: float = 1e-4,
    max_iterations: int = 200,
    callback: Callback | None = None,
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
        callback: follows the ascent.

    Returns:
        R ``[n_states]``, earned on entering a state, and ω ``[d]``.

    Raises:
        InputError: if there is no demonstration, a pair is infeasible, a number is out of range,
            or the features are not finite or have a wrong shape.
    """
    phi = state_features(model, features)
    likelihood = PlannedLikelihood.build(model, demonstrations, gamma, HardMax(), beta)

    def objective(weights: np.ndarray) -> tuple[float, np.ndarray]:
        return likelihood.in_weights(phi, weights)

    answer = ascend(
        objective,
        np.zeros(phi.shape[1]),
        tolerance=tolerance,
        max_iterations=max_iterations,
        callback=callback,
    )
    return phi @ answer.x, answer.x
