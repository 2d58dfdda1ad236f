"""Inverse reinforcement learning from demonstrations and action preferences, and what to ask next.

After ADVISE, Odom & Natarajan (2016, "Active Advice Seeking for Inverse Reinforcement
Learning"): learn, ask an expert which actions to prefer and to avoid in the cluster that is least
certain, learn again with the answer. Theirs learns by the linear program (3.9); this one asks the
same of a likelihood. An advised state is a demonstration of which only a set of actions is known,
those that the advice leaves, so that

    L(R) = mean of log π(a | s) over demonstrations + λ · mean of log π(A_s | s) over advised states

under the soft-optimal policy π of ``irl.baselines.sparse_planning``, with its price on Σ |R|. As
the policy is planned for, advice about some states tells something of the others.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy import sparse

from irl.advice import Advice
from irl.baselines.ascent import sparse_ascend
from irl.baselines.differentiable_planning import SoftMax
from irl.baselines.planned_likelihood import PlannedLikelihood
from irl.baselines.sparse_planning import SparseConfig
from irl.choices import Limits, check_range
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.experts import ClusterAdvice
from irl.groups import Groups
from irl.mdp import TransitionModel
from irl.uncertainty import entropy, shannon_entropy


@dataclass(frozen=True)
class AdviceConfig(SparseConfig):
    """What advice counts, what a reward costs, and when the ascent ends."""

    tolerance: Annotated[float, Limits(0)] = 1e-4
    max_iterations: Annotated[int, Limits(0)] = 200
    advice_weight: Annotated[float, Limits(0)] = 1.0
    """λ, what all advice counts against all demonstrations."""


@dataclass(frozen=True)
class Result:
    """What was learnt.

    Attributes:
        reward: R, float64 ``[n_states]``, earned on entering a state, in units of the
            demonstrator's temperature; a start for learning on with more advice.
        q: soft-optimal Q ``[n_states, n_actions]``, −∞ where infeasible: π(a | s) ∝ exp Q.
        log_likelihood: L, without the price.
        iterations: evaluations of the objective.
    """

    reward: np.ndarray
    q: np.ndarray
    log_likelihood: float
    iterations: int


def learn(
    model: TransitionModel,
    demonstrations: Demonstrations,
    advice: Advice,
    *,
    gamma: float,
    config: AdviceConfig | None = None,
    start: np.ndarray | None = None,
) -> Result:
    """Find the sparse reward that best explains demonstrations and advice together.

    Args:
        model: the transition model.
        demonstrations: labelled pairs, in any order.
        advice: preferred and avoided actions by state; ``Advice.none`` for demonstrations alone.
        gamma: discount factor in [0, 1).
        config: λ, the price of rewards, and when the ascent ends.
        start: R ``[n_states]`` to begin at, such as the last result's; 0 if absent.

    Raises:
        InputError: if there is no demonstration, a pair is infeasible, gamma is out of range, or
            the advice is for another model.
    """
    config = config or AdviceConfig()
    likelihood = PlannedLikelihood.build(model, demonstrations, gamma, SoftMax(), beta=1.0)
    advised = AdviceLikelihood.build(model, advice)

    def objective(reward: np.ndarray) -> tuple[float, np.ndarray]:
        f = likelihood.planner.solve(reward)
        value, g = likelihood.of_values(f)
        more, g_advice = advised.of_values(f)
        pulled = likelihood.planner.pull(g + config.advice_weight * g_advice)
        return value + config.advice_weight * more, pulled

    zero = np.zeros(model.n_states)
    begin = zero if start is None else np.asarray(start, dtype=np.float64)
    answer, l1 = sparse_ascend(objective, begin, config.sparsity, config)
    q = model.q_values(likelihood.planner.solve(answer.x))
    value = answer.value + l1 * np.abs(answer.x).sum()
    return Result(answer.x, q, float(value), answer.iterations)


@dataclass(frozen=True)
class AdviceLikelihood:
    """Advice, prepared for many evaluations: groups of pairs of the states it says something of.

    Attributes:
        P: of the feasible pairs of those states, ``[n, n_states]``.
        left: bool ``[n]``, whether the advice leaves the pair.
        groups: those pairs by state.
    """

    P: sparse.csr_matrix
    left: np.ndarray
    groups: Groups

    @classmethod
    def build(cls, model: TransitionModel, advice: Advice) -> "AdviceLikelihood":
        """Find what the advice leaves of each state's feasible actions.

        That is the preferred actions, or where none is feasible, all but the avoided ones. A
        state in which that is all or nothing is passed over: nothing, since advice is given for a
        cluster and not for each of its states.

        Raises:
            InputError: if the advice is for another number of states or actions.
        """
        if advice.preferred.shape != model.mask.shape:
            raise InputError(
                f"advice: {list(model.mask.shape)} states and actions wanted, "
                f"got {list(advice.preferred.shape)}"
            )
        preferred = advice.preferred & model.mask
        left = np.where(preferred.any(axis=1, keepdims=True), preferred, ~advice.avoided)
        left &= model.mask
        telling = left.any(axis=1) & (left != model.mask).any(axis=1)
        rows = np.flatnonzero(telling[model.pair_state])
        state = model.pair_state[rows]
        return cls(model.P[rows], left[state, model.pair_action[rows]], Groups.of_sorted(state))

    def of_values(self, f: np.ndarray) -> tuple[float, np.ndarray]:
        """Mean of log π(A_s | s), π ∝ exp(P f), and its gradient in f ``[n_states]``.

        Without advice both are 0.
        """
        groups = self.groups
        if not len(groups):
            return 0.0, np.zeros(f.size)
        log_pi = groups.log_softmax(self.P @ f)
        within = np.where(self.left, log_pi, -np.inf)
        log_left = groups.log_sum_exp(within)
        slope = np.exp(within - groups.spread(log_left)) - np.exp(log_pi)
        return float(log_left.mean()), self.P.T @ slope / len(groups)


def uncertainty(
    model: TransitionModel,
    demonstrations: Demonstrations,
    q: np.ndarray,
    demonstration_weight: float = 0.5,
) -> np.ndarray:
    """U(s) = w F(s) + (1 − w) G(s), Odom & Natarajan's measure, in nats.

    F is the entropy of the demonstrated actions, one pseudo-count for each feasible one, so that
    a state never shown is as uncertain as can be. G is the entropy of the policy learnt, which
    advice has moved.

    Args:
        model: the transition model.
        demonstrations: labelled pairs.
        q: as ``Result.q``.
        demonstration_weight: w, in 0…1.

    Returns:
        float64 ``[n_states]``, 0 where at most one action is feasible.

    Raises:
        InputError: if the weight is out of range.
    """
    check_range("demonstration_weight", demonstration_weight, 0.0, 1.0)
    shown = model.mask.astype(np.float64)
    labels = demonstrations.counted
    shown[labels.state, labels.action] += labels.count
    frequency = shown / np.maximum(shown.sum(axis=1, keepdims=True), 1.0)
    return demonstration_weight * shannon_entropy(frequency) + (1 - demonstration_weight) * entropy(
        np.where(model.mask, q, -np.inf)
    )


class AdvisedLearner:
    """Learns anew after each answer, beginning at the reward learnt before it.

    Attributes:
        result: what is known by now.
        advice: all answers so far.
    """

    def __init__(
        self,
        model: TransitionModel,
        demonstrations: Demonstrations,
        *,
        gamma: float,
        config: AdviceConfig | None = None,
    ) -> None:
        """Learn from the demonstrations alone; arguments and errors as for ``learn``."""
        self._model, self._demonstrations = model, demonstrations
        self._gamma, self._config = gamma, config
        self.advice = Advice.none(model.n_states, model.n_actions)
        self._learn(None)

    def _learn(self, start: np.ndarray | None) -> None:
        self.result = learn(
            self._model,
            self._demonstrations,
            self.advice,
            gamma=self._gamma,
            config=self._config,
            start=start,
        )

    def take(self, states: np.ndarray, answer: ClusterAdvice) -> None:
        """Take in one more answer about a cluster of states."""
        self.advice = self.advice.add(states, answer.preferred, answer.avoided)
        self._learn(self.result.reward)

    @property
    def policy(self) -> np.ndarray:
        """The best action of every state, int64 ``[n_states]``."""
        return self.result.q.argmax(axis=1)

    @property
    def uncertainty(self) -> np.ndarray:
        """Odom & Natarajan's measure of every state, in nats, ``[n_states]``."""
        return uncertainty(self._model, self._demonstrations, self.result.q)
