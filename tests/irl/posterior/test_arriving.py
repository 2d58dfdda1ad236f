"""Values by which one would go round in circles lean on what states are worth."""

import numpy as np

from irl.domains.gridworld import GridWorld
from irl.posterior.arriving import LEANINGS, SHORT, arrives, arriving

WORLD = GridWorld(7, (5, 5))
GOAL = np.array([WORLD.goal_state])
STARTS = np.arange(49)
WORTH = -0.05 * np.abs(WORLD.cells - WORLD.goal).sum(axis=1)


def values(leaning, minded=0.3):
    """Of states near the goal, and of actions that are minded by chance."""
    rng = np.random.default_rng(3)
    minds = minded * rng.random(WORLD.model.n_pairs)
    return WORLD.model.table((1 + leaning) * (WORLD.model.P @ WORTH) - minds)


def share(q):
    return arrives(WORLD.model, q, GOAL).mean()


def test_in_states_that_do_not_arrive_the_least_leaning_that_does_is_taken():
    own = values(0.0)
    q = arriving(values, WORLD.model, GOAL, STARTS)
    assert share(own) < 0.5 and share(q) >= 1 - SHORT
    changed = (q != own).any(axis=1)
    assert (arrives(WORLD.model, own, GOAL)[changed] < 0.95).all()
    (leaning,) = [k for k in LEANINGS if np.array_equal(values(k)[changed], q[changed])]
    less = LEANINGS[: LEANINGS.index(leaning)]
    assert share(arriving(values, WORLD.model, GOAL, STARTS, less)) < 1 - SHORT


def test_values_that_arrive_stay_as_they_are():
    q = arriving(lambda k: values(k, 0.01), WORLD.model, GOAL, STARTS)
    np.testing.assert_array_equal(q, values(0, 0.01))


def test_where_nothing_helps_values_stay_as_they_are():
    nowhere = np.array([], dtype=np.int64)
    q = arriving(values, WORLD.model, nowhere, STARTS)
    np.testing.assert_array_equal(q, values(0.0))
