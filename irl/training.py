"""FunctionApprox, the inner loop of thesis Algorithm 4.1: one fit of a VR network to labels."""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from irl.bellman import BellmanTerm
from irl.checkpoint import Checkpoint, fingerprint, load, restore_rng, rng_state, save
from irl.errors import InputError
from irl.likelihood import LikelihoodProblem
from irl.optimizers import OPTIMIZERS
from irl.training_config import TrainingConfig
from irl.vr_function import VRFunction

WINDOW = 100  # iterations that the convergence test averages over
PACE = 20.0
"""How much faster than a weight caution moves: f is moved by all weights at once, u by itself."""


@dataclass(frozen=True)
class Training:
    """What a training run did, besides changing the network in place.

    Attributes:
        log_likelihood: float64 ``[iterations taken]``: the mean before each step.
        beta: the inverse temperature at the end.
        caution: the dislike of uncertain outcomes at the end.
        step_reward: the Bellman term's common reward at the end, 0 without that term.
        converged: whether the tolerance was met before the iterations ran out.
    """

    log_likelihood: np.ndarray
    beta: float
    caution: float
    step_reward: float
    converged: bool


class _State:
    """Everything that changes in training, and so everything that a checkpoint holds."""

    def __init__(
        self, network: VRFunction, config: TrainingConfig, rng: np.random.Generator
    ) -> None:
        """Begin; ``network`` and ``rng`` are shared, not copied."""
        # log β, the common reward, and caution: one number each, in scales that steps of the same
        # size suit, never decayed.
        start = [math.log(config.beta), 0.0, config.caution / PACE]
        self.scalars = torch.tensor(start, dtype=torch.float64)
        optimizer = OPTIMIZERS[config.optimizer]
        self.ascend = optimizer(network.parameters, config.weight_decay)
        self.ascend_scalars = optimizer(self.scalars)
        self.log_likelihood = np.empty(config.iterations)
        self.done = 0
        self._rng = rng
        self._tensors = {
            "parameters": network.parameters,
            "moments": self.ascend.moments,
            "scalars": self.scalars,
            "scalar_moments": self.ascend_scalars.moments,
        }

    @property
    def caution(self) -> float:
        """The dislike of uncertain outcomes, in units of f."""
        return PACE * self.scalars[2].item()

    def settled(self, tolerance: float) -> bool:
        """Whether two successive windows' mean log-likelihoods differ by less than ``tolerance``.

        Means, because single values cross each other wherever Adam swings about an optimum.
        """
        if tolerance == 0 or self.done < 2 * WINDOW:
            return False
        before, after = self.log_likelihood[self.done - 2 * WINDOW : self.done].reshape(2, WINDOW)
        return bool(abs(after.mean() - before.mean()) < tolerance)

    def outcome(self, tolerance: float) -> Training:
        """What a caller is told at the end."""
        return Training(
            log_likelihood=self.log_likelihood[: self.done].copy(),
            beta=math.exp(self.scalars[0].item()),
            caution=self.caution,
            step_reward=self.scalars[1].item(),
            converged=self.settled(tolerance),
        )

    def take_up(self, path: Path, identity: dict[str, Any]) -> None:
        """Go on from a checkpoint, if there is one.

        If not, one is written at once, so that a path that cannot be written costs no work.
        """
        if path.exists():
            self.restore(path, identity)
        else:
            self.save(path, identity)

    def save(self, path: Path, identity: dict[str, Any]) -> None:
        """Write a checkpoint."""
        arrays = {name: tensor.cpu().numpy() for name, tensor in self._tensors.items()}
        arrays["log_likelihood"] = self.log_likelihood[: self.done]
        save(path, arrays, {"done": self.done, "rng": rng_state(self._rng)}, identity)

    def restore(self, path: Path, identity: dict[str, Any]) -> None:
        """Go on from a checkpoint.

        Raises:
            InputError: if it is damaged or of other training.
        """
        arrays, state = load(path, identity)
        for name, tensor in self._tensors.items():
            tensor.copy_(torch.from_numpy(arrays[name]))
        self.done = self.ascend.steps = self.ascend_scalars.steps = state["done"]
        self.log_likelihood[: self.done] = arrays["log_likelihood"]
        restore_rng(self._rng, state["rng"])


