"""Maximum-likelihood inverse reinforcement learning with a linear reward: thesis (3.13), (3.14).

The demonstrator is taken to choose a in s with probability proportional to exp(β Q*(s, a))
among the feasible actions, Q* being optimal for R = Φ ω (3.10), earned on entering a state.

The gradient follows the greedy policy: see ``irl.baselines.differentiable_planning``. Where that
policy is not unique, f has a kink and this is one of its subgradients.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from irl.baselines.ascent import AscentConfig, Callback
from irl.baselines.differentiable_planning import HardMax, Maximum
from irl.baselines.features import reward_features
from irl.baselines.planned_likelihood import PlannedLikelihood
from irl.choices import Limits
from irl.demonstrations import Demonstrations
from irl.mdp import TransitionModel


@dataclass(frozen=True)
class MlirlConfig(AscentConfig):
    """How to climb the likelihood of Boltzmann choices."""

    beta: Annotated[float, Limits(0, 1e9, open_low=True)] = 1.0
    """Inverse temperature β of the demonstrator, in 1 / unit of reward."""

    @property
    def maximum(self) -> Maximum:
        """What a state is worth, of its actions' values."""
        return HardMax()


def linear_mlirl(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray | None = None,
    *,
    gamma: float,
    config: MlirlConfig | None = None,
    callback: Callback | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Climb (3.14) from ω = 0; the rate α doubles after a gain and halves without one.

    Flawless demonstrations have no likeliest ω: the longer the ascent, the larger ω. Then the
    tolerance decides how far it goes.

    Args:
        model: the transition model.
        demonstrations: labelled pairs, in any order.
        features: Φ, ``[n_states, d]``, or of pairs ``[n_states, n_actions, d]``; one indicator
            per state if absent.
        gamma: discount factor in [0, 1).
        config: β, when the ascent ends, and in ``irl.baselines.bellman_gradient`` the maximum.
        callback: follows the ascent.

    Returns:
        R ``[n_states]``, earned on entering a state, or ``[n_pairs]``, earned by acting, and ω
        ``[d]``.

    Raises:
        InputError: if there is no demonstration, a pair is infeasible, a number is out of range,
            or the features are not finite or have a wrong shape.
    """
    phi, of_pairs = reward_features(model, features)
    config = config or MlirlConfig()
    likelihood = PlannedLikelihood.build(
        model, demonstrations, gamma, config.maximum, config.beta, of_pairs
    )
    return likelihood.climb(phi, config, callback)
