"""New clusters out of given ones: their intersections (thesis §5.11).

The more states a cluster has, the more one piece of advice reaches, and the less alike they
are. An intersection trades reach for likeness without anyone drawing a new line.
"""

from collections.abc import Mapping
from functools import reduce

import numpy as np
from scipy.cluster.vq import kmeans2

from irl.choices import check_choice, check_range
from irl.integers import integers

AND = " ∩ "


def intersection(clusters: Mapping[str, np.ndarray], name: str) -> np.ndarray:
    """The states of the cluster called ``name``, or of an intersection such as ``"a ∩ b"``.

    Args:
        clusters: name → state indices.
        name: names of clusters, joined by " ∩ ".

    Returns:
        State indices, int64, ascending.

    Raises:
        InputError: if a name is unknown; lists the valid ones.
    """
    parts = [name] if name in clusters else name.split(AND)
    for part in parts:
        check_choice("cluster", part, clusters)
    return reduce(np.intersect1d, (np.unique(clusters[part]).astype(np.int64) for part in parts))


def with_intersections(
    clusters: Mapping[str, np.ndarray], depth: int = 1, smallest: int = 1
) -> dict[str, np.ndarray]:
    """The clusters and all distinct intersections of up to ``depth + 1`` of them.

    A set of states occurs once, under its shortest name and that of the earliest clusters; one
    that equals a given cluster is not a new one. Names join those of the clusters, in their given
    order, by " ∩ ".

    Args:
        clusters: name → state indices, kept as they are and first.
        depth: rounds of intersecting what is new with every given cluster; 0 adds nothing.
        smallest: intersections of fewer states are left out.

    Returns:
        Name → state indices; those of intersections int64, ascending.

    Raises:
        InputError: if ``depth`` is below 0 or ``smallest`` below 1.
    """
    check_range("depth", depth, 0)
    check_range("smallest", smallest, 1)
    names = list(clusters)
    n_states = max((int(np.max(c)) + 1 for c in clusters.values() if len(c)), default=0)
    member = np.zeros((len(names), n_states), dtype=bool)
    for row, name in zip(member, names, strict=True):
        row[integers(clusters[name], f"clusters: {name!r}")] = True
    result = dict(clusters)
    known = {row.tobytes() for row in member}
    newest: list[tuple[tuple[int, ...], np.ndarray]] = [((k,), row) for k, row in enumerate(member)]
    for _ in range(depth):
        found = []
        for parts, states in newest:
            for k in range(len(names)):
                both = states & member[k]
                if both.sum() < smallest or both.tobytes() in known:
                    continue
                known.add(both.tobytes())
                joined = tuple(sorted((*parts, k)))
                found.append((joined, both))
                result[AND.join(names[part] for part in joined)] = np.flatnonzero(both)
        newest = found
    return result


def found(rows: np.ndarray, number: int, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Clusters that nobody drew: the parts that k-means makes of rows of numbers (thesis 7.2).

    Args:
        rows: what states are alike in, ``[n_states, d]``, such as features or action values; what
            is not finite counts as 0. Columns are brought to unit variance.
        number: how many clusters, at most; none is empty.
        rng: draws where they begin.

    Returns:
        Name → state indices, int64, ascending; every state is in one.

    Raises:
        InputError: if ``number`` is below 1 or above the number of states.
    """
    x = np.where(np.isfinite(rows), rows, 0.0).astype(np.float64)
    check_range("number", number, 1, len(x))
    spread = x.std(axis=0)
    x /= np.where(spread > 0, spread, 1.0)
    _, part = kmeans2(x, number, minit="++", rng=rng, missing="warn")
    return {f"found {k}": np.flatnonzero(part == k) for k in np.unique(part)}
