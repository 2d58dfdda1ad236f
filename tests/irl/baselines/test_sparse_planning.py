import numpy as np
import pytest
from scipy.optimize import approx_fprime

from irl.baselines.differentiable_planning import SoftMax
from irl.baselines.planned_likelihood import PlannedLikelihood
from irl.baselines.sparse_planning import SparseConfig, sparse_planning
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.planning import value_iteration


def test_likelihood_is_that_of_the_soft_optimal_policy(chain):
    shown = Demonstrations.from_pairs([(0, 1), (2, 1), (2, 0)])
    likelihood = PlannedLikelihood.build(chain, shown, 0.9, SoftMax(), beta=1.0)
    reward = np.array([0.1, -0.2, 0.3, 1.0])
    value, _ = likelihood.value_and_gradient(reward)
    V = np.zeros(4)
    for _ in range(1000):
        Q = chain.q_values(reward + 0.9 * V)
        V[:3] = np.log(np.exp(Q[:3]).sum(axis=1))
    log_pi = Q[:3] - V[:3, None]
    assert value == pytest.approx((log_pi[0, 1] + log_pi[2, 1] + log_pi[2, 0]) / 3)


@pytest.mark.parametrize("gamma", [0.0, 0.6, 0.95])
def test_gradient_agrees_with_finite_differences(random_model, gamma):
    rng = np.random.default_rng(4)
    model = random_model(rng, n_states=12, n_actions=3)
    features, weights = rng.normal(size=(12, 4)), rng.normal(size=4)
    rows = rng.integers(model.n_pairs, size=9)
    shown = Demonstrations.from_pairs(
        zip(model.pair_state[rows], model.pair_action[rows], strict=True)
    )
    likelihood = PlannedLikelihood.build(model, shown, gamma, SoftMax(), beta=1.0)
    numeric = approx_fprime(weights, lambda w: likelihood.in_weights(features, w)[0], 1e-6)
    gradient = likelihood.in_weights(features, weights)[1]
    np.testing.assert_allclose(gradient, numeric, atol=1e-5)


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


def test_bad_arguments_are_named(chain):
    walk = Demonstrations.from_pairs([(0, 1), (1, 1)])
    with pytest.raises(InputError, match="at least one"):
        sparse_planning(chain, Demonstrations.empty(), gamma=0.9)
    with pytest.raises(InputError, match="gamma"):
        sparse_planning(chain, walk, gamma=1.0)
    with pytest.raises(InputError, match="sparsity"):
        SparseConfig(sparsity=2.0)
    with pytest.raises(InputError, match="features"):
        sparse_planning(chain, walk, np.zeros((3, 2)), gamma=0.9)
