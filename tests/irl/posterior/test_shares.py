"""What a hypothesis stands for."""

from itertools import product

import numpy as np
import pytest

from irl.posterior.belief import Belief
from irl.posterior.goals import one_state
from irl.posterior.plans import HardPlans
from irl.posterior.shares import stands_for

MOST = 5


def by_hand(goal, level):
    """The same, one combination after the other."""
    rows = [(g, *levels) for g, levels in zip(goal.tolist(), level.tolist(), strict=True)]
    adjacent = {}
    for row in rows:
        choices = [
            [0] if x == 0 else [y for y in (x - 1, x, x + 1) if 1 <= y <= MOST] for x in row[1:]
        ]
        for near in product(*choices):
            adjacent.setdefault((row[0], *near), set()).add(row)
    total = dict.fromkeys(rows, 1.0)
    for near, sharers in adjacent.items():
        if near not in total:
            for row in sharers:
                total[row] += 1 / len(sharers)
    return [total[row] for row in rows]


def test_each_that_was_not_planned_for_is_shared_by_its_neighbours():
    rng = np.random.default_rng(0)
    drawn = np.unique(
        np.column_stack([rng.integers(0, 3, 200), rng.integers(0, MOST + 1, (200, 3))]), axis=0
    )
    goal, level = drawn[:, 0], drawn[:, 1:]
    np.testing.assert_allclose(stands_for(goal, level, MOST), by_hand(goal, level))


def test_alone_it_stands_for_all_around_it_and_for_no_cost_more_or_less():
    one = np.array([0])
    assert stands_for(one, np.array([[0, 0]]), MOST).tolist() == [1]
    assert stands_for(one, np.array([[3, 0]]), MOST).tolist() == [3]
    assert stands_for(one, np.array([[3, 3]]), MOST).tolist() == [9]
    assert stands_for(one, np.array([[1, MOST]]), MOST).tolist() == [4]


def test_where_all_was_planned_for_each_stands_for_itself():
    level = np.array(list(product(range(MOST + 1), repeat=2)))
    assert (stands_for(np.zeros(len(level), dtype=np.int64), level, MOST) == 1).all()


def test_a_cost_of_which_few_sizes_were_tried_has_their_neighbours_share_of_the_prior(chain):
    """Nothing was shown: 0 has half of the prior, and each of the other 13 sizes as much."""
    costs = np.column_stack([np.arange(chain.n_pairs) / 10, np.ones(chain.n_pairs)])
    belief = Belief(HardPlans(chain, 0.9, costs, {}), ["effort"], 0.01)
    belief.propose([one_state(3, 4)])
    belief.add(np.zeros(2, dtype=np.int64), np.array([[3], [8]]))
    assert belief.weight[belief.level[:, 0] > 0].sum() == pytest.approx(6 / (13 + 6))
    belief.add(np.zeros(13, dtype=np.int64), np.arange(1, 14)[:, None])
    assert belief.weight[belief.level[:, 0] > 0].sum() == pytest.approx(1 / 2)


@pytest.mark.parametrize("costs", [0, 40])
def test_there_may_be_no_cost_and_many(costs):
    level = np.full((2, costs), 3)
    level[1, :1] = 5
    goal = np.arange(2) if not costs else np.zeros(2, dtype=np.int64)
    total = stands_for(goal, level, MOST)
    # Of many that matter one at a time is another: up or down of each.
    assert total.tolist() == ([1, 1] if not costs else [1 + 80 - 0.5, 1 + 79 - 0.5])
