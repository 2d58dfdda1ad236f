import time

import numpy as np
import pytest

from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.onward import Onward
from irl.planning import (
    backup,
    best,
    policy_success,
    transition_matrix,
    uniform_policy,
    value_iteration,
)
from irl.rewards import pair_rewards


def test_chain_has_its_closed_form_values(chain):
    gamma, cost = 0.9, 0.1
    V, Q = value_iteration(chain, np.array([0, 0, 0, 1.0]), gamma, pair_reward=-cost, terminal=[3])
    v2 = 1 - cost
    # v = 0.9 γ v_next + 0.1 γ v − cost, solved for v.
    v1 = (0.9 * gamma * v2 - cost) / (1 - 0.1 * gamma)
    v0 = (0.9 * gamma * v1 - cost) / (1 - 0.1 * gamma)
    np.testing.assert_allclose(V, [v0, v1, v2, 0], atol=1e-9)
    assert Q[0, 1] == pytest.approx(v0)
    assert Q[2, 0] == pytest.approx(gamma * v1 - cost)
    assert np.isneginf(Q[3]).all()


@pytest.mark.parametrize("seed", range(3))
def test_values_solve_the_linear_system_of_their_own_greedy_policy(random_model, seed):
    rng = np.random.default_rng(seed)
    model = random_model(rng)
    R = rng.normal(size=model.n_states)
    r = rng.normal(size=model.n_pairs)
    gamma, terminal = 0.95, [2, 5]
    V, Q = value_iteration(model, R, gamma, pair_reward=r, terminal=terminal, tolerance=1e-10)
    # Evaluate the greedy policy by a dense solve; then nothing may improve on it.
    dense, rewards = np.zeros((model.n_states, model.n_states)), np.zeros(model.n_states)
    for s in np.flatnonzero(np.isfinite(Q).any(axis=1)):
        row = int(model.pair_index(s, Q[s].argmax()))
        dense[s] = model.P[[row]].toarray()
        rewards[s] = dense[s] @ R + r[row]
    exact = np.linalg.solve(np.eye(model.n_states) - gamma * dense, rewards)
    np.testing.assert_allclose(V, exact, atol=1e-8)
    improved = best(model, backup(model, exact, R, gamma, r), fill=0.0)
    improved[terminal] = 0.0
    assert (improved <= exact + 1e-8).all()


def test_large_rewards_don_t_keep_it_from_ending(chain):
    V, _ = value_iteration(chain, np.full(4, 1e12), 0.99, tolerance=1e-9)
    assert np.isfinite(V).all()


def exact_policy_iteration(model, state_reward, gamma, pair_reward, terminal):
    """V by Howard's policy iteration over dense tables, each policy's value refined."""
    acting = np.setdiff1d(model.acting, terminal)
    earned = model.P @ state_reward + pair_reward
    V, policy = np.zeros(model.n_states), np.full(model.n_states, -1)
    while True:
        Q = model.table(earned + gamma * (model.P @ V))
        better = Q[acting].argmax(axis=1)
        gain = Q[acting].max(axis=1) - Q[acting, policy[acting]]
        change = (policy[acting] < 0) | (gain > 1e-13 * np.abs(V).max())
        if not change.any():
            return V, Q
        policy[acting] = np.where(change, better, policy[acting])
        rows = model.pair_index(acting, policy[acting])
        A, b = np.eye(model.n_states, dtype=np.longdouble), np.zeros(model.n_states)
        A[acting] -= np.longdouble(gamma) * model.P[rows].toarray()
        b[acting] = earned[rows]
        V = np.zeros(model.n_states)
        for _ in range(3):
            left = (b - A @ V).astype(np.float64)
            V = V + np.linalg.solve(A.astype(np.float64), left)


def slippery_grid(n):
    """Four moves; one in five goes astray, evenly to the other sides."""
    x, y = np.divmod(np.arange(n * n), n)
    P = np.zeros((n * n, 4, n * n))
    for side, (dx, dy) in enumerate([(1, 0), (0, 1), (-1, 0), (0, -1)]):
        after = np.clip(x + dx, 0, n - 1) * n + np.clip(y + dy, 0, n - 1)
        for action in range(4):
            P[np.arange(n * n), action, after] += 0.8 if action == side else 0.2 / 3
    return TransitionModel.from_dense(P)


