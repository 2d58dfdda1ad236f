import numpy as np
import pytest

from irl.baselines.soft_walks import SoftWalks
from irl.mdp import TransitionModel


@pytest.mark.parametrize("seed", range(3))
def test_choices_agree_with_dense_tables(random_model, dense_soft_policies, seed):
    rng = np.random.default_rng(seed)
    model = random_model(rng, n_states=12, n_actions=5)
    reward = 3 * rng.normal(size=12)
    walks = SoftWalks(model)
    policy, V = walks.backward(reward, 6)
    assert np.bincount(walks.pairs, minlength=model.n_pairs).tolist() == [1] * model.n_pairs
    state, action = model.pair_state[walks.pairs], model.pair_action[walks.pairs]
    for row, dense in zip(policy, dense_soft_policies(model, reward, 6), strict=True):
        np.testing.assert_allclose(row, dense[state, action])
    assert not V[0].any()
    assert not V[:, -1].any()  # nothing to do in the last state


def test_entries_agree_with_dense_propagation(stochastic, dense_soft_policies):
    rng = np.random.default_rng(1)
    n, horizon = stochastic.n_states, 7
    reward, starts = rng.normal(size=n), rng.random((horizon + 1, n))
    starts[4] = 0.0
    walks = SoftWalks(stochastic)
    policy, _ = walks.backward(reward, horizon)
    cube = np.zeros((n, stochastic.n_actions, n))
    cube[stochastic.pair_state, stochastic.pair_action] = stochastic.P.toarray()
    expected = np.zeros(n)
    policies = dense_soft_policies(stochastic, reward, horizon)
    for begin in range(1, horizon + 1):  # every start on its own
        here = starts[begin]
        for to_go in range(begin, 0, -1):
            here = np.einsum("s,sa,sat->t", here, policies[to_go - 1], cube)
            expected += here
    np.testing.assert_allclose(walks.entries(policy, starts), expected)


def test_one_choice_has_its_closed_form():
    fork = TransitionModel.from_entries(
        3, 2, np.array([1, 1]), np.array([0, 1]), np.array([0, 2]), np.ones(2)
    )
    walks = SoftWalks(fork)
    policy, V = walks.backward(np.array([0.7, 9.0, 0.2]), 1)
    assert policy[0, 0] / policy[0, 1] == pytest.approx(np.exp(0.7 - 0.2))
    np.testing.assert_allclose(V, [[0, 0, 0], [0, np.log(np.exp(0.7) + np.exp(0.2)), 0]])
    starts = np.array([[0.0, 0.0, 0.0], [0.0, 2.0, 5.0]])
    entered = walks.entries(policy, starts)
    np.testing.assert_allclose(entered, [2 * policy[0, 0], 0, 2 * policy[0, 1]])


def test_large_rewards_neither_overflow_nor_underflow():
    fork = TransitionModel.from_entries(
        3, 2, np.array([0, 0]), np.array([0, 1]), np.array([1, 2]), np.ones(2)
    )
    for size in (-1e5, 1e5):
        policy, V = SoftWalks(fork).backward(np.array([0.0, size, size + 1.0]), 1)
        np.testing.assert_allclose(policy[0], [1 / (1 + np.e), np.e / (1 + np.e)], rtol=1e-9)
        assert V[1, 0] == pytest.approx(size + np.log(1 + np.e), abs=1e-9)
