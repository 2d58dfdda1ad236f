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
from irl.baselines.deep_max_ent import DeepMaxEntConfig, RewardNetwork
from irl.baselines.differentiable_planning import Maximum, Planner
from irl.baselines.features import state_features
from irl.baselines.max_ent import FeatureMatching
from irl.baselines.mcmc import crank_nicolson
from irl.baselines.planned_likelihood import PlannedLikelihood
from irl.likelihood import LikelihoodProblem
from irl.method_inputs import Inputs, demonstrated, inverse_temperature
from irl.optimizers import Adam
from irl.vr_function import VRFunction, torch_generator

HIDDEN = (32, 32)  # widths of the networks' hidden layers

Iteration = Callable[[], None]
Prepare = Callable[[Inputs], Iteration]


def planned(maximum: Maximum) -> Prepare:
    """A unit step along the gradient of the planned likelihood, a reward per state."""

    def prepare(given: Inputs) -> Iteration:
        likelihood = PlannedLikelihood.build(
            given.model, given.demonstrations, given.gamma, maximum, beta=1.0
        )
        reward = np.zeros(given.model.n_states)

        def once() -> None:
            reward[:] += likelihood.value_and_gradient(reward)[1]

        return once

    return prepare


def fa_mlirl(given: Inputs) -> Iteration:
    """A step of Adam on (3.19)."""
    x = given.problem.required_features()
    network = VRFunction(x.shape[1], HIDDEN, generator=torch_generator(given.rng))
    problem = LikelihoodProblem.of(given.model, given.demonstrations)
    at, ascent = network.at(x[problem.states]), Adam(network.parameters)
    beta = inverse_temperature(given.demonstrations)

    def once() -> None:
        _, df, _ = problem.value_and_gradient(at.forward().numpy(), beta)
        ascent.step(at.backward(torch.from_numpy(df)), 1e-3)

    return once


def max_ent(given: Inputs) -> Iteration:
    """A step along the difference of visits, a reward per state."""
    problem = FeatureMatching.build(
        given.model, demonstrated(given.demonstrations), gamma=given.gamma
    )
    reward = np.zeros(given.model.n_states)

    def once() -> None:
        reward[:] += 0.1 * problem.value_and_surplus(reward)[1]

    return once


def deep_max_ent(given: Inputs) -> Iteration:
    """A step of Adam on the reward network."""
    problem = RewardNetwork.build(
        given.model,
        demonstrated(given.demonstrations),
        given.problem.required_features(),
        DeepMaxEntConfig(hidden=HIDDEN),
        gamma=given.gamma,
        rng=given.rng,
    )
    ascent = Adam(problem.network.parameters)

    def once() -> None:
        ascent.step(problem.value_and_gradient()[1], 0.01)

    return once


def birl(given: Inputs) -> Iteration:
    """A proposal of Metropolis–Hastings, a reward per state."""
    sampling = SamplingConfig()
    problem = LikelihoodProblem.of(given.model, given.demonstrations)
    planner = Planner(given.model, given.gamma, tolerance=1e-6 / sampling.beta)

    def log_likelihood(reward: np.ndarray) -> tuple[float, None]:
        f = planner.solve(reward)
        mean, _, _ = problem.value_and_gradient(f[problem.states], sampling.beta)
        return mean * problem.total, None

    start = sampling.prior_scale * given.rng.standard_normal(given.model.n_states)
    steps = crank_nicolson(log_likelihood, start, sampling.prior_scale, given.rng, burn_in=0)

    def once() -> None:
        next(steps)

    return once


def behaviour_cloning(given: Inputs) -> Iteration:
    """A unit step along the gradient of the classifier's likelihood."""
    problem = LikelihoodProblem.of(given.model, given.demonstrations)
    phi = sparse.csr_matrix(state_features(given.model, given.problem.features))
    inputs = sparse.hstack([phi, np.ones((given.model.n_states, 1))], format="csr")
    weights = np.zeros((inputs.shape[1], given.model.n_actions))

    def once() -> None:
        weights[:] += value_and_gradient(given.model, problem, inputs, weights)[1]

    return once
