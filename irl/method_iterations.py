"""One iteration of a method at a time, so that "seconds an iteration" means something.

Each function prepares a method and returns another, without arguments, that goes one iteration
further: an evaluation of the objective, its gradient, and a step along it.
"""

from collections.abc import Callable

import numpy as np
import torch
from scipy import sparse

from irl.baselines.behaviour_cloning import value_and_gradient
from irl.baselines.birl import SamplingConfig
from irl.baselines.deep_max_ent import RewardNetwork
from irl.baselines.differentiable_planning import Maximum, Planner
from irl.baselines.features import state_features
from irl.baselines.max_ent import FeatureMatching
from irl.baselines.mcmc import crank_nicolson
from irl.baselines.planned_likelihood import PlannedLikelihood
from irl.demonstrations import Demonstrations
from irl.likelihood import LikelihoodProblem
from irl.mdp import TransitionModel
from irl.method_inputs import inverse_temperature, required, walks
from irl.optimizers import Adam
from irl.vr_function import VRFunction, torch_generator

HIDDEN = (32, 32)  # widths of the networks' hidden layers

Iteration = Callable[[], None]
Prepare = Callable[
    [TransitionModel, Demonstrations, np.ndarray | None, float, np.random.Generator], Iteration
]


def planned(maximum: Maximum) -> Prepare:
    """A unit step along the gradient of the planned likelihood, a reward per state."""

    def prepare(
        model: TransitionModel,
        demonstrations: Demonstrations,
        features: np.ndarray | None,
        gamma: float,
        rng: np.random.Generator,
    ) -> Iteration:
        likelihood = PlannedLikelihood.build(model, demonstrations, gamma, maximum, beta=1.0)
        reward = np.zeros(model.n_states)

        def once() -> None:
            reward[:] += likelihood.value_and_gradient(reward)[1]

        return once

    return prepare


def fa_mlirl(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray | None,
    gamma: float,
    rng: np.random.Generator,
) -> Iteration:
    """A step of Adam on (3.19)."""
    x = required(features)
    network = VRFunction(x.shape[1], HIDDEN, generator=torch_generator(rng))
    problem = LikelihoodProblem.build(model, demonstrations.state, demonstrations.action)
    at, ascent = network.at(x[problem.states]), Adam(network.parameters)
    beta = inverse_temperature(demonstrations)

    def once() -> None:
        _, df, _ = problem.value_and_gradient(at.forward().numpy(), beta)
        ascent.step(at.backward(torch.from_numpy(df)), 1e-3)

    return once


def max_ent(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray | None,
    gamma: float,
    rng: np.random.Generator,
) -> Iteration:
    """A step along the difference of visits, a reward per state."""
    problem = FeatureMatching.build(model, walks(demonstrations))
    reward = np.zeros(model.n_states)

    def once() -> None:
        reward[:] += 0.1 * problem.value_and_surplus(reward)[1]

    return once


def deep_max_ent(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray | None,
    gamma: float,
    rng: np.random.Generator,
) -> Iteration:
    """A step of Adam on the reward network."""
    problem = RewardNetwork.build(
        model, walks(demonstrations), required(features), HIDDEN, r_max=10.0, rng=rng
    )
    ascent = Adam(problem.network.parameters)

    def once() -> None:
        ascent.step(problem.value_and_gradient()[1], 0.01)

    return once


def birl(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray | None,
    gamma: float,
    rng: np.random.Generator,
) -> Iteration:
    """A proposal of Metropolis–Hastings, a reward per state."""
    sampling = SamplingConfig()
    problem = LikelihoodProblem.build(model, demonstrations.state, demonstrations.action)
    planner = Planner(model, gamma, tolerance=1e-6 / sampling.beta)

    def log_likelihood(reward: np.ndarray) -> tuple[float, None]:
        f = planner.solve(reward)
        mean, _, _ = problem.value_and_gradient(f[problem.states], sampling.beta)
        return mean * len(demonstrations), None

    start = sampling.prior_scale * rng.standard_normal(model.n_states)
    steps = crank_nicolson(log_likelihood, start, sampling.prior_scale, rng, burn_in=0)

    def once() -> None:
        next(steps)

    return once


def behaviour_cloning(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray | None,
    gamma: float,
    rng: np.random.Generator,
) -> Iteration:
    """A unit step along the gradient of the classifier's likelihood."""
    problem = LikelihoodProblem.build(model, demonstrations.state, demonstrations.action)
    phi = sparse.csr_matrix(state_features(model, features))
    inputs = sparse.hstack([phi, np.ones((model.n_states, 1))], format="csr")
    weights = np.zeros((inputs.shape[1], model.n_actions))

    def once() -> None:
        weights[:] += value_and_gradient(model, problem, inputs, weights)[1]

    return once
