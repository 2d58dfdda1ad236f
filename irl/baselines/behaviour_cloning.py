"""Behaviour cloning: predict the demonstrated action from features, without planning.

A softmax classifier over each state's own feasible actions. The transition model says which
those are; where they lead plays no part.
"""

import numpy as np
from scipy import sparse

from irl.baselines.ascent import Callback, RidgeConfig, ridge_ascend
from irl.baselines.features import Features, state_features
from irl.choices import check_range
from irl.demonstrations import Demonstrations
from irl.likelihood import LikelihoodProblem
from irl.mdp import TransitionModel


def behaviour_cloning(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray | None = None,
    *,
    config: RidgeConfig | None = None,
    callback: Callback | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Fit π(a | s) ∝ exp(φ(s)·ω_a + b_a) to the demonstrations, each counting the same.

    Args:
        model: the transition model.
        demonstrations: labelled pairs, in any order.
        features: Φ, ``[n_states, d]``, best of a size near 1; one indicator per state if absent,
            which clones demonstrated states one by one and elsewhere tells the actions apart by
            their frequency alone.
        config: the price of (|ω|² + |b|²) / 2 against the mean log-likelihood, above 0, and when
            the fit ends.
        callback: follows the fit, an iteration at a time.

    Returns:
        log π(a | s) ``[n_states, n_actions]``, −∞ where infeasible, and the weights
        ``[d + 1, n_actions]``, the biases b in the last row.

    Raises:
        InputError: if there is no demonstration, a pair is infeasible, l2 is not above 0,
            or the features are not finite or have a wrong shape.
    """
    config = config or RidgeConfig()
    check_range("l2", config.l2, 0, open_low=True)
    phi = sparse.csr_matrix(state_features(model, features))
    problem = LikelihoodProblem.of(model, demonstrations)
    inputs = sparse.hstack([phi, np.ones((model.n_states, 1))], format="csr")
    shape = inputs.shape[1], model.n_actions

    def objective(flat: np.ndarray) -> tuple[float, np.ndarray]:
        value, gradient = value_and_gradient(model, problem, inputs, flat.reshape(shape))
        return value, gradient.ravel()

    start = np.zeros(shape[0] * shape[1])
    weights = ridge_ascend(objective, start, config, callback=callback).reshape(shape)
    score = (inputs @ weights)[model.pair_state, model.pair_action]
    return model.table(model.groups.log_softmax(score)), weights


def value_and_gradient(
    model: TransitionModel, problem: LikelihoodProblem, inputs: Features, weights: np.ndarray
) -> tuple[float, np.ndarray]:
    """Mean log-likelihood of the demonstrations, concave in the weights, and its gradient.

    Args:
        model: the transition model.
        problem: the demonstrations, prepared.
        inputs: features of every state, ``[n_states, d + 1]``, the last being 1.
        weights: ``[d + 1, n_actions]``.

    Returns:
        The mean (≤ 0), and float64 ``[d + 1, n_actions]``.
    """
    seen = problem.seen
    x, pair = inputs[seen.states], (seen.groups.segment, model.pair_action[seen.rows])
    log_pi = seen.groups.log_softmax((x @ weights)[pair])
    surplus = np.zeros((seen.states.size, model.n_actions))
    surplus[pair] = problem.label_share - seen.groups.spread(problem.state_share) * np.exp(log_pi)
    return float(problem.label_share @ log_pi), x.T @ surplus
