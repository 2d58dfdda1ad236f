"""What to ask next: SelectQuery of thesis Algorithm 4.1 and alternatives to its entropy.

A strategy scores every state; the best-scored candidate is put to the demonstrator. All
work on one ``QueryContext``, so that they can be exchanged by name.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial.distance import cdist

from irl.choices import check_choice, check_range
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.uncertainty import (
    action_probabilities,
    entropy,
    mutual_information,
    value_of_information,
    vote_entropy,
)

TOP_SHARE = 0.1  # of the candidates, by entropy, among which diversified_entropy spreads
HORIZON = 20  # actions that visitation_entropy looks ahead
RARE = 1e-6  # visits credited to states never visited, to keep them in order of entropy
SHORTLIST = 16  # candidates, by mutual information, whose value of information is worked out
DECISIONS = 1024  # states, by expected visits, whose decisions that value is summed over
CROWD = 10  # a batch of n is spread over the 10 n best-scored candidates


@dataclass(frozen=True)
class QueryContext:
    """What is known when a question is chosen.

    Attributes:
        model: the transition model.
        q: float64 ``[n_states, n_actions]``, advice included, −∞ where excluded.
        features: ``[n_states, n_features]``.
        demonstrated: int64, the states that have labels.
        candidates: int64, the states that may be asked about.
        beta: inverse temperature of the action probabilities (4.2); 1 in the thesis.
        start_states: int64, where episodes begin.
        rng: for random choices and ties.
        ends: int64, states where nobody goes on: where demonstrators ended, or had nothing to do.
        asked: how many questions about states were asked before.
        committee_q: float64 ``[n_members, n_states, n_actions]``, each member's ``q``, −∞ in
            the same places; None unless a strategy of ``COMMITTEE_STRATEGIES`` is to choose.
    """

    model: TransitionModel
    q: np.ndarray
    features: np.ndarray
    demonstrated: np.ndarray
    candidates: np.ndarray
    beta: float
    start_states: np.ndarray
    rng: np.random.Generator
    committee_q: np.ndarray | None = None
    ends: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    asked: int = 0


def thesis_entropy(context: QueryContext) -> np.ndarray:
    """(4.1) as printed: over *all* actions, infeasible ones at Q = 0."""
    return entropy(np.where(context.model.mask, context.q, 0.0), context.beta)


def masked_entropy(context: QueryContext) -> np.ndarray:
    """(4.1) over the actions that can be taken."""
    return entropy(context.q, context.beta)


def margin(context: QueryContext) -> np.ndarray:
    """Minus the gap in probability between the two likeliest actions; −1 with a single one."""
    p = action_probabilities(context.q, context.beta)
    if p.shape[1] == 1:
        return -p[:, 0]
    top = np.partition(p, -2, axis=1)
    return top[:, -2] - top[:, -1]


def diversified_entropy(context: QueryContext) -> np.ndarray:
    """Farthest-first among the uncertain: distance to the nearest demonstrated state.

    Only the candidates in the top tenth by masked entropy compete; the others score −∞.
    Uncertain states come in crowds of look-alikes, and one answer settles the crowd.
    Distances are Euclidean over features brought to unit variance.
    """
    candidates = context.candidates
    uncertainty = masked_entropy(context)[candidates]
    n_top = max(1, int(np.ceil(TOP_SHARE * candidates.size)))
    top = candidates[uncertainty >= np.partition(uncertainty, -n_top)[-n_top]]
    x = _unit_variance(context.features)
    nearest = np.full(top.size, np.inf)
    for block in np.array_split(context.demonstrated, -(-context.demonstrated.size // 1024) or 1):
        if block.size:
            nearest = np.minimum(nearest, cdist(x[top], x[block]).min(axis=1))
    scores = np.full(context.model.n_states, -np.inf)
    scores[top] = nearest
    return scores


def visitation_entropy(context: QueryContext) -> np.ndarray:
    """Masked entropy times the expected visits of the present policy: doubt where it matters.

    Visits are counted over the first 20 actions of episodes that begin uniformly in the start
    states and follow (4.2). They stop where demonstrators were seen to: nobody is in doubt there.
    """
    return masked_entropy(context) * (_visits(context) + RARE)


def visited_and_diverse(context: QueryContext) -> np.ndarray:
    """`visitation_entropy` and `diversified_entropy` in turn; of a batch each chooses half.

    One settles the way that the present policy goes, the other what lies apart from it.
    """
    return (diversified_entropy if context.asked % 2 else visitation_entropy)(context)


def bald(context: QueryContext) -> np.ndarray:
    """Mutual information between the action and the committee's member, see there."""
    return mutual_information(action_probabilities(_committee(context), context.beta))


def votes(context: QueryContext) -> np.ndarray:
    """Entropy of the committee's votes for the best action."""
    return vote_entropy(_committee(context))


def information_value(context: QueryContext) -> np.ndarray:
    """Expected value of information, for decisions where the present policy goes.

    An answer says nothing about which member is right where they agree, so the 16 candidates
    of the highest mutual information are shortlisted; the others score −∞. Decisions are
    counted by their expected visits, as in ``visitation_entropy``, over the 1024 states that
    have most of them.
    """
    q = _committee(context)
    candidates = context.candidates
    p = action_probabilities(q[:, candidates], context.beta)
    top = np.argsort(-mutual_information(p), kind="stable")[:SHORTLIST]
    visits = np.where(np.isfinite(q[0]).any(axis=1), _visits(context) + RARE, 0.0)
    decided = np.argsort(-visits, kind="stable")[: min(DECISIONS, np.count_nonzero(visits))]
    scores = np.full(context.model.n_states, -np.inf)
    scores[candidates[top]] = value_of_information(p[:, top], q[:, decided], visits[decided])
    return scores


