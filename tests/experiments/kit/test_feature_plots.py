import numpy as np
import pytest
from matplotlib.figure import Figure

from experiments.kit.feature_plots import expected_visits, of_states, plane, plot_over_features
from experiments.own_task import workshop


def test_visits_are_those_of_the_chain_step_by_step():
    model = workshop(parts=3, worn_out=2).model
    rng = np.random.default_rng(0)
    action = np.array([rng.choice(model.actions_of(s)) for s in range(model.n_states)])
    rows = model.pair_index(np.arange(model.n_states), action)
    P, now, expected = model.P[rows].toarray(), np.zeros(model.n_states), np.zeros(model.n_states)
    now[[0, 4]] = 0.5
    for t in range(400):
        expected += 0.9**t * now
        now = now @ P
    np.testing.assert_allclose(
        expected_visits(model, action, np.array([0, 4]), 0.9), expected, atol=1e-12
    )


def test_of_a_reward_of_pairs_a_state_shows_that_of_what_is_done():
    reward = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
    np.testing.assert_array_equal(of_states(reward, np.array([1, 0, -1])), [2.0, 3.0, np.nan])
    np.testing.assert_array_equal(of_states(reward[:, 0], np.array([1, 0, -1])), [1.0, 3.0, 5.0])


def test_two_features_are_the_axes_and_more_are_brought_to_two():
    rng = np.random.default_rng(0)
    two = rng.normal(size=(30, 2))
    places, labels = plane(two, ("made", "wear"))
    np.testing.assert_array_equal(places, two)
    assert labels == ["made", "wear"]
    one, labels = plane(two[:, :1])
    assert (one[:, 1] == 0).all()
    assert labels == ["feature 0", ""]
    # Five features that are copies of two, and one that never varies: nothing is lost.
    five = np.hstack([two, -two, np.ones((30, 1))])
    places, labels = plane(five)
    assert places.shape == (30, 2)
    shares = [int(label.split("(")[1].split("%")[0]) for label in labels]
    assert sum(shares) == pytest.approx(100, abs=1)


def test_states_in_one_place_share_their_mean_and_unknown_ones_stay_empty():
    figure = Figure()
    features = np.array([[0.0], [0.0], [1.0], [2.0]])
    plot_over_features(
        figure, features, {"a": np.array([1.0, 3.0, 5.0, np.nan]), "b": np.ones(4)}, "Sentence."
    )
    figure.canvas.draw()
    empty, dots = figure.axes[0].collections
    np.testing.assert_array_equal(empty.get_offsets(), [[2, 0]])
    np.testing.assert_array_equal(dots.get_array(), [2.0, 5.0])
