from itertools import product

import numpy as np
import pytest

from irl.errors import InputError
from irl.evaluation import expected_value_difference, policy_value, regret
from irl.mdp import TransitionModel
from irl.planning import value_iteration

N, M, GAMMA = 5, 3, 0.9


@pytest.fixture
def table():
    """P[s, a, s'] and its rewards; action 2 cannot be done in state 1, and nothing in state 4."""
    rng = np.random.default_rng(0)
    P = rng.dirichlet(np.full(N, 0.4), size=(N, M))
    mask = np.ones((N, M), dtype=bool)
    mask[1, 2] = False
    mask[4] = False
    return P, mask, rng.normal(size=N), rng.normal(size=(N, M))


@pytest.fixture
def model(table):
    return TransitionModel.from_dense(table[0], table[1])


def by_dense_solve(table, policy, ends=()):
    """V^π from the table itself, state by state and action by action."""
    P, mask, R, r = table
    A, b = np.eye(N), np.zeros(N)
    for s, a in product(range(N), range(M)):
        if mask[s, a] and s not in ends:
            A[s] -= GAMMA * policy[s, a] * P[s, a]
            b[s] += policy[s, a] * (r[s, a] + P[s, a] @ R)
    return np.linalg.solve(A, b)


def soft(mask, rng):
    """A policy by chance, rows summing to 1 wherever something can be done."""
    weights = rng.random(mask.shape) * mask
    return weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-300)


@pytest.mark.parametrize("ends", [(), (0,), (0, 3)])
def test_the_value_of_a_policy_is_the_dense_solution(table, model, ends):
    _, mask, R, r = table
    pair_reward = r[model.pair_state, model.pair_action]
    for seed in range(5):
        policy = soft(mask, np.random.default_rng(seed))
        found = policy_value(model, policy, R, GAMMA, pair_reward, np.array(ends, int))
        np.testing.assert_allclose(found, by_dense_solve(table, policy, ends), atol=1e-12)
        action = policy.argmax(axis=1)
        single = np.eye(M)[action]
        found = policy_value(model, action, R, GAMMA, pair_reward, np.array(ends, int))
        np.testing.assert_allclose(found, by_dense_solve(table, single, ends), atol=1e-12)
    assert found[4] == 0
    assert not found[list(ends)].any()


def test_a_large_matrix_is_solved_without_filling_it():
    n = 3000
    rng = np.random.default_rng(0)
    state = np.repeat(np.arange(n), 20)
    after = rng.integers(n, size=state.size)
    state, after = np.unique(np.stack([state, after]), axis=1)
    p = 1 / np.bincount(state)[state]
    model = TransitionModel.from_entries(n, 1, state, np.zeros_like(state), after, p)
    R = rng.normal(size=n)
    dense = np.zeros((n, n))
    dense[state, after] = p
    expected = np.linalg.solve(np.eye(n) - 0.99 * dense, dense @ R)
    np.testing.assert_allclose(policy_value(model, np.zeros(n, int), R, 0.99), expected, atol=1e-9)


def every_policy(mask):
    """All deterministic policies, as actions."""
    return product(*(np.flatnonzero(row).tolist() or [0] for row in mask))


def test_regret_is_what_the_best_of_all_policies_earns_more(table, model):
    _, mask, R, r = table
    rewards = (R, GAMMA, r[model.pair_state, model.pair_action])
    value = {p: by_dense_solve(table, np.eye(M)[list(p)]) for p in every_policy(mask)}
    best = max(value.values(), key=lambda v: v.sum())
    for policy, V in list(value.items())[::7]:
        assert (best - V).min() > -1e-12
        found = regret(model, np.array(policy), *rewards)
        np.testing.assert_allclose(found, best - V, atol=1e-9)
        assert (found >= 0).all()
        uneven = [0.1, 0.2, 0.3, 0.4, 0]
        for start, share in (([0, 2], [0.5, 0, 0.5, 0, 0]), (uneven, uneven)):
            evd = expected_value_difference(
                model, np.array(policy), R, GAMMA, np.array(start), rewards[2]
            )
            assert evd == pytest.approx(np.array(share) @ (best - V), abs=1e-9)
    mixed = soft(mask, np.random.default_rng(1))
    np.testing.assert_allclose(
        regret(model, mixed, *rewards), best - by_dense_solve(table, mixed), atol=1e-9
    )


