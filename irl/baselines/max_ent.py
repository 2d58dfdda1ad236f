"""Maximum causal entropy inverse reinforcement learning, Ziebart et al. (2008, 2010).

Among all behaviours that meet the demonstrated features as often as the demonstrator did, the
least committed one is soft-optimal under a reward R = Φ ω (3.10) earned on entering a state: with
f = R + γ V (3.15) it takes a with probability exp(Q(s, a) − V(s)), Q = P f, V being the log-sum-exp
of Q. The dual of that problem is, chance averaged, the causally conditioned likelihood of what was
demonstrated, Σ log π(a | s) (Ziebart 2010; Gleave & Toyer 2022, arXiv:2203.11409), which is climbed
here from R = 0. So the discount means one thing: values are learnt by it as they are planned by it.
The rest of a run being a run of the same behaviour, every choice counts alike, early or late.

Such behaviour is stationary, with any number of moves to go, and so the length of a run says
nothing. In a terminal state, without actions or with one alone that stays, there is nothing to
choose and the log-likelihood is 0. So a run whose length was an outcome of chance teaches the same
cut at its end or padded there, and the state that it ended in need not be known. A run cut
elsewhere, for want of time or at a gap, is taken to go on as the behaviour does.
"""

from dataclasses import dataclass

import numpy as np

from irl.baselines.ascent import Callback, RidgeConfig, ridge_ascend
from irl.baselines.differentiable_planning import SoftMax
from irl.baselines.features import Features, reward_features
from irl.baselines.planned_likelihood import PlannedLikelihood
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.mdp import TransitionModel


def max_ent(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray | None = None,
    *,
    gamma: float,
    config: RidgeConfig | None = None,
    callback: Callback | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Find the reward whose soft-optimal behaviour goes where the demonstrations go.

    Args:
        model: the transition model.
        demonstrations: trajectories, whole or in pieces.
        features: Φ, ``[n_states, d]``, or of pairs ``[n_states, n_actions, d]``; one indicator
            per state if absent.
        gamma: discount factor in [0, 1).
        config: the price of |ω|² / 2, and when the ascent ends.
        callback: follows the ascent, an iteration at a time.

    Returns:
        R ``[n_states]``, or ``[n_pairs]``, earned by acting, in units of the demonstrator's
        temperature, and ω ``[d]``.

    Raises:
        InputError: as ``FeatureMatching.build``.
    """
    problem = FeatureMatching.build(model, demonstrations, features, gamma=gamma)
    start = np.zeros(problem.features.shape[1])
    config = config or RidgeConfig()
    weights = ridge_ascend(problem.value_and_gradient, start, config, callback=callback)
    return problem.features @ weights, weights


@dataclass(frozen=True)
class FeatureMatching:
    """Demonstrations, prepared for many evaluations.

    Attributes:
        likelihood: of a pair, in the mean.
        features: Φ, float64 ``[n_states, d]``, or of pairs ``[n_pairs, d]``.
        pairs_each: pairs of a trajectory, in the mean.
    """

    likelihood: PlannedLikelihood
    features: Features
    pairs_each: float

    @classmethod
    def build(
        cls,
        model: TransitionModel,
        demonstrations: Demonstrations,
        features: np.ndarray | None = None,
        *,
        gamma: float,
    ) -> "FeatureMatching":
        """Count what was demonstrated; arguments as for ``max_ent``.

        Raises:
            InputError: if there is no demonstration, a pair is infeasible or a move impossible,
                gamma is outside [0, 1), or the features are not finite or have a wrong shape.
        """
        phi, of_pairs = reward_features(model, features)
        if len(demonstrations) == 0:
            raise InputError("demonstrations: at least one (state, action) pair is needed")
        demonstrations.check(model, "demonstrations")
        likelihood = PlannedLikelihood.build(model, demonstrations, gamma, SoftMax(), 1.0, of_pairs)
        trajectories = np.unique(demonstrations.trajectory).size
        return cls(likelihood, phi, likelihood.problem.total / trajectories)

    def value_and_gradient(self, weights: np.ndarray) -> tuple[float, np.ndarray]:
        """Entropy's dual, as ``value_and_surplus`` for R = Φ ω.

        Args:
            weights: ω, ``[d]``.

        Returns:
            The value, and its gradient ``[d]``: demonstrated less expected feature counts.
        """
        value, surplus = self.value_and_surplus(self.features @ weights)
        return value, self.features.T @ surplus

    def value_and_surplus(self, reward: np.ndarray) -> tuple[float, np.ndarray]:
        """Entropy's dual for any reward: the mean log-likelihood of a trajectory's choices.

        Args:
            reward: R, ``[n_states]``, earned on entering a state, or ``[n_pairs]``, by acting, as
                the features are of states or of pairs.

        Returns:
            The value (≤ 0), and its gradient, as many: how much more often each state is entered,
            or each pair chosen, discounted, after the demonstrated actions than after the
            behaviour's own in the same states. Where a trajectory leads is the model's chance in
            both, not what came about.
        """
        value, surplus = self.likelihood.value_and_gradient(reward)
        return self.pairs_each * value, self.pairs_each * surplus
