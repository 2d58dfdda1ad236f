"""What a belief predicts: action values, and how well acting by them is going to do.

Predictions are the learner's own. They are right if the truth is among the hypotheses, so they are
to be read beside `ends_agree`, which needs no such faith.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from irl.groups import Groups
from irl.mdp import TransitionModel
from irl.planning import transition_matrix
from irl.posterior.belief import Belief
from irl.posterior.evidence import ALIKE

HORIZON = 20
"""Actions within which a run is to end."""
_CHUNK = 8


def action_values(belief: Belief, leaning: float = 0.0) -> np.ndarray:
    """Mean values of the posterior, float64 ``[n_states, n_actions]``; −∞ where infeasible.

    Args:
        belief: what is believed.
        leaning: how much more what states are worth counts, beside what actions cost.
    """
    chosen, weight = belief.likely()
    f = (belief.f[:, chosen].astype(np.float64) @ weight)[:, None]
    sizes = (belief.sizes(belief.level[chosen]) @ weight)[:, None]
    q = belief.plans.model.P @ f - belief.plans.costs @ sizes / (1.0 + leaning)
    return belief.plans.model.table(q[:, 0])


def votes(belief: Belief, states: np.ndarray, action: np.ndarray) -> np.ndarray:
    """Probability that an action is as good as the best of its state; float64 ``[n]``.

    Args:
        belief: what is believed.
        states: distinct states where something can be done, int64 ``[n]``.
        action: a feasible one of each, ``[n]``.
    """
    model = belief.plans.model
    groups = Groups.of_widths(model.widths[states])
    place = groups.first + model.pair_index(states, action) - model.first_pair[states]
    total = np.zeros(states.size)
    for q, best, weight in _values(belief, states):
        total += (best - q[place] <= ALIKE) @ weight
    return total


def votes_of_all(belief: Belief, states: np.ndarray) -> np.ndarray:
    """`votes` for every action, float64 ``[n, n_actions]``; NaN where infeasible."""
    feasible = belief.plans.model.mask[states]
    total, segment = np.zeros(feasible.sum()), np.nonzero(feasible)[0]
    for q, best, weight in _values(belief, states):
        total += (best[segment] - q <= ALIKE) @ weight
    table = np.full(feasible.shape, np.nan)
    table[feasible] = total
    return table


def _values(
    belief: Belief, states: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Values of the states' pairs, the best of each state, and weights, a few hypotheses a time."""
    model = belief.plans.model
    chosen, weight = belief.likely()
    groups = Groups.of_widths(model.widths[states])
    within = np.arange(groups.size) - groups.spread(groups.first)
    pairs = groups.spread(model.first_pair[states]) + within
    for k in range(0, chosen.size, _CHUNK):
        q = belief.values_of(chosen[k : k + _CHUNK], pairs)
        yield q, np.maximum.reduceat(q, groups.first), weight[k : k + _CHUNK]


@dataclass(frozen=True)
class Predicted:
    """How well a policy is going to do, by the posterior's own account.

    Attributes:
        success: probability of reaching the goal within `HORIZON`, mean over the start states.
        accuracy: share of the states that it can get to where its action is as good as the best.
    """

    success: float
    accuracy: float


def predict(
    belief: Belief, action: np.ndarray, starts: np.ndarray, judged: np.ndarray
) -> Predicted:
    """Judge a policy by the posterior.

    Args:
        belief: what is believed.
        action: the policy, int64 ``[n_states]``, −1 for none.
        starts: indices of the states that runs start in.
        judged: indices of the states that accuracy is taken over.
    """
    chosen, weight = belief.likely()
    member = belief.members(belief.goal[chosen])
    good = votes(belief, judged, action[judged])
    # A goal's own state has nothing to be right about.
    outside = ~member[judged] @ weight
    accuracy = float((good * outside).sum() / max(outside.sum(), 1e-12))
    return Predicted(predicted_success(belief, action, starts), accuracy)


def predicted_success(belief: Belief, action: np.ndarray, starts: np.ndarray) -> float:
    """Probability of reaching the goal, by the posterior; arguments as of `predict`."""
    chosen, weight = belief.likely()
    member = belief.members(belief.goal[chosen])
    P = transition_matrix(belief.plans.model, action)
    reached = member.astype(np.float64)
    for _ in range(HORIZON):
        reached = np.where(member, 1.0, P @ reached)
    return float(reached[starts].mean(axis=0) @ weight)


def ends_agree(belief: Belief, model: TransitionModel, runs: Sequence[tuple[int, int]]) -> float:
    """The least probability, over recorded runs, that the learner's plan ends where the run did.

    Args:
        belief: what is believed.
        model: the transition model.
        runs: for each the state where it started, and where it ended.

    Returns:
        In 0…1; 1 without runs.
    """
    if not runs:
        return 1.0
    chosen, weight = belief.likely(8)
    starts = np.array([start for start, _ in runs])
    agreed = np.zeros(len(runs))
    for k, share in zip(chosen, weight / weight.sum(), strict=True):
        member = belief.goals[belief.goal[k]].member
        q = belief.values_of(np.array([k]))[:, 0]
        short = model.groups.spread(model.groups.maximum(q)) - q
        even = model.table(short <= ALIKE, fill=False)
        even[member] = False
        P = transition_matrix(model, even / np.maximum(even.sum(axis=1, keepdims=True), 1))
        at = np.zeros((len(runs), model.n_states))
        at[np.arange(len(runs)), starts] = 1.0
        ended = at * member
        for _ in range(HORIZON):
            at = (P.T @ (at * ~member).T).T
            ended += at * member
        agreed += share * ended[np.arange(len(runs)), [end for _, end in runs]]
    return float(agreed.min())
