"""Bellman Gradient Iteration, Li, Sui & Burdick (2017, arXiv:1707.07767); BGI in Table 6.1.

The maximum in Bellman's equation is replaced by one that can be differentiated, and with it the
likelihood (3.13) of the demonstrations under π(a | s) ∝ exp(β Q(s, a)):

- ``norm``, the p-norm (Σ Qᵏ)^(1/k), for values from 0. The reward is shifted by its least entry
  first, which changes no choice where nothing ends; γ n^(1/k) must be below 1.
- ``soft``, the generalised soft maximum log Σ exp(k Q) / k.

The published method iterates ∂Q/∂θ = P (∂R/∂θ + γ ∂V/∂θ), a number for each pair and parameter.
The gradient of one likelihood needs only the transposed iteration, a number for each state, and
that is what runs here: the same fixed point, at a cost that does not grow with the parameters.
"""

from collections.abc import Sequence

import numpy as np
import torch

from irl.baselines.ascent import Callback, ascend
from irl.baselines.differentiable_planning import Maximum, PNorm, SoftMax
from irl.baselines.features import state_features
from irl.baselines.planned_likelihood import PlannedLikelihood
from irl.choices import check_choice, check_range
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.optimizers import Adam
from irl.vr_function import VRFunction, torch_generator

SMOOTHINGS = ("soft", "norm")
SHARPNESS = 100.0  # k, unless told otherwise


def bellman_gradient(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray | None = None,
    *,
    gamma: float,
    beta: float = 1.0,
    smoothing: str = "soft",
    sharpness: float = SHARPNESS,
    tolerance: float = 1e-4,
    max_iterations: int = 200,
    callback: Callback | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Climb the likelihood of a linear reward R = Φ ω (3.10) from ω = 0.

    Args:
        model: the transition model.
        demonstrations: labelled pairs, in any order.
        features: Φ, ``[n_states, d]``; one indicator per state if absent.
        gamma: discount factor in [0, 1).
        beta: inverse temperature β, above 0.
        smoothing: ``soft`` or ``norm``.
        sharpness: k, in either.
        tolerance: largest gradient entry at which the ascent ends.
        max_iterations: the ascent ends after so many evaluations in any case.
        callback: follows the ascent.

    Returns:
        R ``[n_states]``, earned on entering a state, and ω ``[d]``.

    Raises:
        InputError: if there is no demonstration, a pair is infeasible, a name is unknown, a
            number is out of range, or the features are not finite or have a wrong shape.
    """
    phi = state_features(model, features)
    maximum = smooth_maximum(smoothing, sharpness)
    likelihood = PlannedLikelihood.build(model, demonstrations, gamma, maximum, beta)

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


def bellman_gradient_network(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray,
    *,
    gamma: float,
    beta: float = 30.0,
    smoothing: str = "soft",
    sharpness: float = SHARPNESS,
    hidden: Sequence[int] = (32, 32),
    step: float = 1e-2,
    iterations: int = 300,
    rng: np.random.Generator,
) -> tuple[np.ndarray, VRFunction]:
    """Climb the likelihood of a reward that a network computes from features, with Adam.

    Args:
        model: the transition model.
        demonstrations: labelled pairs, in any order.
        features: ``[n_states, d]``, the network's input.
        gamma: discount factor in [0, 1).
        beta: inverse temperature β, above 0; rewards lie in (−1, 1).
        smoothing: ``soft`` or ``norm``.
        sharpness: k, in either.
        hidden: widths of the hidden layers.
        step: Adam's step.
        iterations: number of steps.
        rng: draws the initial weights.

    Returns:
        R ``[n_states]``, earned on entering a state, and the network.

    Raises:
        InputError: as ``bellman_gradient``, or if there are no features.
    """
    if features is None:
        raise InputError("features: a network reward needs features [n_states, d]")
    x = np.asarray(state_features(model, features))
    maximum = smooth_maximum(smoothing, sharpness)
    likelihood = PlannedLikelihood.build(model, demonstrations, gamma, maximum, beta)
    network = VRFunction(x.shape[1], hidden, generator=torch_generator(rng))
    at, ascent = network.at(x), Adam(network.parameters)
    for _ in range(iterations):
        _, gradient = likelihood.value_and_gradient(at.forward().double().numpy())
        ascent.step(at.backward(torch.from_numpy(gradient)), step)
    return network.values(x), network


def smooth_maximum(smoothing: str, sharpness: float) -> Maximum:
    """The maximum of that name and sharpness k.

    Raises:
        InputError: if the name is unknown, or k is out of range.
    """
    check_choice("smoothing", smoothing, SMOOTHINGS)
    check_range("sharpness", sharpness, 0.0, open_low=True)
    return PNorm(sharpness) if smoothing == "norm" else SoftMax(1 / sharpness)