def random(context: QueryContext) -> np.ndarray:
    """Every state alike."""
    return context.rng.random(context.model.n_states)


Strategy = Callable[[QueryContext], np.ndarray]
STATE_STRATEGIES: dict[str, Strategy] = {
    "thesis_entropy": thesis_entropy,
    "masked_entropy": masked_entropy,
    "margin": margin,
    "diversified_entropy": diversified_entropy,
    "visitation_entropy": visitation_entropy,
    "visited_and_diverse": visited_and_diverse,
    "bald": bald,
    "vote_entropy": votes,
    "value_of_information": information_value,
    "random": random,
}
COMMITTEE_STRATEGIES = frozenset({"bald", "vote_entropy", "value_of_information"})


def _committee(context: QueryContext) -> np.ndarray:
    if context.committee_q is None:
        raise InputError(
            f"queries: {', '.join(sorted(COMMITTEE_STRATEGIES))} need a committee's action values"
        )
    return context.committee_q


def _unit_variance(features: np.ndarray) -> np.ndarray:
    spread = features.std(axis=0)
    return features / np.where(spread > 0, spread, 1.0)


def _visits(context: QueryContext) -> np.ndarray:
    """Expected visits in the first 20 actions under (4.2), from uniform starts: ``[n_states]``."""
    model = context.model
    policy = action_probabilities(context.q, context.beta)[model.pair_state, model.pair_action]
    policy[np.isin(model.pair_state, context.ends)] = 0.0
    forward = model.P.T.tocsr()
    here = np.zeros(model.n_states)
    here[context.start_states] = 1.0 / context.start_states.size
    visits = here.copy()
    for _ in range(HORIZON - 1):
        here = forward @ (policy * here[model.pair_state])
        visits += here
    return visits


def candidate_states(
    model: TransitionModel, demonstrated: np.ndarray, allowed: np.ndarray | None = None
) -> np.ndarray:
    """States worth asking about: something can be done there, and nothing is known yet.

    Args:
        model: the transition model.
        demonstrated: state indices that have labels.
        allowed: state indices to stay within, such as the reachable ones; all if absent.
    """
    open_ = np.zeros(model.n_states, dtype=bool)
    open_[slice(None) if allowed is None else allowed] = True
    open_ &= model.widths > 0
    open_[demonstrated] = False
    return np.flatnonzero(open_)


def select_states(strategy: str, context: QueryContext, count: int = 1) -> np.ndarray:
    """Candidates to ask about at once: int64 ``[≤ count]``, all distinct.

    The first is the one that scores highest. Its likes score high as well, and one answer
    settles them all; so the others are spread over the best-scored 10 · ``count`` (those that
    score −∞ only if too few are left), each the farthest from those chosen before
    (farthest-first traversal, Gonzalez 1985; distance as in ``diversified_entropy``).
    ``random`` draws the whole batch uniformly.

    Args:
        strategy: a name in ``STATE_STRATEGIES``.
        context: what is known.
        count: most states wanted, at least 1; fewer come only when candidates run out.

    Raises:
        InputError: if the strategy is unknown, or ``count`` is below 1.
    """
    check_choice("state_query", strategy, STATE_STRATEGIES)
    check_range("batch", count, 1)
    candidates = context.candidates
    if candidates.size == 0:
        return candidates
    if strategy == "visited_and_diverse" and count > 1:
        return _half_and_half(context, count)
    scores = STATE_STRATEGIES[strategy](context)[candidates]
    chosen = [int(context.rng.choice(candidates[scores == scores.max()]))]
    count = min(count, candidates.size)
    if count > 1:
        rest = context.rng.permutation(np.flatnonzero(candidates != chosen[0]))
        ranked = rest[np.argsort(-scores[rest], kind="stable")]
        crowd = count if strategy == "random" else CROWD * count
        scored = min(crowd - 1, np.count_nonzero(scores[rest] > -np.inf))
        pool = candidates[ranked[: max(count - 1, scored)]]
        x = _unit_variance(context.features)
        nearest = np.full(pool.size, np.inf)
        while len(chosen) < count:
            nearest = np.minimum(nearest, cdist(x[pool], x[chosen[-1:]])[:, 0])
            farthest = nearest.argmax()
            chosen.append(int(pool[farthest]))
            nearest[farthest] = -np.inf
    return np.array(chosen)


def _half_and_half(context: QueryContext, count: int) -> np.ndarray:
    """A batch of ``visited_and_diverse``; the surplus of an odd one goes to whose turn it is."""
    visited = (count + 1 - context.asked % 2) // 2
    first = select_states("visitation_entropy", context, visited)
    rest = replace(
        context,
        candidates=np.setdiff1d(context.candidates, first),
        demonstrated=np.union1d(context.demonstrated, first),
    )
    return np.r_[first, select_states("diversified_entropy", rest, count - visited)]
