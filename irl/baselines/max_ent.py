"""Maximum causal entropy inverse reinforcement learning, Ziebart et al. (2008, 2010).

Among all behaviours that meet the demonstrated features as often as the demonstrator did, the
least committed one walks softly, see ``irl.baselines.soft_walks``, under a reward R = Φ ω (3.10)
earned on entering a state. Each demonstration is compared with soft walks of its own start and
length, so nothing needs to be known about where a task ends.

On models without chance the objective is the mean log-likelihood of the trajectories.
"""

from dataclasses import dataclass

import numpy as np

from irl.baselines.ascent import RidgeConfig, ridge_ascend
from irl.baselines.features import Features, state_features
from irl.baselines.soft_walks import SoftWalks
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.mdp import TransitionModel


def max_ent(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray | None = None,
    *,
    config: RidgeConfig | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Find the reward whose soft walks enter the states that the demonstrations enter.

    Args:
        model: the transition model.
        demonstrations: trajectories without gaps; one pair alone is a trajectory of one move.
        features: Φ, ``[n_states, d]``; one indicator per state if absent.
        config: the price of |ω|² / 2, and when the ascent ends.

    Returns:
        R ``[n_states]``, in units of the demonstrator's temperature, and ω ``[d]``.

    Raises:
        InputError: as ``FeatureMatching.build``.
    """
    problem = FeatureMatching.build(model, demonstrations, features)
    start = np.zeros(problem.features.shape[1])
    weights = ridge_ascend(problem.value_and_gradient, start, config or RidgeConfig())
    return problem.features @ weights, weights


@dataclass(frozen=True)
class FeatureMatching:
    """Demonstrations, prepared for many evaluations.

    Attributes:
        walks: the transition model, prepared.
        features: Φ, float64 ``[n_states, d]``.
        starts: float64 ``[horizon + 1, n_states]``: the share of trajectories that have k moves
            in all and begin in s; sums to 1.
        demonstrated: float64 ``[n_states]``: how often a trajectory enters each state. A move
            counts for all its successors by their probability, whichever came about.
    """

    walks: SoftWalks
    features: Features
    starts: np.ndarray
    demonstrated: np.ndarray

    @classmethod
    def build(
        cls,
        model: TransitionModel,
        demonstrations: Demonstrations,
        features: np.ndarray | None = None,
    ) -> "FeatureMatching":
        """Count what the demonstrations enter; arguments as for ``max_ent``.

        Raises:
            InputError: if there is no demonstration, a pair is infeasible, a trajectory's steps
                are not consecutive (as with generalised pairs, which are not walks), or the
                features are not finite or have a wrong shape.
        """
        phi = state_features(model, features)
        if len(demonstrations) == 0:
            raise InputError("demonstrations: at least one (state, action) pair is needed")
        demonstrations.check(model, "demonstrations")
        walks = demonstrations.select(np.lexsort((demonstrations.step, demonstrations.trajectory)))
        names, first, length = np.unique(walks.trajectory, return_index=True, return_counts=True)
        place = np.arange(len(walks)) - np.repeat(first, length)
        odd = walks.step - np.repeat(walks.step[first], length) != place
        for name in walks.trajectory[odd][:1]:
            raise InputError(f"demonstrations: the steps of trajectory {name} are not consecutive")
        starts = np.zeros((length.max() + 1, model.n_states))
        np.add.at(starts, (length, walks.state[first]), 1 / names.size)
        rows = model.pair_index(walks.state, walks.action)
        count = np.bincount(rows, minlength=model.n_pairs) / names.size
        return cls(SoftWalks(model), phi, starts, model.P.T @ count)

    def value_and_gradient(self, weights: np.ndarray) -> tuple[float, np.ndarray]:
        """Entropy's dual, concave in ω, as ``value_and_surplus`` for R = Φ ω.

        Args:
            weights: ω, ``[d]``.

        Returns:
            The value, and its gradient ``[d]``: demonstrated less expected feature counts.
        """
        value, surplus = self.value_and_surplus(self.features @ weights)
        return value, self.features.T @ surplus

    def value_and_surplus(self, state_reward: np.ndarray) -> tuple[float, np.ndarray]:
        """Entropy's dual for any reward: demonstrated reward less the starts' soft value.

        Args:
            state_reward: R, ``[n_states]``, earned on entering a state.

        Returns:
            The value (≤ 0 on models without chance), and its gradient ``[n_states]``: how much
            more often the demonstrations enter each state than the soft walks do.
        """
        policy, V = self.walks.backward(state_reward, len(self.starts) - 1)
        value = self.demonstrated @ state_reward - np.vdot(self.starts, V)
        return float(value), self.demonstrated - self.walks.entries(policy, self.starts)
