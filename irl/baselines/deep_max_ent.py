"""Maximum entropy deep inverse reinforcement learning, Wulfmeier et al. (2015).

The reward is a neural network of the features of a state, or of a pair of state and action,
R = r_max · tanh(g(φ)). By the chain rule
the gradient of the maximum entropy objective in its weights is the difference between demonstrated
and expected state visits, see ``irl.baselines.max_ent`` (which says too what becomes of the ends of
runs), carried back through the network.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import torch

from irl.baselines.ascent import Callback
from irl.baselines.max_ent import FeatureMatching
from irl.choices import Limits, Settings
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.optimizers import Adam
from irl.vr_function import WIDEST, Evaluation, VRFunction, torch_generator


@dataclass(frozen=True)
class DeepMaxEntConfig(Settings):
    """The reward network, and how it is trained."""

    hidden: Annotated[tuple[int, ...], Limits(1, WIDEST)] = (32, 32)
    """Widths of the hidden layers."""
    r_max: Annotated[float, Limits(0, 1e9, open_low=True)] = 10.0
    """Largest |R(s)|, in units of the demonstrator's temperature."""
    iterations: Annotated[int, Limits(0, 10_000_000)] = 300
    """Steps to take."""
    step: Annotated[float, Limits(0, 1e6, open_low=True)] = 0.01
    """Adam's first step, which decays linearly to 0."""
    weight_decay: Annotated[float, Limits(0, 1e6)] = 0.0
    """Shrinkage of the weights per unit of step."""


def deep_max_ent(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray,
    *,
    gamma: float,
    rng: np.random.Generator,
    config: DeepMaxEntConfig | None = None,
    callback: Callback | None = None,
) -> tuple[np.ndarray, VRFunction]:
    """Train a reward network by Adam, the step decaying linearly to 0.

    Args:
        model: the transition model.
        demonstrations: trajectories, whole or in pieces.
        features: the network's input, ``[n_states, d]``, or of pairs ``[n_states, n_actions, d]``,
            best of a size near 1.
        gamma: discount factor in [0, 1).
        rng: draws the initial weights.
        config: the network, and how it is trained.
        callback: told after each step how many there were, and the objective before it.

    Returns:
        R ``[n_states]``, earned on entering a state, or ``[n_pairs]``, earned by acting, and the
        network, whose output is R / r_max.

    Raises:
        InputError: as ``FeatureMatching.build``, or if there are no features.
    """
    config = config or DeepMaxEntConfig()
    problem = RewardNetwork.build(model, demonstrations, features, config, gamma=gamma, rng=rng)
    ascent = Adam(problem.network.parameters, config.weight_decay)
    for k in range(config.iterations):
        value, gradient = problem.value_and_gradient()
        ascent.step(gradient, config.step * (1 - k / config.iterations))
        if callback is not None:
            callback(k + 1, value)
    return problem.reward(), problem.network


@dataclass(frozen=True)
class RewardNetwork:
    """A reward network and the demonstrations it is to explain, prepared for many steps.

    Attributes:
        matching: the demonstrations.
        network: its output is R / r_max.
        at: the network at every state, or every pair.
        r_max: largest |R(s)|.
    """

    matching: FeatureMatching
    network: VRFunction
    at: Evaluation
    r_max: float

    @classmethod
    def build(
        cls,
        model: TransitionModel,
        demonstrations: Demonstrations,
        features: np.ndarray,
        config: DeepMaxEntConfig,
        *,
        gamma: float,
        rng: np.random.Generator,
    ) -> "RewardNetwork":
        """Draw the initial weights; arguments and errors as for ``deep_max_ent``."""
        if features is None:
            raise InputError("features: the network's input is needed, [n_states, d]")
        matching = FeatureMatching.build(model, demonstrations, features, gamma=gamma)
        x = np.asarray(matching.features, dtype=np.float32)
        network = VRFunction(x.shape[1], config.hidden, generator=torch_generator(rng))
        return cls(matching, network, network.at(x), config.r_max)

    def reward(self) -> np.ndarray:
        """R with the network's present weights, float64, of every state or every pair."""
        return self.r_max * self.at.forward().double().numpy()

    def value_and_gradient(self) -> tuple[float, torch.Tensor]:
        """The maximum entropy objective, and its gradient in the weights ``[n_parameters]``.

        The gradient is a buffer that the next call overwrites.
        """
        value, surplus = self.matching.value_and_surplus(self.reward())
        return value, self.at.backward(torch.from_numpy(self.r_max * surplus))
