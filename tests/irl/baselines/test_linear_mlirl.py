import numpy as np
import pytest
from scipy.optimize import approx_fprime

from irl.baselines.differentiable_planning import HardMax
from irl.baselines.linear_mlirl import MlirlConfig, linear_mlirl
from irl.baselines.planned_likelihood import PlannedLikelihood
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.planning import value_iteration


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("gamma", [0.0, 0.6, 0.95])
def test_gradient_agrees_with_finite_differences(random_model, seed, gamma):
    rng = np.random.default_rng(seed)
    model = random_model(rng, n_states=12, n_actions=3)
    features, weights = rng.normal(size=(12, 4)), rng.normal(size=4)
    rows = rng.integers(model.n_pairs, size=9)
    shown = Demonstrations.from_pairs(
        zip(model.pair_state[rows], model.pair_action[rows], strict=True)
    )
    likelihood = PlannedLikelihood.build(model, shown, gamma, HardMax(), beta=1.7)
    numeric = approx_fprime(weights, lambda w: likelihood.in_weights(features, w)[0], 1e-6)
    gradient = likelihood.in_weights(features, weights)[1]
    np.testing.assert_allclose(gradient, numeric, atol=1e-4)


def test_likelihood_is_that_of_the_boltzmann_policy(chain):
    reward, beta = np.array([0.1, -0.2, 0.3, 1.0]), 2.5
    shown = Demonstrations.from_pairs([(0, 1), (2, 1), (2, 0)])
    value, _ = PlannedLikelihood.build(chain, shown, 0.9, HardMax(), beta).value_and_gradient(
        reward
    )
    _, Q = value_iteration(chain, reward, 0.9)
    e = np.exp(beta * Q[:3])
    pi = e / e.sum(axis=1, keepdims=True)
    assert value == pytest.approx(np.log([pi[0, 1], pi[2, 1], pi[2, 0]]).mean())


def test_one_choice_has_its_closed_form():
    fork = TransitionModel.from_entries(
        3, 2, np.array([0, 0]), np.array([0, 1]), np.array([1, 2]), np.ones(2)
    )
    choices = Demonstrations.from_pairs([(0, 0), (0, 0), (0, 1), (0, 0)])
    R, weights = linear_mlirl(
        fork, choices, gamma=0.9, config=MlirlConfig(tolerance=1e-9, beta=2.0)
    )
    # Three times in four: 2 (R(1) − R(2)) = log 3; the ascent from 0 keeps their sum.
    np.testing.assert_allclose(R, np.array([0, 1, -1]) * np.log(3) / 4, atol=1e-7)
    np.testing.assert_array_equal(R, weights)


@pytest.mark.parametrize("grid", [5, 15], indirect=True)
def test_recovers_the_grid(grid, optimal_walks, share_of_optimum):
    R, _ = linear_mlirl(grid.model, optimal_walks, gamma=0.9, config=MlirlConfig(max_iterations=60))
    assert R.argmax() == grid.goal_state
    _, Q = value_iteration(grid.model, R, 0.9)
    assert share_of_optimum(Q.argmax(axis=1)).mean() >= 0.99


def test_recovers_the_grid_from_few_features(grid, optimal_walks, share_of_optimum):
    indicator = np.eye(grid.n_states)[:, [grid.goal_state]]
    features = np.hstack([indicator, grid.features])
    R, weights = linear_mlirl(grid.model, optimal_walks, features, gamma=0.9)
    np.testing.assert_allclose(R, features @ weights)
    _, Q = value_iteration(grid.model, R, 0.9)
    assert share_of_optimum(Q.argmax(axis=1)).min() >= 0.99


def test_bad_arguments_are_named(chain):
    walk = Demonstrations.from_pairs([(0, 1), (1, 1)])
    with pytest.raises(InputError, match="at least one"):
        linear_mlirl(chain, Demonstrations.empty(), gamma=0.9)
    with pytest.raises(InputError, match="infeasible"):
        linear_mlirl(chain, Demonstrations.from_pairs([(3, 1)]), gamma=0.9)
    with pytest.raises(InputError, match="gamma"):
        linear_mlirl(chain, walk, gamma=1.0)
    with pytest.raises(InputError, match="beta"):
        MlirlConfig(beta=0.0)
    with pytest.raises(InputError, match="features"):
        linear_mlirl(chain, walk, np.zeros((3, 2)), gamma=0.9)