def test_the_optimum_regrets_nothing(table, model):
    _, mask, R, _ = table
    _, Q = value_iteration(model, R, GAMMA)
    assert regret(model, Q.argmax(axis=1), R, GAMMA).max() < 1e-12
    worst = Q.copy()
    worst[~mask] = np.inf
    assert regret(model, worst.argmin(axis=1), R, GAMMA)[:4].min() > 0.01
    # With rewards below 0 doing nothing would be best, were it allowed.
    _, Q = value_iteration(model, R - 9, GAMMA)
    assert regret(model, Q.argmax(axis=1), R - 9, GAMMA).max() < 1e-12


def test_what_cannot_be_followed_is_named(table, model):
    _, mask, R, _ = table
    good = soft(mask, np.random.default_rng(0))

    def changed(entries, base=good):
        policy = np.array(base)
        for place, value in entries.items():
            policy[place] = value
        return policy

    first = good.argmax(axis=1)
    for policy, words in (
        (changed({3: -1}, first), "policy: does none in state 3; valid: 0, 1, 2"),
        (changed({1: 2}, first), "does action 2, which is not feasible in state 1; valid: 0, 1"),
        (first[:4], "5 actions wanted, got 4"),
        (changed({3: 3}, first), r"policy: actions: must lie in -1…2, is 3 in row 3"),
        (first.astype(float), "policy: actions: integers .* got floats"),
        (good.T, r"probabilities \[5, 3\] wanted, got float64 \[3, 5\]"),
        (changed({(1, 2): 0.5}), "state 1, action 2: 0.5 is not feasible; valid: 0 but for"),
        (changed({(0, 1): -0.5}), "state 0, action 1: -0.5 is not a probability"),
        (changed({(0, 1): np.nan}), "state 0, action 1: nan is not a probability"),
        (changed({0: 0.0}), "the probabilities of state 0 must sum to 1, sum to 0"),
    ):
        with pytest.raises(InputError, match=words):
            policy_value(model, policy, R, GAMMA)
    # Where nothing can be done, or a run has ended, anything will do.
    assert policy_value(model, changed({4: -1}, first), R, GAMMA)[4] == 0
    assert policy_value(model, changed({0: -1}, first), R, GAMMA, terminal=np.array([0]))[0] == 0


def test_probabilities_of_float32_are_near_enough(table, model):
    _, mask, R, _ = table
    policy = soft(mask, np.random.default_rng(0))
    np.testing.assert_allclose(
        policy_value(model, policy.astype(np.float32), R, GAMMA),
        by_dense_solve((*table[:3], np.zeros((N, M))), policy),
        atol=1e-6,
    )


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"gamma": 1.0}, "policy value: gamma"),
        ({"gamma": np.nan}, "policy value: gamma"),
        ({"state_reward": np.full(N, np.nan)}, "state_reward: finite numbers"),
        (
            {"state_reward": np.zeros(N - 1)},
            r"state_reward: finite numbers \[5\] wanted, or of pairs \[5, 3\], got \[4\]",
        ),
        ({"pair_reward": np.inf}, "pair_reward: one finite"),
        (
            {"pair_reward": np.zeros(3)},
            r"pair_reward: one finite number wanted, or \[11\], got \[3\]",
        ),
        ({"start": []}, "start: at least one"),
        ({"start": [5]}, "start: must lie in 0…4"),
        ({"start": [0.5, 0.4, 0, 0, 0]}, "start: probabilities that sum to 1"),
        ({"start": [1.5, -0.5, 0, 0, 0]}, "start: probabilities"),
        ({"terminal": [9]}, "terminal: must lie in 0…4"),
    ],
)
def test_rewards_starts_and_discounts_are_checked(model, given, words):
    good = {"state_reward": np.zeros(N), "gamma": GAMMA, "start": [0]}
    with pytest.raises(InputError, match=words):
        expected_value_difference(model, np.zeros(N, int), **(good | given))


def test_values_that_no_number_holds_are_refused(model):
    with pytest.raises(InputError, match=r"state_reward: too large for γ = 0.9"):
        policy_value(model, np.zeros(N, int), np.full(N, 1.5e308), GAMMA)