def small_worlds(random_model):
    """Name, model, R, r, terminal: loops, ends, recurring rewards."""
    rng = np.random.default_rng(4)
    chaotic = random_model(rng, n_states=60, n_actions=5)
    yield "random", chaotic, rng.normal(size=60), rng.normal(size=chaotic.n_pairs), []
    yield "random, ends", chaotic, rng.normal(size=60), -1.0, [3, 9]
    yield "tiny rewards", chaotic, 1e-15 * rng.normal(size=60), 0.0, []
    grid = slippery_grid(12)
    yield "grid, recurring", grid, np.eye(144)[17], -0.01, []
    yield "grid, ends", grid, np.eye(144)[17], -0.01, [17]
    n = 200  # a long way to what pays more, past what pays a little for ever
    state = np.arange(n)
    back_and_forth = [np.maximum(state - 1, 0), np.minimum(state + 1, n - 1)]
    chain = TransitionModel.from_entries(
        n,
        2,
        np.tile(state, 2),
        np.repeat([0, 1], n),
        np.concatenate(back_and_forth),
        np.ones(2 * n),
    )
    yield "chain", chain, 0.1 * np.eye(n)[0] + np.eye(n)[n - 1], 0.0, []


@pytest.mark.parametrize("gamma", [0.0, 0.9, 0.9999, 1 - 1e-6])
def test_values_and_actions_are_those_of_exact_policy_iteration(random_model, gamma):
    for name, model, R, r, terminal in small_worlds(random_model):
        began = time.process_time()
        V, Q = value_iteration(model, R, gamma, pair_reward=r, terminal=terminal)
        assert time.process_time() - began < 1, name
        exact, exact_Q = exact_policy_iteration(model, R, gamma, r, terminal)
        scale = np.abs(exact).max()
        assert np.abs(V - exact).max() <= 1e-13 * scale, name
        going = np.setdiff1d(model.acting, terminal)
        lost = exact_Q[going].max(axis=1) - exact_Q[going, Q[going].argmax(axis=1)]
        assert (lost <= 1e-12 * scale).all(), name


def test_actions_that_are_equally_good_have_one_value_and_the_first_is_taken():
    # Two mirrored ways around a slippery grid: by symmetry (x, y) and (y, x) are worth the same.
    n, gamma = 9, 1 - 1e-6
    model = slippery_grid(n)
    _, Q = value_iteration(model, np.eye(n * n)[n * n - 1], gamma)
    diagonal = np.arange(n - 1) * (n + 1)
    assert (Q[diagonal, 0] == Q[diagonal, 1]).all()
    assert (Q[diagonal].argmax(axis=1) == 0).all()


def test_the_same_bits_on_every_run(random_model):
    model = random_model(np.random.default_rng(11), n_states=200, n_actions=4)
    R = np.random.default_rng(12).normal(size=200)
    first = value_iteration(model, R, 0.99999)
    again = value_iteration(model, R, 0.99999)
    assert all((a == b).all() for a, b in zip(first, again, strict=True))


def test_what_cannot_be_factorised_is_swept(monkeypatch):
    monkeypatch.setattr(Onward, "solve", lambda *_: None)
    model = slippery_grid(7)
    V, _ = value_iteration(model, np.eye(49)[9], 0.99, tolerance=1e-10)
    exact, _ = exact_policy_iteration(model, np.eye(49)[9], 0.99, 0.0, [])
    np.testing.assert_allclose(V, exact, atol=1e-10)


def test_best_skips_states_without_actions(chain):
    values = np.array([1.0, 2.0, 5.0, 3.0, -1.0, -2.0])
    assert best(chain, values, fill=-9.0).tolist() == [2.0, 5.0, -1.0, -9.0]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"gamma": 1.0}, "gamma: must be ≥ 0 and < 1"),
        ({"state_reward": np.zeros(3)}, "state_reward: finite numbers"),
        ({"state_reward": np.array([0, 0, 0, np.nan])}, "state_reward: finite numbers"),
        ({"pair_reward": np.zeros(5)}, "pair_reward: one finite number"),
    ],
)
def test_bad_arguments_are_named(chain, arguments, words):
    given = {"state_reward": np.zeros(4), "gamma": 0.9} | arguments
    with pytest.raises(InputError, match=words):
        value_iteration(chain, **given)


def test_success_has_its_closed_form(chain):
    right = np.array([1, 1, 1, -1])
    goal = np.array([3])
    assert policy_success(chain, right, goal, 0).tolist() == [0, 0, 0, 1]
    # From 1: two moves, the first of which may fail.
    np.testing.assert_allclose(policy_success(chain, right, goal, 2), [0, 0.9, 1, 1])
    # From 0 in 4 actions: two moves of 0.9 and a sure one, at most one failure.
    np.testing.assert_allclose(policy_success(chain, right, goal, 4)[0], 0.81 + 2 * 0.1 * 0.81)


