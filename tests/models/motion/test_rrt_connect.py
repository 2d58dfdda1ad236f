"""The search, in the plane, where one can see what it should find."""

from itertools import pairwise

import numpy as np
import pytest

from models.motion.rrt_connect import Space, connect, shortcut

LOW, HIGH = np.zeros(2), np.ones(2)
START, GOAL = np.array([0.1, 0.5]), np.array([0.9, 0.5])


def in_the_wall(a, b):
    """Heights at which a segment enters and leaves the wall 0.48 < x < 0.52, if it does."""
    if max(a[0], b[0]) <= 0.48 or min(a[0], b[0]) >= 0.52:
        return []
    slope = (b[1] - a[1]) / (b[0] - a[0]) if b[0] != a[0] else 0.0
    inside = np.clip([a[0], b[0]], 0.48, 0.52)
    return a[1] + slope * (inside - a[0]) if slope else [a[1], b[1]]


def through_a_gap(a, b):
    """The wall has a hole for 0.85 < y < 0.95."""
    return all(0.85 < y < 0.95 for y in in_the_wall(a, b))


def walled(a, b):
    return not len(in_the_wall(a, b))


def unit_square(is_free):
    return Space(is_free, LOW, HIGH, np.ones(2))


def length(path):
    return np.linalg.norm(np.diff(path, axis=0), axis=1).sum()


@pytest.mark.parametrize("seed", range(8))
def test_finds_the_gap_and_every_segment_is_free(seed):
    path = connect(START, GOAL, unit_square(through_a_gap), np.random.default_rng(seed))
    np.testing.assert_array_equal(path[[0, -1]], [START, GOAL])
    assert all(through_a_gap(a, b) for a, b in pairwise(path))
    assert ((path >= LOW) & (path <= HIGH)).all()
    # The shortest way, by the hole's lower edge, is 1.06 long.
    assert length(path) < 1.4


def test_same_seed_same_path():
    first, again, other = (
        connect(START, GOAL, unit_square(through_a_gap), np.random.default_rng(seed))
        for seed in (3, 3, 4)
    )
    np.testing.assert_array_equal(first, again)
    assert first.shape != other.shape or not np.array_equal(first, other)


def test_gives_up_where_there_is_no_way():
    rng = np.random.default_rng(0)
    assert connect(START, GOAL, unit_square(walled), rng, iterations=100) is None


def test_segments_are_asked_for_from_a_node_outwards():
    """The first configuration is a node already: the caller need not check it."""
    nodes = {START.tobytes(), GOAL.tobytes()}
    searching = True

    def is_free(a, b):
        assert not searching or a.tobytes() in nodes
        free = walled(a, b)
        if free:
            nodes.add(b.tobytes())
        return free

    connect(START, GOAL, unit_square(is_free), np.random.default_rng(0), iterations=50)
    assert len(nodes) > 10


def test_shortcuts_straighten_a_path_where_they_may():
    around = np.array([START, [0.2, 0.2], [0.3, 0.95], [0.5, 0.9], [0.8, 0.9], [0.7, 0.1], GOAL])
    rng = np.random.default_rng(0)
    shorter = shortcut(around, through_a_gap, rng)
    assert length(shorter) < 0.75 * length(around)
    assert all(through_a_gap(a, b) for a, b in pairwise(shorter))
    np.testing.assert_array_equal(shorter[[0, -1]], around[[0, -1]])
    np.testing.assert_array_equal(shortcut(around, lambda a, b: False, rng), around)
