from collections import defaultdict

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import spsolve

from irl.baselines.lp_bumps import explained, lp_bumps
from irl.demonstrations import Demonstrations
from irl.domains.gridworld import MOVES, GridWorld
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.method_inputs import labelled_policy, walk_ends, walks
from irl.methods import learn
from irl.planning import value_iteration

GAMMA = 0.99


class SlipperyGrid:
    """n × n cells; a move goes to another side, any of the four, with probability ``slip``.

    Every move costs 1 until the goal is reached, where a run ends: it stays there, is free to
    leave, or nothing can be done.
    """

    def __init__(self, n, goal, end, slip=0.2):
        self.n, self.goal = n, goal[1] * n + goal[0]
        self.features = GridWorld(n, goal).features
        y, x = np.divmod(np.arange(n * n), n)
        to = np.stack(
            [np.clip(y + v, 0, n - 1) * n + np.clip(x + u, 0, n - 1) for u, v in MOVES], axis=1
        )
        chance: dict = defaultdict(float)
        for s in range(n * n):
            if s == self.goal and end != "leave":
                if end == "stay":
                    chance[s, 0, s] = 1.0
                continue
            for a in range(4):
                chance[s, a, to[s, a]] += 1 - slip
                for b in range(4):
                    chance[s, a, to[s, b]] += slip / 4
        entries = (np.array(column) for column in zip(*chance, strict=True))
        self.model = TransitionModel.from_entries(n * n, 4, *entries, np.array([*chance.values()]))
        self.cost = np.where(self.model.pair_state == self.goal, 0.0, -1.0)
        self.V, self.Q = value_iteration(
            self.model, np.zeros(n * n), GAMMA, pair_reward=self.cost, terminal=[self.goal]
        )

    def value(self, policy):
        """Mean value over all cells of a policy ``[n_states, n_actions]``, by a linear system."""
        model = self.model
        weight = policy[model.pair_state, model.pair_action] * (model.pair_state != self.goal)
        choice = sparse.csr_matrix((weight, (model.pair_state, np.arange(model.n_pairs))))
        choice.resize(model.n_states, model.n_pairs)
        A = sparse.identity(model.n_states) - GAMMA * (choice @ model.P)
        return spsolve(A.tocsc(), choice @ self.cost).mean()

    def share(self, q):
        """How far acting greedily by ``q`` comes from the random to the optimal value."""
        mask = self.model.mask
        chance = self.value(mask / np.maximum(mask.sum(axis=1, keepdims=True), 1))
        return (self.value(np.eye(4)[q.argmax(axis=1)]) - chance) / (self.V.mean() - chance)

    def walks(self, seed):
        """An optimal walk from each corner."""
        rng, last, runs = np.random.default_rng(seed), self.n - 1, []
        for corner in (0, last, self.n * last, self.n * self.n - 1):
            state, pairs = corner, []
            while state != self.goal:
                best = np.flatnonzero(self.Q[state] > self.Q[state].max() - 1e-7)
                pairs.append((state, int(rng.choice(best))))
                state = self.model.sample(*pairs[-1], rng)
            runs.append(pairs)
        return Demonstrations.from_trajectories(runs)


@pytest.mark.parametrize("end", ["stay", "leave", "none"])
@pytest.mark.parametrize("goal", [(12, 34), (40, 5)])
def test_a_large_slippery_grid_is_learnt_from_four_walks(goal, end):
    grid = SlipperyGrid(51, goal, end)
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


def test_the_fewest_bumps_that_explain_are_taken():
    grid = SlipperyGrid(17, (4, 11), "stay")
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


def test_the_same_bumps_whatever_order_the_pairs_come_in():
    grid = SlipperyGrid(9, (2, 5), "stay")
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


def test_bad_numbers_are_named():
    grid = SlipperyGrid(5, (1, 3), "stay")
    shown, policy, ends = parts(grid)
    with pytest.raises(InputError, match="bumps"):
        lp_bumps(grid.model, shown, policy, ends, grid.features, gamma=GAMMA, most=0)