def test_doing_nothing_or_the_infeasible_fails(chain):
    goal = np.array([3])
    assert policy_success(chain, np.array([1, -1, 1, 1]), goal, 9).tolist() == [0, 0, 1, 1]
    assert policy_success(chain, np.array([1, 7, 1, 1]), goal, 9).tolist() == [0, 0, 1, 1]


def test_stochastic_success_agrees_with_monte_carlo(random_model):
    rng = np.random.default_rng(5)
    model = random_model(rng, n_states=10, n_actions=3)
    goal, horizon, runs = np.array([4]), 6, 4000
    policy = uniform_policy(model.mask)
    predicted = policy_success(model, policy, goal, horizon)[0]
    reached = 0
    for _ in range(runs):
        state = 0
        for _ in range(horizon):
            if state == 4 or not model.mask[state].any():
                break
            state = model.sample(state, rng.choice(3, p=policy[state]), rng)
        reached += state == 4
    assert abs(reached / runs - predicted) < 4 * np.sqrt(predicted * (1 - predicted) / runs)


def test_deterministic_and_stochastic_forms_agree(chain):
    actions = np.array([1, 0, 1, -1])
    table = np.zeros((4, 2))
    table[[0, 1, 2], [1, 0, 1]] = 1.0
    a, b = transition_matrix(chain, actions), transition_matrix(chain, table)
    np.testing.assert_array_equal(a.toarray(), b.toarray())


def test_wrong_policy_shape_is_named(chain):
    with pytest.raises(InputError, match=r"policy: integer \[4\] or probabilities \[4, 2\]"):
        policy_success(chain, np.zeros(3, dtype=int), np.array([3]), 2)


def test_uniform_policy_spreads_evenly_and_leaves_empty_rows_empty():
    table = uniform_policy(np.array([[True, True], [False, True], [False, False]]))
    np.testing.assert_array_equal(table, [[0.5, 0.5], [0, 1], [0, 0]])


def test_planning_without_pairs_is_zero():
    none = np.zeros(0, dtype=int)
    model = TransitionModel.from_entries(2, 1, none, none, none, np.zeros(0))
    V, Q = value_iteration(model, np.ones(2), 0.5)
    assert V.tolist() == [0, 0]
    assert np.isneginf(Q).all()


def test_rewards_of_every_shape_come_to_what_acting_earns(random_model):
    rng = np.random.default_rng(8)
    model = random_model(rng)
    by_move = rng.normal(size=(30, 4, 30))
    table = np.zeros((30, 4, 30))
    table[model.pair_state, model.pair_action] = model.P.toarray()
    expected = np.einsum("sat,sat->sa", table, by_move)[model.pair_state, model.pair_action]
    np.testing.assert_allclose(pair_rewards(model, by_move), expected, atol=1e-12)
    by_pair = rng.normal(size=(30, 4))
    same = np.repeat(by_pair[:, :, None], 30, axis=2)
    np.testing.assert_allclose(pair_rewards(model, by_pair), pair_rewards(model, same), atol=1e-12)
    by_state = rng.normal(size=30)
    same = np.repeat(by_state[:, None], 4, axis=1)
    np.testing.assert_array_equal(pair_rewards(model, by_state), pair_rewards(model, same))


def test_a_reward_that_does_not_fit_is_refused(chain):
    with pytest.raises(InputError, match=r"reward: \[4\], \[4, 2\] or \[4, 2, 4\] wanted"):
        pair_rewards(chain, np.zeros((2, 4)))
    reward = np.zeros((4, 2))
    reward[3] = np.inf  # nothing can be done there
    assert (pair_rewards(chain, reward) == 0).all()
    reward[1, 0] = np.nan
    with pytest.raises(InputError, match="is nan in state 1 for action 0"):
        pair_rewards(chain, reward)


@pytest.mark.parametrize(("reward", "gamma"), [(1e300, 1 - 1e-6), (1e308, 0.9), (-1e308, 0.5)])
def test_rewards_whose_values_no_float_holds_are_refused(chain, reward, gamma):
    with pytest.raises(InputError, match=r"^state_reward: too large for γ = .*: values overflow"):
        value_iteration(chain, np.full(chain.n_states, reward), gamma)


def test_rewards_that_overflow_together_are_refused(chain):
    with pytest.raises(InputError, match="values overflow"):
        value_iteration(chain, np.full(chain.n_states, 1e308), 0.5, pair_reward=1e308)
