import numpy as np
import pytest

from irl.baselines.linear_mlirl import MlirlConfig, linear_mlirl
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.planning import value_iteration


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


def test_choices_without_temperature_are_refused():
    with pytest.raises(InputError, match="beta"):
        MlirlConfig(beta=0.0)
