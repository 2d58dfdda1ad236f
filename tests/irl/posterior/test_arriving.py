"""Values by which one would go round in circles lean on what states are worth."""

import numpy as np
import pytest

from irl.domains.gridworld import GridWorld
from irl.posterior.arriving import LEANINGS, SHORT, arrival, arriving

WORLD = GridWorld(7, (5, 5))
GOAL = np.array([WORLD.goal_state])
STARTS = np.arange(49)
WORTH = -0.05 * np.abs(WORLD.cells - WORLD.goal).sum(axis=1)


def values(leaning, minded=0.3):
    """Of states near the goal, and of actions that are minded by chance."""
    rng = np.random.default_rng(3)
    minds = minded * rng.random(WORLD.model.n_pairs)
    return WORLD.model.table((1 + leaning) * (WORLD.model.P @ WORTH) - minds)


def test_the_least_leaning_that_arrives_is_taken():
    leaning, q = arriving(values, WORLD.model, GOAL, STARTS)
    assert leaning > 0
    np.testing.assert_array_equal(q, values(leaning))
    assert arrival(WORLD.model, q, GOAL, STARTS) >= 1 - SHORT
    for less in LEANINGS[: LEANINGS.index(leaning)]:
        assert arrival(WORLD.model, values(less), GOAL, STARTS) < 1 - SHORT


def test_values_that_arrive_stay_as_they_are():
    leaning, q = arriving(lambda k: values(k, 0.01), WORLD.model, GOAL, STARTS)
    assert leaning == 0
    np.testing.assert_array_equal(q, values(0, 0.01))


def test_where_none_arrives_that_which_arrives_most_is_taken():
    tried = (0.0, 0.02, 0.05, 0.1, 0.15, 0.2)
    reached = [arrival(WORLD.model, values(leaning), GOAL, STARTS) for leaning in tried]
    assert max(reached) < 1 - SHORT
    leaning, _ = arriving(values, WORLD.model, GOAL, STARTS, tried)
    first = next(
        k for k, share in zip(tried, reached, strict=True) if share >= max(reached) - SHORT
    )
    assert leaning == first
    nowhere = np.array([], dtype=np.int64)
    assert arriving(values, WORLD.model, nowhere, STARTS)[0] == pytest.approx(0)
