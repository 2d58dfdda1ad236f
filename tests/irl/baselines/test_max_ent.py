import numpy as np
import pytest
from scipy.optimize import approx_fprime

from irl.baselines.ascent import RidgeConfig
from irl.baselines.max_ent import FeatureMatching, max_ent
from irl.demonstrations import Demonstrations
from irl.demonstrators import PolicyDemonstrator
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.planning import value_iteration


def random_walks(model, rng, lengths) -> Demonstrations:
    """One walk of each length, cut short in states without actions."""
    anything = PolicyDemonstrator(model, model.mask)
    return Demonstrations.from_trajectories(
        anything.trajectory(int(rng.integers(model.n_states - 1)), rng, length)
        for length in lengths
    )


@pytest.mark.parametrize("seed", range(3))
def test_gradient_agrees_with_finite_differences(stochastic, seed):
    rng = np.random.default_rng(seed)
    features = rng.normal(size=(stochastic.n_states, 5))
    walks = random_walks(stochastic, rng, [6, 3, 1, 6])
    problem = FeatureMatching.build(stochastic, walks, features)
    weights = rng.normal(size=5)
    _, gradient = problem.value_and_gradient(weights)
    numeric = approx_fprime(weights, lambda w: problem.value_and_gradient(w)[0], 1e-7)
    np.testing.assert_allclose(gradient, numeric, atol=1e-5)


def test_without_chance_the_objective_is_the_log_likelihood(
    grid, optimal_walks, dense_soft_policies
):
    rng = np.random.default_rng(0)
    reward = rng.normal(size=grid.n_states)
    walks = Demonstrations.concatenate(
        [optimal_walks, Demonstrations.from_pairs([(7, 0), (8, 1)], trajectory=9)]
    )
    value, gradient = FeatureMatching.build(grid.model, walks).value_and_gradient(reward)

    def log_likelihood(reward):
        policies, total = dense_soft_policies(grid.model, reward, 10), 0.0
        for name in np.unique(walks.trajectory):
            pairs = walks.select(walks.trajectory == name).pairs
            for to_go, pair in zip(range(len(pairs), 0, -1), pairs, strict=True):
                total += np.log(policies[to_go - 1][pair])
        return total / np.unique(walks.trajectory).size

    assert value == pytest.approx(log_likelihood(reward))
    numeric = approx_fprime(reward, log_likelihood, 1e-7)
    np.testing.assert_allclose(gradient, numeric, atol=1e-5)


def test_one_choice_has_its_closed_form():
    fork = TransitionModel.from_entries(
        3, 2, np.array([0, 0]), np.array([0, 1]), np.array([1, 2]), np.ones(2)
    )
    # Chosen 3 times in 4, the learnt rewards differ by log 3; l2 then splits it evenly.
    walks = Demonstrations.concatenate(
        [Demonstrations.from_pairs([(0, a)], trajectory=k) for k, a in enumerate((0, 0, 1, 0))]
    )
    R, weights = max_ent(fork, walks, config=RidgeConfig(l2=1e-9))
    assert R[1] - R[2] == pytest.approx(np.log(3), abs=1e-5)
    assert R[1] + R[2] == pytest.approx(0.0, abs=1e-5)
    np.testing.assert_array_equal(R, weights)


@pytest.mark.parametrize("grid", [5, 15], indirect=True)
def test_recovers_the_grid(grid, border_walks, share_of_optimum):
    R, _ = max_ent(grid.model, border_walks)
    assert R.argmax() == grid.goal_state
    _, Q = value_iteration(grid.model, R, 0.9)
    assert share_of_optimum(Q.argmax(axis=1)).min() >= 0.99


def test_the_solution_matches_the_demonstrated_features(stochastic):
    rng = np.random.default_rng(5)
    features = rng.normal(size=(stochastic.n_states, 3))
    walks = random_walks(stochastic, rng, [4] * 6)
    _, weights = max_ent(stochastic, walks, features, config=RidgeConfig(l2=0.01))
    _, gradient = FeatureMatching.build(stochastic, walks, features).value_and_gradient(weights)
    np.testing.assert_allclose(gradient, 0.01 * weights, atol=1e-5)


def test_bad_arguments_are_named(chain):
    walk = Demonstrations.from_pairs([(0, 1), (1, 1), (2, 1)])
    with pytest.raises(InputError, match="at least one"):
        max_ent(chain, Demonstrations.empty())
    with pytest.raises(InputError, match="not feasible"):
        max_ent(chain, Demonstrations.from_pairs([(3, 1)]))
    with pytest.raises(InputError, match="trajectory 0 are not consecutive"):
        max_ent(chain, walk.select([0, 2]))
    with pytest.raises(InputError, match="features"):
        max_ent(chain, walk, np.zeros((3, 2)))
