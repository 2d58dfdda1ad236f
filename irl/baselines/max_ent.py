"""Maximum causal entropy inverse reinforcement learning, Ziebart et al. (2008, 2010).

Among all behaviours that meet the demonstrated features as often as the demonstrator did, the
least committed one acts softly: with k moves to go it takes a with probability
exp(Q_k(s, a) − V_k(s)), where Q_k = P (R + V_{k−1}) as in (3.2) without discount and V_k is the
log-sum-exp of Q_k instead of its maximum. The reward R = Φ ω (3.10) is earned on entering a
state. Each demonstration is compared with soft walks of its own start and length, so nothing
needs to be known about where a task ends.

On models without chance the objective is the mean log-likelihood of the trajectories.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from irl.baselines.features import Features, state_features
from irl.baselines.softmax import acting_states, log_sum_exp
from irl.choices import check_range
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.mdp import TransitionModel


def max_ent(
    model: TransitionModel,
    demonstrations: Demonstrations,
    features: np.ndarray | None = None,
    *,
    l2: float = 1e-3,
    tolerance: float = 1e-6,
    max_iterations: int = 1000,
) -> tuple[np.ndarray, np.ndarray]:
    """Find the reward whose soft walks enter the states that the demonstrations enter.

    Args:
        model: the transition model.
        demonstrations: trajectories without gaps; one pair alone is a trajectory of one move.
        features: Φ, ``[n_states, d]``; one indicator per state if absent.
        l2: price of |ω|² / 2, from 0. Above 0 the solution is unique and finite, which flawless
            demonstrations would else push to infinity.
        tolerance: largest gradient entry at which the ascent ends.
        max_iterations: the ascent ends there in any case.

    Returns:
        R ``[n_states]``, in units of the demonstrator's temperature, and ω ``[d]``.

    Raises:
        InputError: as ``FeatureMatching.build``, or if ``l2`` is below 0.
    """
    check_range("l2", l2, 0.0)
    problem = FeatureMatching.build(model, demonstrations, features)

    def loss(weights: np.ndarray) -> tuple[float, np.ndarray]:
        value, gradient = problem.value_and_gradient(weights)
        return l2 / 2 * (weights @ weights) - value, l2 * weights - gradient

    answer = minimize(
        loss,
        np.zeros(problem.features.shape[1]),
        jac=True,
        method="L-BFGS-B",
        options={"gtol": tolerance, "ftol": 0.0, "maxiter": max_iterations},
    )
    return problem.features @ answer.x, answer.x


@dataclass(frozen=True)
class FeatureMatching:
    """Demonstrations, prepared for many evaluations.

    Attributes:
        model: the transition model.
        features: Φ, float64 ``[n_states, d]``.
        starts: float64 ``[horizon + 1, n_states]``: the share of trajectories that have k moves
            in all and begin in s; sums to 1.
        demonstrated: float64 ``[n_states]``: how often a trajectory enters each state. A move
            counts for all its successors by their probability, whichever came about.
    """

    model: TransitionModel
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
                are not consecutive (as with generalised pairs, which are no walks), or the
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
        return cls(model, phi, starts, model.P.T @ count)

    def value_and_gradient(self, weights: np.ndarray) -> tuple[float, np.ndarray]:
        """Entropy's dual, concave in ω: demonstrated reward less the starts' soft value.

        Args:
            weights: ω, ``[d]``.

        Returns:
            The value (≤ 0 on models without chance), and its gradient ``[d]``: demonstrated
            less expected feature counts per trajectory.
        """
        reward = self.features @ weights
        policy, V = soft_value_iteration(self.model, reward, len(self.starts) - 1)
        surplus = self.demonstrated - expected_entries(self.model, policy, self.starts)
        value = self.demonstrated @ reward - (self.starts * V).sum()
        return float(value), self.features.T @ surplus


def soft_value_iteration(
    model: TransitionModel, state_reward: np.ndarray, horizon: int
) -> tuple[np.ndarray, np.ndarray]:
    """Soft values and choices with 0…horizon moves to go, backwards from the end.

    Args:
        model: the transition model.
        state_reward: R, ``[n_states]``, earned on entering a state.
        horizon: largest number of moves.

    Returns:
        Probabilities ``[horizon, n_pairs]``, row k − 1 for k moves to go, and V
        ``[horizon + 1, n_states]``, 0 with no move to go and in states without actions.
    """
    states, first, segment = acting_states(model)
    policy = np.empty((horizon, model.n_pairs))
    V = np.zeros((horizon + 1, model.n_states))
    for k in range(1, horizon + 1):
        q = model.P @ (state_reward + V[k - 1])
        v = log_sum_exp(q, first, segment)
        V[k, states] = v
        policy[k - 1] = np.exp(q - v[segment])
    return policy, V


def expected_entries(model: TransitionModel, policy: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """How often each state is entered in expectation, forwards from the starts.

    Args:
        model: the transition model.
        policy: as ``soft_value_iteration`` returns it, ``[horizon, n_pairs]``.
        starts: ``[horizon + 1, n_states]``, what begins in s with k moves to go.

    Returns:
        float64 ``[n_states]``; the start itself is not an entry.
    """
    onward = model.P.T
    entries = np.zeros(model.n_states)
    entered = np.zeros(model.n_states)
    for k in range(len(policy), 0, -1):
        present = starts[k] + entered
        entered = onward @ (present[model.pair_state] * policy[k - 1])
        entries += entered
    return entries
