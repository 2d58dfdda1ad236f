import numpy as np
import pytest

from irl.errors import InputError
from irl.methods import learn
from irl.training_config import TrainingConfig


def log_likelihood(model, q, shown, beta):
    """(3.19) from action values, in the mean."""
    z = beta * q[shown.state]
    peak = z.max(axis=1)
    total = np.log(np.exp(z - peak[:, None]).sum(axis=1)) + peak
    return (z[np.arange(len(shown)), shown.action] - total).mean()


def test_the_likeliest_of_several_networks_is_kept(slippery_grid):
    grid = slippery_grid(9, (2, 5), "stay")
    shown, short = grid.walks(0), TrainingConfig(iterations=40, beta=60.0)

    def fit(seed, networks):
        rng = np.random.default_rng(seed)
        given = (grid.model, shown, grid.features)
        options = {"training": short, "networks": networks}
        return learn("fa_mlirl", *given, gamma=0.99, rng=rng, **options), rng

    later = 0
    for seed in range(3):
        alone, rng = [], np.random.default_rng(seed)
        for _ in range(3):  # the same three, one by one
            learnt = learn(
                "fa_mlirl",
                grid.model,
                shown,
                grid.features,
                gamma=0.99,
                rng=rng,
                training=short,
                networks=1,
            )
            alone.append(learnt.q)
        likely = [log_likelihood(grid.model, q, shown, 60.0) for q in alone]
        together, _ = fit(seed, 3)
        np.testing.assert_array_equal(together.q, alone[int(np.argmax(likely))])
        assert together.iterations == 120
        later += int(np.argmax(likely)) > 0
    assert later  # not always the first


def test_at_least_one_network_is_wanted(slippery_grid):
    grid = slippery_grid(5, (1, 3), "stay")
    given = (grid.model, grid.walks(0), grid.features)
    with pytest.raises(InputError, match="networks: must be ≥ 1"):
        learn("fa_mlirl", *given, gamma=0.9, rng=np.random.default_rng(0), networks=0)


def value_share(grid, goal, seed):
    """What fa_mlirl makes of four walks, as it comes: its value over the optimal one, both < 0."""
    world = grid(51, goal, "stay")
    given = (world.model, world.walks(seed), world.features)
    learnt = learn("fa_mlirl", *given, gamma=world.gamma, rng=np.random.default_rng(seed))
    return world.value(np.eye(4)[learnt.q.argmax(axis=1)]) / world.V.mean()


def test_a_large_slippery_grid_is_learnt_from_four_walks(slippery_grid):
    assert value_share(slippery_grid, (12, 34), 0) <= 1.01


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("goal", [(12, 34), (40, 5), (24, 26)])
def test_large_slippery_grids_are_learnt_whatever_the_seed(slippery_grid, goal, seed):
    assert value_share(slippery_grid, goal, seed) <= 1.01
