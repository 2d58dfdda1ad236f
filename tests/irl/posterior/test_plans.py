import numpy as np
import pytest

from irl.domains.gridworld import GridWorld
from irl.mdp import TransitionModel
from irl.planning import value_iteration
from irl.posterior.plans import HardPlans

GAMMA = 0.9


def slippery(rng):
    """Random successors and a random number of actions; two states cannot act."""
    state, action, after, p = [], [], [], []
    for s in range(38):
        for a in range(1 + rng.integers(5)):
            to = rng.choice(40, 3, replace=False)
            share = rng.dirichlet(np.ones(3))
            state += [s] * 3
            action += [a] * 3
            after += to.tolist()
            p += share.tolist()
    return TransitionModel.from_entries(40, 5, *map(np.array, (state, action, after, p)))


@pytest.mark.parametrize("seed", range(3))
def test_every_column_is_what_value_iteration_finds_for_it_alone(seed):
    rng = np.random.default_rng(seed)
    model = slippery(rng)
    costs = np.column_stack([rng.random((model.n_pairs, 2)), np.ones(model.n_pairs)])
    plans = HardPlans(model, GAMMA, costs, {39: -1.0})
    goals = rng.random((40, 7)) < 0.08
    goals[39], goals[0] = False, True
    sizes = rng.random((3, 7)) * 0.1
    f = plans.vr_values(goals, sizes)
    for k in range(7):
        reward = goals[:, k].astype(float)
        reward[39] = -1.0
        ends = np.flatnonzero(goals[:, k] | (np.arange(40) == 39))
        V, Q = value_iteration(model, reward, GAMMA, -costs @ sizes[:, k], ends)
        np.testing.assert_allclose(f[:, k], reward + GAMMA * V, atol=2e-3)
        q = model.table(plans.q(f[:, [k]], sizes[:, [k]])[:, 0])
        np.testing.assert_allclose(q[np.isfinite(Q)], Q[np.isfinite(Q)], atol=2e-3)


def test_pairs_that_lead_and_cost_alike_share_their_work():
    grid = GridWorld(9, (4, 4))
    model = grid.model
    plans = HardPlans(model, GAMMA, np.ones((model.n_pairs, 1)), {})
    leads, pays, led, paid = plans._shared
    assert leads.size == model.n_states  # every cell is a pair's only outcome
    assert pays.size == 1
    assert led.shape == paid.shape == (model.n_pairs,)
    # Numbered in the order in which they are looked up.
    _, met = np.unique(led, return_index=True)
    assert (np.diff(met) > 0).all()


def test_no_hypothesis_is_no_work():
    model = GridWorld(5, (2, 2)).model
    plans = HardPlans(model, GAMMA, np.ones((model.n_pairs, 1)), {})
    assert plans.vr_values(np.zeros((25, 0), bool), np.zeros((1, 0))).shape == (25, 0)