def train(
    network: VRFunction,
    problem: LikelihoodProblem,
    features: np.ndarray | torch.Tensor,
    config: TrainingConfig,
    rng: np.random.Generator,
    callback: Callable[[int, float], None] | None = None,
    bellman: BellmanTerm | None = None,
    checkpoint: Checkpoint | None = None,
) -> Training:
    """Adjust ``network`` in place towards the maximum of (3.19); the same inputs, the same bits.

    A callback may end training by raising: the network then has the weights of the iterations
    done. With a checkpoint, however training was interrupted, the same call with the same
    initial weights goes on from what was saved last, and ends with the bits of training that
    was never interrupted.

    Args:
        network: the VR function; training starts from its present weights, on its device.
        problem: the demonstrations.
        features: ``[n_states, n_features]``.
        config: how to train.
        rng: draws the batches of the Bellman term, and nothing else.
        callback: called after each step with the iterations done and the mean
            log-likelihood before that step; the network may be read meanwhile. Iterations that
            a checkpoint already holds are not told again.
        bellman: the penalty's states; required if ``config.bellman_weight`` is above 0. It and
            the problem are cautious if ``config`` is.
        checkpoint: where to save training, and to take it up again; nowhere if absent.

    Raises:
        InputError: if the Bellman term is missing, training diverges, or the checkpoint is
            damaged or belongs to other training.
        OSError: if the checkpoint cannot be written.
    """
    if config.bellman_weight > 0 and bellman is None:
        raise InputError("bellman_weight: above 0 needs a Bellman term (transition model, gamma)")
    if config.bellman_weight == 0:
        bellman = None
    x = torch.as_tensor(features, dtype=torch.float32)
    # On all states the penalty needs f wherever the likelihood does: once is then enough.
    whole = None if bellman is None else bellman.whole
    states = problem.states if whole is None else whole.states
    at, asked = _At(network, x, states), np.searchsorted(states, problem.states)
    state = _State(network, config, rng)
    identity: dict[str, Any] = {}
    if checkpoint is not None:
        identity = _identity(network, problem, x, config, rng, bellman)
        state.take_up(checkpoint.path, identity)
    resumed_from = state.done
    scalars_too = config.learn_beta or config.learn_caution or bellman is not None
    while state.done < config.iterations and not state.settled(config.tolerance):
        size = config.step_after(state.done)
        beta = math.exp(state.scalars[0].item())
        f = at.forward(state.caution)
        value, df, dbeta = problem.value_and_gradient(f[asked], beta)
        if not math.isfinite(value):
            raise InputError(
                f"step: training diverged at iteration {state.done}; choose a smaller step"
            )
        gradient_scalars = torch.zeros_like(state.scalars)
        if config.learn_beta:
            gradient_scalars[0] = beta * dbeta
        if bellman is None:
            gradient, dcaution = at.backward(df)
        else:
            batch, weight = bellman.draw(rng), config.bellman_weight
            at_batch = at if batch is whole else _At(network, x, batch.states)
            f_batch = f if batch is whole else at_batch.forward(state.caution)
            if state.done == 0:  # begin where the penalty, nearly an absolute value, is least
                state.scalars[1] = float(np.median(batch.rewards(f_batch)))
            _, penalty, dreward = batch.value_and_gradient(f_batch, state.scalars[1].item())
            gradient_scalars[1] = -weight * dreward
            if batch is whole:
                penalty *= -weight
                penalty[asked] += df
                gradient, dcaution = at.backward(penalty)
            else:
                gradient, dcaution = at.backward(df)
                dpenalty, more = at_batch.backward(penalty)
                gradient -= weight * dpenalty
                dcaution -= weight * more
        if config.learn_caution:
            gradient_scalars[2] = PACE * dcaution
        state.ascend.step(gradient, size)
        if scalars_too:
            state.ascend_scalars.step(gradient_scalars, size)
        state.log_likelihood[state.done] = value
        state.done += 1
        if checkpoint is not None and state.done % checkpoint.every == 0:
            state.save(checkpoint.path, identity)
        if callback is not None:
            callback(state.done, value)
    if checkpoint is not None and state.done > resumed_from:
        state.save(checkpoint.path, identity)
    return state.outcome(config.tolerance)


class _At:
    """f at fixed states, the last of which may be the pseudo-state of `irl.neighbourhood`."""

    def __init__(self, network: VRFunction, x: torch.Tensor, states: np.ndarray) -> None:
        self._n = states.size - int(states[-1] == len(x))
        self._f = np.empty(states.size)
        self._evaluation = network.at(x[torch.from_numpy(states[: self._n])])

    def forward(self, caution: float) -> np.ndarray:
        """F of the states, the pseudo-state's being −caution; overwritten by the next call."""
        self._f[: self._n] = self._evaluation.forward().cpu().numpy()
        self._f[self._n :] = -caution
        return self._f

    def backward(self, df: np.ndarray) -> tuple[torch.Tensor, float]:
        """Gradients of Σ df·f in the weights (a buffer), and in the caution."""
        gradient = self._evaluation.backward(torch.from_numpy(df[: self._n]))
        return gradient, -float(df[self._n :].sum())


def _identity(
    network: VRFunction,
    problem: LikelihoodProblem,
    features: torch.Tensor,
    config: TrainingConfig,
    rng: np.random.Generator,
    bellman: BellmanTerm | None,
) -> dict[str, Any]:
    """What tells this training from any other, before it begins: see ``irl.checkpoint``."""
    return {
        **{f"config.{name}": value for name, value in asdict(config).items()},
        "bellman": None if bellman is None else bellman.fingerprint(),
        "demonstrations": problem.fingerprint(),
        "device": network.parameters.device.type,
        "features": fingerprint(features.cpu().numpy()),
        "initial_weights": fingerprint(*network.arrays().values()),
        "rng": rng_state(rng),
    }
