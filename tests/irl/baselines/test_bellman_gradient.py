import numpy as np
import pytest

from irl.baselines.bellman_gradient import (
    BellmanGradientConfig,
    smooth_maximum,
)
from irl.baselines.differentiable_planning import HardMax
from irl.baselines.linear_mlirl import linear_mlirl
from irl.baselines.planned_likelihood import PlannedLikelihood
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.planning import value_iteration


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
    R, weights = linear_mlirl(
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
        linear_mlirl(chain, walk, gamma=0.99, config=config)
    with pytest.raises(InputError, match="sharpness"):
        BellmanGradientConfig(sharpness=0.0)
    with pytest.raises(InputError, match="beta"):
        BellmanGradientConfig(beta=0.0)
