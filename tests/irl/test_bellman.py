import numpy as np
import pytest

from irl.bellman import BellmanTerm
from irl.domains.gridworld import GridWorld
from irl.errors import InputError

GAMMA = 0.9
LAST = 29  # the terminal state of the random model


@pytest.fixture
def model(random_model):
    return random_model(np.random.default_rng(0))


def whole(model, fixed=None, delta=0.05):
    term = BellmanTerm(model, GAMMA, fixed, batch=10**6, delta=delta)
    return term.draw(np.random.default_rng(0))


def test_gradients_agree_with_finite_differences(model):
    batch = whole(model, {LAST: -1.0})
    f = np.random.default_rng(1).uniform(-0.2, 0.2, batch.states.size)
    _, df, dconstant = batch.value_and_gradient(f, 0.01)
    h = 1e-7
    for i, step in enumerate(np.eye(f.size) * h):
        up, down = (batch.value_and_gradient(f + s, 0.01)[0] for s in (step, -step))
        assert (up - down) / (2 * h) == pytest.approx(df[i], abs=1e-6)
    up, down = (batch.value_and_gradient(f, 0.01 + s)[0] for s in (h, -h))
    assert (up - down) / (2 * h) == pytest.approx(dconstant, abs=1e-6)
    assert df[batch.states == LAST] == 0


def test_true_values_of_a_step_cost_are_penalised_at_the_goal_alone():
    world = GridWorld(5, (2, 2))
    distance = np.abs(world.cells - world.goal).sum(axis=1)
    # −1 a step, for ever 0 at the goal: f(s) = −Σ_{k<d} γ^k.
    f = -(1 - GAMMA**distance) / (1 - GAMMA)
    batch = whole(world.model)
    rewards = batch.rewards(f[batch.states])
    goal = batch.seen.states == world.goal_state
    np.testing.assert_allclose(rewards[~goal], -1, atol=1e-12)
    value, *_ = batch.value_and_gradient(f[batch.states], -1.0)
    # At the goal the best neighbour is worth −1: R = γ, deviation 1 + γ.
    assert value == pytest.approx((1 + GAMMA - 0.05 / 2) / 25)


def test_batches_are_distinct_eligible_states_and_follow_the_seed(model):
    term = BellmanTerm(model, GAMMA, {0: 0.5}, batch=6)
    draws = [term.draw(np.random.default_rng(3)).seen.states for _ in range(2)]
    assert draws[0].tolist() == draws[1].tolist()
    assert np.unique(draws[0]).size == 6
    assert not np.isin(draws[0], [0, LAST]).any()


@pytest.mark.parametrize(
    ("options", "field"),
    [({"gamma": 1.5}, "gamma"), ({"batch": 0}, "bellman_batch"), ({"delta": 0}, "bellman_delta")],
)
def test_bad_options_are_named(model, options, field):
    with pytest.raises(InputError, match=field):
        BellmanTerm(model, **({"gamma": GAMMA} | options))
