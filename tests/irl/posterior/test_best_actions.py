"""The best of each state's actions, compiled and not."""

import numpy as np
import pytest

from irl.posterior import best_actions as module
from irl.posterior.best_actions import best_actions


def drawn(seed, columns=5):
    """Five groups of a few pairs each."""
    rng = np.random.default_rng(seed)
    first = np.append(0, np.cumsum(rng.integers(1, 6, 5)))
    ahead = rng.standard_normal((7, columns)).astype(np.float32)
    dear = rng.random((3, columns)).astype(np.float32)
    kinds = (rng.integers(n, size=first[-1]).astype(np.int32) for n in (7, 3))
    return ahead, dear, *kinds, first


@pytest.mark.parametrize("columns", [1, 5, 64, 67])
def test_it_is_the_largest_of_each_group(columns):
    ahead, dear, led, paid, first = given = drawn(columns, columns)
    best = best_actions(*given)
    assert best.dtype == np.float32
    for group in range(5):
        pairs = slice(first[group], first[group + 1])
        np.testing.assert_array_equal(best[group], (ahead[led[pairs]] - dear[paid[pairs]]).max(0))


@pytest.mark.parametrize("seed", range(3))
def test_without_numba_it_comes_to_the_same_bits(seed, monkeypatch):
    given = drawn(seed)
    compiled = best_actions(*given)
    monkeypatch.setattr(module, "_compiled", lambda: None)
    for at_once in (64, 2):  # all groups, and a few at a time
        monkeypatch.setattr(module, "_AT_ONCE", at_once)
        np.testing.assert_array_equal(best_actions(*given), compiled)


@pytest.mark.parametrize("numba", [True, False])
def test_no_group_has_no_best(numba, monkeypatch):
    if not numba:
        monkeypatch.setattr(module, "_compiled", lambda: None)
    ahead, dear, led, paid, _ = drawn(0)
    nobody = np.zeros(1, dtype=np.int64)
    assert best_actions(ahead, dear, led[:0], paid[:0], nobody).shape == (0, 5)
