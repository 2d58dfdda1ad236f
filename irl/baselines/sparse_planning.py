"""The method ``planning``: a sparse reward, most likely under its soft-optimal policy, is learnt.

``irl.planning`` plans for rewards that are known.

The demonstrator is taken to choose a in s with probability exp(Q(s, a) − V(s)), where V is the
log-sum-exp of Q (soft value iteration, discounted; Ziebart 2010, Haarnoja et al. 2017) and the
reward is measured in units of the demonstrator's temperature. Most tasks pay in few states, so
Σ |R(s)| has a price: every state that none of the demonstrations needs then pays exactly 0, and
what few do pay draws the plan towards them from everywhere, demonstrated or not.

The gradient is that of the fixed point itself, by one linear system (see
``irl.baselines.differentiable_planning``), and the ascent is proximal.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from irl.baselines.ascent import AscentConfig, Callback, sparse_ascend
from irl.baselines.differentiable_planning import Planner, SoftMax
from irl.baselines.features import reward_features
from irl.baselines.planned_likelihood import PlannedLikelihood
from irl.baselines.pruned_rewards import pruned
from irl.choices import Limits
from irl.demonstrations import Demonstrations
from irl.likelihood import LikelihoodProblem
from irl.mdp import TransitionModel

_TOLERANCE = 1e-6
"""Largest error of a plan's values, in units of the temperature: an ascent needs no more."""


@dataclass(frozen=True)
class SparseConfig(AscentConfig):
    """What a reward costs, and when the ascent ends."""

    tolerance: Annotated[float, Limits(0)] = 1e-5
    max_iterations: Annotated[int, Limits(0, 1_000_000_000)] = 300
    sparsity: Annotated[float, Limits(0, 1)] = 0.05
    """Price of Σ |ω| as a share of the price above which ω = 0 would be best, from 0, which is
    free, to 1. Flawless demonstrations have no likeliest ω without a price."""
    prune: bool = True
    """Whether only rewards are kept that lead to where runs ended, or, if nobody says where, the
    large ones, if these explain as many labels (`irl.baselines.pruned_rewards`). With features
    none are left out."""


def sparse_planning(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray | None = None,
    *,
    gamma: float,
    config: SparseConfig | None = None,
    callback: Callback | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Find the sparse reward under which soft planning best explains the demonstrations.

    Args:
        model: the transition model.
        demonstrations: labelled pairs, in any order.
        features: Φ of R = Φ ω (3.10), ``[n_states, d]``, or of pairs ``[n_states, n_actions, d]``;
            one indicator per state if absent.
        gamma: discount factor in [0, 1).
        config: the price of rewards, and when the ascent ends.
        callback: follows the ascent.

    Returns:
        R ``[n_states]``, earned on entering a state, or ``[n_pairs]``, earned by acting, in units
        of the demonstrator's temperature, and ω ``[d]``.

    Raises:
        InputError: if there is no demonstration, a pair is infeasible, a number is out of range,
            or the features are not finite or have a wrong shape.
    """
    config = config or SparseConfig()
    phi, of_pairs = reward_features(model, features)
    planner = Planner(model, gamma, SoftMax(), tolerance=_TOLERANCE, of_pairs=of_pairs)
    likelihood = PlannedLikelihood.over(
        LikelihoodProblem.of(model, demonstrations), planner, beta=1.0
    )

    def objective(weights: np.ndarray) -> tuple[float, np.ndarray]:
        return likelihood.in_weights(phi, weights)

    answer, _ = sparse_ascend(objective, np.zeros(phi.shape[1]), config.sparsity, config, callback)
    if config.prune and features is None:
        few = pruned(model, demonstrations, answer.x, gamma)
        return few, few
    return phi @ answer.x, answer.x
