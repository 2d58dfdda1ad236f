"""FunctionApprox, the inner loop of thesis Algorithm 4.1: fit the VR network to demonstrations."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

from irl.bellman import BellmanTerm
from irl.choices import check_choice, check_range
from irl.errors import InputError
from irl.likelihood import LikelihoodProblem
from irl.optimizers import OPTIMIZERS
from irl.vr_function import VRFunction

SCHEDULES = ("cosine", "none")
WINDOW = 100  # iterations that the convergence test looks back over


@dataclass(frozen=True)
class TrainingConfig:
    """How to climb the likelihood.

    The thesis' algorithm is ``sgd`` with ``schedule="none"`` and no Bellman weight.
    """

    iterations: int = 2000
    """Most steps to take."""
    optimizer: str = "adam"
    """adam or sgd."""
    step: float = 1e-3
    """Learning rate α of thesis (3.14), on the mean log-likelihood."""
    schedule: str = "cosine"
    """cosine: the step decays to 0 over the iterations; none: it stays."""
    beta: float = 30.0
    """Inverse temperature β of (3.19), or where it starts if it is learnt."""
    learn_beta: bool = False
    """Whether β is adjusted with the weights."""
    tolerance: float = 0.0
    """Stop once 100 iterations change the mean log-likelihood by less than this; 0 never stops."""
    weight_decay: float = 0.0
    """Shrinkage of the weights per unit of step (decoupled for adam)."""
    bellman_weight: float = 0.0
    """Weight of the Bellman penalty against the mean log-likelihood; 0 is the thesis."""
    bellman_batch: int = 256
    """States a batch of the penalty."""
    bellman_delta: float = 0.01
    """Deviation of the reward, in units of f, where the penalty turns linear."""

    def __post_init__(self) -> None:
        """Refuse values outside their range.

        Raises:
            InputError: naming the field and what it may be.
        """
        check_choice("optimizer", self.optimizer, OPTIMIZERS)
        check_choice("schedule", self.schedule, SCHEDULES)
        check_range("iterations", self.iterations, 0)
        check_range("step", self.step, 0, 1e6, open_low=True)
        check_range("beta", self.beta, 0, open_low=True)
        check_range("tolerance", self.tolerance, 0)
        check_range("weight_decay", self.weight_decay, 0)
        check_range("bellman_weight", self.bellman_weight, 0)
        check_range("bellman_batch", self.bellman_batch, 1)
        check_range("bellman_delta", self.bellman_delta, 0, open_low=True)


@dataclass(frozen=True)
class Training:
    """What a training run did, besides changing the network in place.

    Attributes:
        log_likelihood: float64 ``[iterations taken]``: the mean before each step.
        beta: the inverse temperature at the end.
        step_reward: the Bellman term's common reward at the end, 0 without that term.
        converged: whether the tolerance was met before the iterations ran out.
    """

    log_likelihood: np.ndarray
    beta: float
    step_reward: float
    converged: bool


def train(
    network: VRFunction,
    problem: LikelihoodProblem,
    features: np.ndarray | torch.Tensor,
    config: TrainingConfig,
    rng: np.random.Generator,
    callback: Callable[[int, float], None] | None = None,
    bellman: BellmanTerm | None = None,
) -> Training:
    """Adjust ``network`` in place towards the maximum of (3.19); the same inputs, the same bits.

    Args:
        network: the VR function; training starts from its present weights.
        problem: the demonstrations.
        features: ``[n_states, n_features]``.
        config: how to train.
        rng: draws the batches of the Bellman term, and nothing else.
        callback: called after each step with the iterations done and the mean
            log-likelihood before that step; the network may be read meanwhile.
        bellman: the penalty's states; required if ``config.bellman_weight`` is above 0.

    Raises:
        InputError: if the Bellman term is missing, or training diverges.
    """
    if config.bellman_weight > 0 and bellman is None:
        raise InputError("bellman_weight: above 0 needs a Bellman term (transition model, gamma)")
    x = torch.as_tensor(features, dtype=torch.float32)
    at = network.at(x[torch.from_numpy(problem.states)])
    # log β and the common reward: one number each, in their natural scales, never decayed.
    scalars = torch.tensor([math.log(config.beta), 0.0], dtype=torch.float64)
    ascend = OPTIMIZERS[config.optimizer](network.parameters, config.weight_decay)
    ascend_scalars = OPTIMIZERS[config.optimizer](scalars)
    history = np.empty(config.iterations)
    done, converged = 0, False
    while done < config.iterations and not converged:
        beta = math.exp(scalars[0].item())
        value, df, dbeta = problem.value_and_gradient(at.forward().numpy(), beta)
        if not math.isfinite(value):
            raise InputError(f"step: training diverged at iteration {done}; choose a smaller step")
        gradient = at.backward(torch.from_numpy(df))
        gradient_scalars = torch.zeros_like(scalars)
        if config.learn_beta:
            gradient_scalars[0] = beta * dbeta
        if config.bellman_weight > 0 and bellman is not None:
            batch = bellman.draw(rng)
            at_batch = network.at(x[torch.from_numpy(batch.states)])
            f = at_batch.forward().numpy()
            if done == 0:  # begin where the penalty, nearly an absolute value, is least
                scalars[1] = float(np.median(batch.rewards(f)))
            _, df, dreward = batch.value_and_gradient(f, scalars[1].item())
            gradient -= config.bellman_weight * at_batch.backward(torch.from_numpy(df))
            gradient_scalars[1] = -config.bellman_weight * dreward
        ascend.step(gradient, _step(config, done))
        if config.learn_beta or config.bellman_weight > 0:
            ascend_scalars.step(gradient_scalars, _step(config, done))
        history[done] = value
        done += 1
        if config.tolerance > 0 and done > WINDOW:
            converged = abs(value - history[done - 1 - WINDOW]) < config.tolerance
        if callback is not None:
            callback(done, value)
    return Training(
        history[:done].copy(), math.exp(scalars[0].item()), scalars[1].item(), converged
    )


def _step(config: TrainingConfig, done: int) -> float:
    if config.schedule == "none":
        return config.step
    return config.step * (1 + math.cos(math.pi * done / config.iterations)) / 2
