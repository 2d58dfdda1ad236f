import numpy as np
import pytest

from irl.baselines.lp_bumps import explained, lp_bumps
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.method_inputs import labelled_policy, walk_ends, walks
from irl.methods import learn
from irl.planning import value_iteration

GAMMA = 0.99


@pytest.mark.parametrize("end", ["stay", "leave", "none"])
@pytest.mark.parametrize("goal", [(12, 34), (40, 5)])
def test_a_large_slippery_grid_is_learnt_from_four_walks(goal, end, slippery_grid):
    grid = slippery_grid(51, goal, end)
    for seed in range(2):
        learnt = learn(
            "lp_basis",
            grid.model,
            grid.walks(seed),
            grid.features,
            gamma=GAMMA,
            rng=np.random.default_rng(0),
        )
        assert grid.share(learnt.q) >= 0.9


def parts(grid, seed=0):
    shown = grid.walks(seed)
    policy = labelled_policy(grid.model, shown)
    return shown, policy, walk_ends(grid.model, walks(shown))


def test_the_fewest_bumps_that_explain_are_taken(slippery_grid):
    grid = slippery_grid(17, (4, 11), "stay")
    shown, policy, ends = parts(grid)
    found = lp_bumps(grid.model, shown, policy, ends, grid.features, gamma=GAMMA)
    assert found.number == 1
    assert found.explained == explained(grid.model, found.q, shown) >= 0.95
    _, Q = value_iteration(grid.model, found.reward, GAMMA)
    np.testing.assert_allclose(found.q, Q)
    assert found.reward.argmax() == grid.goal


def test_two_goals_take_two_bumps():
    """A corridor left and right of its middle, walked to the nearer end."""
    n, right, left = 41, 0, 1
    s = np.arange(n)
    model = TransitionModel.from_entries(
        n,
        2,
        np.repeat(s, 2),
        np.tile([right, left], n),
        np.stack([np.minimum(s + 1, n - 1), np.maximum(s - 1, 0)], axis=1).ravel(),
        np.ones(2 * n),
    )
    runs = [[(k, right) for k in range(22, n)], [(k, left) for k in range(18, -1, -1)]]
    shown = Demonstrations.from_trajectories(runs)
    policy = labelled_policy(model, shown)
    ends = walk_ends(model, walks(shown))
    assert sorted(ends) == [0, n - 1]
    x = np.linspace(0, 1, n)[:, None]
    found = lp_bumps(model, shown, policy, ends, x, gamma=0.9)
    assert found.number == 2
    chosen = found.q.argmax(axis=1)
    np.testing.assert_array_equal(chosen[22:], right)
    np.testing.assert_array_equal(chosen[:19], left)


def test_the_same_bumps_whatever_order_the_pairs_come_in(slippery_grid):
    grid = slippery_grid(9, (2, 5), "stay")
    shown, policy, ends = parts(grid)
    order = np.random.default_rng(1).permutation(len(shown))
    one, two = (
        lp_bumps(grid.model, pairs, policy, ends, grid.features, gamma=GAMMA)
        for pairs in (shown, shown.select(order))
    )
    np.testing.assert_array_equal(one.reward, two.reward)


def test_how_far_choices_are_explained():
    model = TransitionModel.from_entries(
        3,
        3,
        np.array([0, 0, 0, 1, 1, 2]),
        np.array([0, 1, 2, 0, 1, 0]),
        np.zeros(6, int),
        np.ones(6),
    )
    q = np.array([[3.0, 0.0, 0.0], [5.0, 5.0, -np.inf], [1.0, -np.inf, -np.inf]])
    # The best, 1 over the average of 1; below it by 1 of 2; nothing told apart; no choice.
    for pairs, expected in (
        ([(0, 0)], 1.0),
        ([(0, 1)], -0.5),
        ([(1, 0)], 0.0),
        ([(2, 0)], 0.0),
        ([(0, 0), (0, 1), (2, 0)], 0.25),
    ):
        assert explained(model, q, Demonstrations.from_labels(pairs)) == pytest.approx(expected)


def test_bad_numbers_are_named(slippery_grid):
    grid = slippery_grid(5, (1, 3), "stay")
    shown, policy, ends = parts(grid)
    with pytest.raises(InputError, match="bumps"):
        lp_bumps(grid.model, shown, policy, ends, grid.features, gamma=GAMMA, most=0)
