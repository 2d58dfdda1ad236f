import numpy as np
import pytest

from irl.baselines.sparse_planning import SparseConfig, sparse_planning
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
                grid.model, optimal_walks, gamma=0.9, config=SparseConfig(sparsity=share)
            )[0]
        )
        for share in (0.01, 0.3, 1.0)
    ]
    assert used[0] > used[1] > used[2] == 0


def test_a_price_above_all_rewards_is_refused():
    with pytest.raises(InputError, match="sparsity"):
        SparseConfig(sparsity=2.0)
