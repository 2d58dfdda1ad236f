"""Which cluster to ask about next: SelectQuery of thesis Algorithm 4.1, for advice.

A cluster scores the mean of its states' scores by a strategy of `irl.queries`.
"""

from collections.abc import Collection, Mapping

import numpy as np

from irl.choices import check_choice
from irl.queries import QueryContext, Strategy, bald, masked_entropy, random, thesis_entropy

CLUSTER_STRATEGIES: dict[str, Strategy] = {
    "thesis_entropy": thesis_entropy,
    "masked_entropy": masked_entropy,
    "bald": bald,
    "random": random,
}


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


def select_part(
    partition: np.ndarray,
    asked: np.ndarray,
    uncertainty: np.ndarray | None,
    rng: np.random.Generator,
) -> int | None:
    """The part of highest mean uncertainty, where clusters part the states; ties drawn at random.

    A question about a single state is one about a part of its own.

    Args:
        partition: the part of each state, int64 ``[n_states]``, −1 outside.
        asked: parts not to ask about again.
        uncertainty: ``[n_states]``, such as ``irl.uncertainty.entropy``; None draws parts evenly.
        rng: draws, and breaks ties.

    Returns:
        The part, or None if none is left.
    """
    inside = partition >= 0
    left = np.setdiff1d(partition[inside], asked)
    if not left.size:
        return None
    if uncertainty is None:
        return int(rng.choice(left))
    total = np.bincount(partition[inside], uncertainty[inside])[left]
    mean = total / np.bincount(partition[inside])[left]
    return int(rng.choice(left[mean == mean.max()]))
