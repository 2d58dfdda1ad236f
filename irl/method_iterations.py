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
from irl.likelihood import LikelihoodProblem
from irl.method_inputs import Task, inverse_temperature, required, walks
from irl.optimizers import Adam
from irl.vr_function import VRFunction, torch_generator

HIDDEN = (32, 32)  # widths of the networks' hidden layers

Iteration = Callable[[], None]
Prepare = Callable[[Task], Iteration]


def planned(maximum: Maximum) -> Prepare:
    """A unit step along the gradient of the planned likelihood, a reward per state."""

    def prepare(task: Task) -> Iteration:
        likelihood = PlannedLikelihood.build(
            task.model, task.demonstrations, task.gamma, maximum, beta=1.0
        )
        reward = np.zeros(task.model.n_states)

        def once() -> None:
            reward[:] += likelihood.value_and_gradient(reward)[1]

        return once

    return prepare


def fa_mlirl(task: Task) -> Iteration:
    """A step of Adam on (3.19)."""
    x = required(task.features)
    network = VRFunction(x.shape[1], HIDDEN, generator=torch_generator(task.rng))
    problem = LikelihoodProblem.build(
        task.model, task.demonstrations.state, task.demonstrations.action
    )
    at, ascent = network.at(x[problem.states]), Adam(network.parameters)
    beta = inverse_temperature(task.demonstrations)

    def once() -> None:
        _, df, _ = problem.value_and_gradient(at.forward().numpy(), beta)
        ascent.step(at.backward(torch.from_numpy(df)), 1e-3)

    return once


def max_ent(task: Task) -> Iteration:
    """A step along the difference of visits, a reward per state."""
    problem = FeatureMatching.build(task.model, walks(task.demonstrations))
    reward = np.zeros(task.model.n_states)

    def once() -> None:
        reward[:] += 0.1 * problem.value_and_surplus(reward)[1]

    return once


def deep_max_ent(task: Task) -> Iteration:
    """A step of Adam on the reward network."""
    problem = RewardNetwork.build(
        task.model,
        walks(task.demonstrations),
        required(task.features),
        HIDDEN,
        r_max=10.0,
        rng=task.rng,
    )
    ascent = Adam(problem.network.parameters)

    def once() -> None:
        ascent.step(problem.value_and_gradient()[1], 0.01)

    return once


def birl(task: Task) -> Iteration:
    """A proposal of Metropolis–Hastings, a reward per state."""
    sampling = SamplingConfig()
    problem = LikelihoodProblem.build(
        task.model, task.demonstrations.state, task.demonstrations.action
    )
    planner = Planner(task.model, task.gamma, tolerance=1e-6 / sampling.beta)

    def log_likelihood(reward: np.ndarray) -> tuple[float, None]:
        f = planner.solve(reward)
        mean, _, _ = problem.value_and_gradient(f[problem.states], sampling.beta)
        return mean * len(task.demonstrations), None

    start = sampling.prior_scale * task.rng.standard_normal(task.model.n_states)
    steps = crank_nicolson(log_likelihood, start, sampling.prior_scale, task.rng, burn_in=0)

    def once() -> None:
        next(steps)

    return once


def behaviour_cloning(task: Task) -> Iteration:
    """A unit step along the gradient of the classifier's likelihood."""
    problem = LikelihoodProblem.build(
        task.model, task.demonstrations.state, task.demonstrations.action
    )
    phi = sparse.csr_matrix(state_features(task.model, task.features))
    inputs = sparse.hstack([phi, np.ones((task.model.n_states, 1))], format="csr")
    weights = np.zeros((inputs.shape[1], task.model.n_actions))

    def once() -> None:
        weights[:] += value_and_gradient(task.model, problem, inputs, weights)[1]

    return once
