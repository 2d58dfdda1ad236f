"""RRT-Connect: a path between two configurations by two random trees that grow together.

Kuffner and LaValle, "RRT-Connect: An Efficient Approach to Single-Query Path Planning",
ICRA 2000; shortcuts after Geraerts and Overmars, "Creating High-quality Paths for Motion
Planning", 2007. Knows nothing of robots: whether a segment is free is a function's to say.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

STEP = 0.35
"""Length of a tree's step, in the metric of the weights."""
ITERATIONS = 400
"""Samples before the search gives up."""
SHORTCUTS = 60
"""Random shortcuts tried on a path that was found."""

IsFree = Callable[[np.ndarray, np.ndarray], bool]


@dataclass(frozen=True)
class Space:
    """Where to search.

    Attributes:
        is_free: whether the straight segment between two configurations is free; the first is
            a node already, hence free.
        lower: least of the samples ``[d]``.
        upper: largest of the samples ``[d]``.
        weights: of the coordinates in the metric ``[d]``.
    """

    is_free: IsFree
    lower: np.ndarray
    upper: np.ndarray
    weights: np.ndarray


class _Tree:
    """Configurations, each joined to its parent by a free segment."""

    def __init__(self, root: np.ndarray, weights: np.ndarray) -> None:
        self._weights = weights
        self._nodes, self._parents = root[None], [-1]

    def nearest(self, q: np.ndarray) -> int:
        return int(np.linalg.norm((self._nodes - q) * self._weights, axis=1).argmin())

    def extend(self, towards: np.ndarray, is_free: IsFree) -> np.ndarray | None:
        """Add one step from the nearest node; the new node, None if the step is not free."""
        parent = self.nearest(towards)
        q = self._nodes[parent]
        distance = float(np.linalg.norm((towards - q) * self._weights))
        new = towards if distance <= STEP else q + STEP / distance * (towards - q)
        if not is_free(q, new):
            return None
        self._nodes = np.vstack([self._nodes, new])
        self._parents.append(parent)
        return new

    def branch(self) -> np.ndarray:
        """The newest node and its ancestors up to the root, ``[n, d]``."""
        rows, node = [], len(self._parents) - 1
        while node >= 0:
            rows.append(node)
            node = self._parents[node]
        return self._nodes[rows]


def connect(
    q_from: np.ndarray,
    q_to: np.ndarray,
    space: Space,
    rng: np.random.Generator,
    *,
    iterations: int = ITERATIONS,
) -> np.ndarray | None:
    """Search a free path, and shorten it.

    Args:
        q_from: ``[d]``.
        q_to: ``[d]``; free itself.
        space: bounds, metric, and what is free.
        rng: source of the samples.
        iterations: number of samples before giving up.

    Returns:
        Waypoints ``[n, d]`` from ``q_from`` to ``q_to``; None if none was found, which proves
        nothing.
    """
    start, goal = (_Tree(q, space.weights) for q in (q_from, q_to))
    grower, follower = start, goal
    for _ in range(iterations):
        new = grower.extend(rng.uniform(space.lower, space.upper), space.is_free)
        while new is not None:
            reached = follower.extend(new, space.is_free)
            if reached is None:
                break
            if np.array_equal(reached, new):
                path = np.vstack([start.branch()[::-1], goal.branch()[1:]])
                return shortcut(path, space.is_free, rng)
        grower, follower = follower, grower
    return None


def shortcut(
    path: np.ndarray, is_free: IsFree, rng: np.random.Generator, attempts: int = SHORTCUTS
) -> np.ndarray:
    """Replace pieces of a free ``path [n, d]`` by straight segments that are free.

    A piece runs from one random point of the path to another.
    """
    for _ in range(attempts):
        if len(path) < 3:
            break
        lengths = np.linalg.norm(np.diff(path, axis=0), axis=1)
        ends = np.concatenate([[0.0], np.cumsum(lengths)])
        low, high = np.sort(rng.uniform(0.0, ends[-1], 2))
        first, last = np.searchsorted(ends, [low, high], side="right") - 1
        if first == last:
            continue
        a, b = (
            path[i] + (at - ends[i]) / lengths[i] * (path[i + 1] - path[i])
            for i, at in ((first, low), (last, high))
        )
        if is_free(a, b):
            path = np.vstack([path[: first + 1], a, b, path[last + 1 :]])
    return path
