import numpy as np
import pytest
from scipy.optimize import approx_fprime

from irl.baselines.bellman_gradient import (
    BellmanGradientConfig,
    bellman_gradient,
    smooth_maximum,
)
from irl.baselines.differentiable_planning import HardMax
from irl.baselines.planned_likelihood import PlannedLikelihood
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.planning import value_iteration


@pytest.mark.parametrize(("smoothing", "sharpness"), [("soft", 5.0), ("norm", 60.0)])
@pytest.mark.parametrize("gamma", [0.0, 0.6, 0.95])
def test_gradient_agrees_with_finite_differences(random_model, smoothing, sharpness, gamma):
    rng = np.random.default_rng(5)
    model = random_model(rng, n_states=12, n_actions=3)
    features, weights = rng.normal(size=(12, 4)), rng.normal(size=4)
    rows = rng.integers(model.n_pairs, size=9)
    shown = Demonstrations.from_pairs(
        zip(model.pair_state[rows], model.pair_action[rows], strict=True)
    )
    maximum = smooth_maximum(smoothing, sharpness)
    likelihood = PlannedLikelihood.build(model, shown, gamma, maximum, beta=1.7)
    numeric = approx_fprime(weights, lambda w: likelihood.in_weights(features, w)[0], 1e-6)
    gradient = likelihood.in_weights(features, weights)[1]
    np.testing.assert_allclose(gradient, numeric, rtol=1e-3, atol=2e-5)


@pytest.mark.parametrize("smoothing", ["soft", "norm"])
def test_sharper_comes_nearer_to_the_hard_maximum(random_model, smoothing):
    rng = np.random.default_rng(6)
    model = random_model(rng, n_states=12, n_actions=3)
    reward = rng.random(12) - 0.5
    reward[-1] = -0.5  # the dead end is the least, so that the norm's shift changes no choice
    shown = Demonstrations.from_pairs([(0, int(model.actions_of(0)[0]))])

    def value(maximum):
        return PlannedLikelihood.build(model, shown, 0.9, maximum, 2.0).value_and_gradient(reward)[
            0
        ]

    # The norm plans for the shifted reward: so must what it is compared with.
    reward = reward - reward.min()
    hard = value(HardMax())
    errors = [abs(value(smooth_maximum(smoothing, k)) - hard) for k in (50, 500, 5000)]
    assert errors[2] < errors[0] / 10
    assert errors[2] < 1e-2


@pytest.mark.parametrize("smoothing", ["soft", "norm"])
@pytest.mark.parametrize("grid", [5, 15], indirect=True)
def test_recovers_the_grid(grid, optimal_walks, share_of_optimum, smoothing):
    R, weights = bellman_gradient(
        grid.model,
        optimal_walks,
        gamma=0.9,
        config=BellmanGradientConfig(max_iterations=60, smoothing=smoothing),
    )
    np.testing.assert_array_equal(R, weights)
    _, Q = value_iteration(grid.model, R, 0.9)
    assert share_of_optimum(Q.argmax(axis=1)).mean() >= 0.99


def test_bad_arguments_are_named(chain):
    walk = Demonstrations.from_pairs([(0, 1), (1, 1)])
    with pytest.raises(InputError, match=r"smoothing.*soft, norm"):
        BellmanGradientConfig(smoothing="sharp")
    with pytest.raises(InputError, match="higher order"):
        config = BellmanGradientConfig(smoothing="norm", sharpness=10)
        bellman_gradient(chain, walk, gamma=0.99, config=config)
    with pytest.raises(InputError, match="sharpness"):
        BellmanGradientConfig(sharpness=0.0)
    with pytest.raises(InputError, match="beta"):
        BellmanGradientConfig(beta=0.0)
