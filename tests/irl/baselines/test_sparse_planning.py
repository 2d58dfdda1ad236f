from dataclasses import replace

import numpy as np
import pytest

from irl.baselines.pruned_rewards import pruned
from irl.baselines.sparse_planning import SparseConfig, sparse_planning
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.planning import value_iteration


@pytest.mark.parametrize("grid", [5, 15], indirect=True)
def test_recovers_the_grid_with_few_rewards(grid, optimal_walks, share_of_optimum):
    R, weights = sparse_planning(
        grid.model, optimal_walks, gamma=0.9, config=SparseConfig(sparsity=0.1)
    )
    np.testing.assert_array_equal(R, weights)
    assert np.count_nonzero(R) < grid.n_states / 2
    _, Q = value_iteration(grid.model, R, 0.9)
    assert share_of_optimum(Q.argmax(axis=1)).mean() >= 0.99


def test_one_walk_tells_the_way_from_everywhere(grid, optimal_walks, share_of_optimum):
    """A single trajectory from the farthest corner, and cells that it never saw."""
    names, length = np.unique(optimal_walks.trajectory, return_counts=True)
    walk = optimal_walks.select(optimal_walks.trajectory == names[length.argmax()])
    R, _ = sparse_planning(grid.model, walk, gamma=0.9, config=SparseConfig(sparsity=0.1))
    _, Q = value_iteration(grid.model, R, 0.9)
    assert share_of_optimum(Q.argmax(axis=1)).mean() >= 0.99


def test_the_dearer_the_fewer(grid, optimal_walks):
    used = [
        np.count_nonzero(
            sparse_planning(
                grid.model,
                optimal_walks,
                gamma=0.9,
                config=SparseConfig(sparsity=share, prune=False),
            )[0]
        )
        for share in (0.01, 0.3, 1.0)
    ]
    assert used[0] > used[1] > used[2] == 0


def longest(walks):
    names, length = np.unique(walks.trajectory, return_counts=True)
    return walks.select(walks.trajectory == names[length.argmax()])


def test_pruned_it_pays_where_runs_ended_and_nowhere_else(grid, optimal_walks):
    walk, goal = longest(optimal_walks), grid.goal_state
    last = int(walk.step.max()) + 1
    ended = replace(walk, ends=np.array([[walk.trajectory[0], last, goal]]))
    R, weights = sparse_planning(grid.model, ended, gamma=0.9, config=SparseConfig(prune=True))
    assert np.flatnonzero(R).tolist() == [goal]
    np.testing.assert_array_equal(R, weights)


@pytest.mark.parametrize("grid", [15], indirect=True)
def test_where_no_end_is_known_rewards_are_dropped_only_if_as_many_labels_are_explained(
    grid, optimal_walks
):
    walk, goal = longest(optimal_walks), grid.goal_state
    walk = replace(walk, ends=np.zeros((0, 3), dtype=np.int64))
    spurious = np.zeros(grid.n_states)
    spurious[[goal, 0, 1]] = 5.0, 1.0, 0.5
    kept = pruned(grid.model, walk, spurious, 0.9)
    assert np.flatnonzero(kept).tolist() == [goal]
    # Two places that are both needed, one of them poorly paid: all labels of one lead away.
    goals = np.zeros(grid.n_states)
    goals[goal], goals[-1] = 5.0, 2.0
    _, q = value_iteration(grid.model, goals, 0.9)
    states = np.repeat(np.arange(grid.n_states), 3)
    both = type(walk).from_pairs([(s, int(q[s].argmax())) for s in states if s != goal])
    np.testing.assert_array_equal(pruned(grid.model, both, goals, 0.9), goals)
    np.testing.assert_array_equal(pruned(grid.model, walk, -goals, 0.9), -goals)


@pytest.mark.parametrize("grid", [5], indirect=True)
def test_who_goes_out_of_the_way_is_not_explained_by_the_end_alone(grid):
    """From the corner to the next one, round three cells in between."""
    goal, start = grid.goal_state, 0
    detour = np.zeros(grid.n_states)
    detour[goal], detour[[1, 5, 6]] = 1.0, -1.0
    _, q = value_iteration(grid.model, detour, 0.9)
    straight = np.where(np.arange(grid.n_states) == goal, 1.0, 0.0)
    _, plain = value_iteration(grid.model, straight, 0.9)
    differs = q.argmax(axis=1) != plain.argmax(axis=1)
    states = [s for s in np.flatnonzero(differs) if s != goal] + [start]
    walk = Demonstrations.from_pairs([(int(s), int(q[s].argmax())) for s in states], 0, end=goal)
    np.testing.assert_array_equal(pruned(grid.model, walk, detour, 0.9), detour)
    easy = Demonstrations.from_pairs([(int(s), int(plain[s].argmax())) for s in (23, 19)], end=goal)
    assert np.flatnonzero(pruned(grid.model, easy, detour, 0.9)).tolist() == [goal]


def test_with_features_nothing_is_pruned(grid, optimal_walks):
    phi = np.eye(grid.n_states)
    kept, left = (
        sparse_planning(
            grid.model, optimal_walks, phi, gamma=0.9, config=SparseConfig(prune=prune)
        )[0]
        for prune in (True, False)
    )
    np.testing.assert_array_equal(kept, left)


def test_a_price_above_all_rewards_is_refused():
    with pytest.raises(InputError, match="sparsity"):
        SparseConfig(sparsity=2.0)
