"""What to ask next: SelectQuery of thesis Algorithm 4.1 and alternatives to its entropy.

A strategy scores every state; the best-scored candidate is put to the demonstrator. All
work on one ``QueryContext``, so that they can be exchanged by name.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from irl.choices import check_choice
from irl.mdp import TransitionModel

TOP_SHARE = 0.1  # of the candidates, by entropy, among which diversified_entropy spreads
HORIZON = 20  # actions that visitation_entropy looks ahead
RARE = 1e-6  # visits credited to states never visited, to keep them in order of entropy


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
    """

    model: TransitionModel
    q: np.ndarray
    features: np.ndarray
    demonstrated: np.ndarray
    candidates: np.ndarray
    beta: float
    start_states: np.ndarray
    rng: np.random.Generator


def action_probabilities(q: np.ndarray, beta: float) -> np.ndarray:
    """P_s(a) ∝ exp(β Q(s, a)), thesis (4.2), over finite entries; rows of −∞ give zeros.

    Shapes: ``[n_states, n_actions]`` both ways.
    """
    z = beta * q
    peak = z.max(axis=1, keepdims=True)
    e = np.exp(z - np.where(np.isfinite(peak), peak, 0.0))
    return e / np.maximum(e.sum(axis=1, keepdims=True), np.finfo(float).tiny)


def entropy(q: np.ndarray, beta: float = 1.0) -> np.ndarray:
    """E(s), thesis (4.1), in nats: ``[n_states]``, from 0 to the log of the finite entries."""
    p = action_probabilities(q, beta)
    return -(p * np.log(np.where(p > 0, p, 1.0))).sum(axis=1) + 0.0


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
    spread = context.features.std(axis=0)
    x = context.features / np.where(spread > 0, spread, 1.0)
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
    states and follow (4.2).
    """
    model = context.model
    policy = action_probabilities(context.q, context.beta)[model.pair_state, model.pair_action]
    forward = model.P.T.tocsr()
    here = np.zeros(model.n_states)
    here[context.start_states] = 1.0 / context.start_states.size
    visits = here.copy()
    for _ in range(HORIZON - 1):
        here = forward @ (policy * here[model.pair_state])
        visits += here
    return masked_entropy(context) * (visits + RARE)


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
    "random": random,
}
CLUSTER_STRATEGIES: dict[str, Strategy] = {
    "thesis_entropy": thesis_entropy,
    "masked_entropy": masked_entropy,
    "random": random,
}


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
    open_ &= np.diff(model.first_pair) > 0
    open_[demonstrated] = False
    return np.flatnonzero(open_)


def select_state(strategy: str, context: QueryContext) -> int | None:
    """The candidate that scores highest, ties drawn at random; None without candidates.

    Raises:
        InputError: if the strategy is unknown.
    """
    check_choice("state_query", strategy, STATE_STRATEGIES)
    if context.candidates.size == 0:
        return None
    scores = STATE_STRATEGIES[strategy](context)[context.candidates]
    return int(context.rng.choice(context.candidates[scores == scores.max()]))


def select_cluster(
    strategy: str,
    context: QueryContext,
    clusters: Mapping[str, np.ndarray],
    exclude: Collection[str] = (),
) -> str | None:
    """The cluster with the highest mean score of its states (SelectQuery's U), ties by order.

    Args:
        strategy: a name in ``CLUSTER_STRATEGIES``; ``random`` draws clusters uniformly.
        context: what is known.
        clusters: name → state indices; empty clusters are never asked about.
        exclude: names not to ask about again.

    Returns:
        Its name, or None if none is left.

    Raises:
        InputError: if the strategy is unknown.
    """
    check_choice("cluster_query", strategy, CLUSTER_STRATEGIES)
    left = [name for name in clusters if name not in exclude and len(clusters[name])]
    if not left:
        return None
    if strategy == "random":
        return left[int(context.rng.integers(len(left)))]
    scores = CLUSTER_STRATEGIES[strategy](context)
    return max(left, key=lambda name: scores[clusters[name]].mean())
