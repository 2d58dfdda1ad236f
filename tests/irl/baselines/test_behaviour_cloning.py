import numpy as np
import pytest
from scipy.optimize import approx_fprime

from irl.baselines.ascent import RidgeConfig
from irl.baselines.behaviour_cloning import behaviour_cloning, value_and_gradient
from irl.demonstrations import Demonstrations
from irl.domains.gridworld import ACTIONS
from irl.errors import InputError
from irl.likelihood import LikelihoodProblem
from irl.policy import Policy


@pytest.mark.parametrize("seed", range(3))
def test_gradient_agrees_with_finite_differences(stochastic, seed):
    rng = np.random.default_rng(seed)
    rows = rng.integers(stochastic.n_pairs, size=9)
    problem = LikelihoodProblem.build(
        stochastic, stochastic.pair_state[rows], stochastic.pair_action[rows]
    )
    inputs, weights = rng.normal(size=(12, 4)), rng.normal(size=(4, 3))

    def evaluate(flat):
        return value_and_gradient(stochastic, problem, inputs, flat.reshape(4, 3))

    numeric = approx_fprime(weights.ravel(), lambda w: evaluate(w)[0], 1e-7)
    np.testing.assert_allclose(evaluate(weights)[1].ravel(), numeric, atol=1e-5)


def test_choices_have_their_frequencies(chain):
    choices = Demonstrations.from_pairs([(0, 0), (0, 1), (2, 1), (0, 1), (0, 1)])
    log_pi, _ = behaviour_cloning(chain, choices, config=RidgeConfig(l2=1e-7))
    np.testing.assert_allclose(np.exp(log_pi[0]), [1 / 4, 3 / 4], atol=1e-4)
    assert np.exp(log_pi[2, 1]) > 0.99
    assert np.isneginf(log_pi[3]).all()


def test_probabilities_are_those_of_feasible_actions(stochastic):
    rng = np.random.default_rng(0)
    pairs = [(0, int(stochastic.actions_of(0)[0]))]
    log_pi, weights = behaviour_cloning(
        stochastic, Demonstrations.from_pairs(pairs), rng.normal(size=(12, 2))
    )
    assert weights.shape == (3, 3)
    np.testing.assert_array_equal(np.isfinite(log_pi), stochastic.mask)
    np.testing.assert_allclose(np.exp(log_pi).sum(axis=1)[:-1], 1.0)


def test_clones_the_grid_where_it_was_demonstrated(grid, optimal_walks, share_of_optimum):
    log_pi, _ = behaviour_cloning(grid.model, optimal_walks)
    policy = Policy.from_q(log_pi, grid.model.mask).action
    # Nothing was shown at the goal itself, where every action is as good: one step and back.
    shown = np.unique(optimal_walks.state)
    np.testing.assert_array_equal(policy[optimal_walks.state], optimal_walks.action)
    policy[grid.goal_state] = grid.model.actions_of(grid.goal_state)[0]
    assert share_of_optimum(policy)[shown].min() >= 0.99


def test_features_carry_the_choice_to_states_not_shown(grid):
    # Right of the middle column everyone goes left, left of it right.
    row = [(grid.index(x, 2), ACTIONS.index("right" if x < 2 else "left")) for x in (0, 1, 3, 4)]
    log_pi, _ = behaviour_cloning(grid.model, Demonstrations.from_pairs(row), grid.features)
    x = grid.cells[:, 0]
    policy = log_pi.argmax(axis=1)
    assert (policy[x < 2] == ACTIONS.index("right")).all()
    assert (policy[x > 2] == ACTIONS.index("left")).all()


def test_the_fit_is_deterministic(grid, optimal_walks):
    first, second = (behaviour_cloning(grid.model, optimal_walks, grid.features) for _ in range(2))
    np.testing.assert_array_equal(first[0], second[0])
    np.testing.assert_array_equal(first[1], second[1])


def test_bad_arguments_are_named(chain):
    walk = Demonstrations.from_pairs([(0, 1), (1, 1)])
    with pytest.raises(InputError, match="at least one"):
        behaviour_cloning(chain, Demonstrations.empty())
    with pytest.raises(InputError, match="infeasible"):
        behaviour_cloning(chain, Demonstrations.from_pairs([(3, 1)]))
    with pytest.raises(InputError, match="l2"):
        behaviour_cloning(chain, walk, config=RidgeConfig(l2=0.0))
    with pytest.raises(InputError, match="features"):
        behaviour_cloning(chain, walk, np.zeros((3, 2)))
