import numpy as np
import pytest
from scipy.optimize import linprog

from irl.baselines.linear_programming import largest_l1, lp, margins
from irl.domains.gridworld import ACTIONS
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.planning import transition_matrix, value_iteration

GAMMA = 0.9


def leads(model: TransitionModel, policy: np.ndarray, gamma: float):
    """(P_π − P_a)(I − γ P_π)⁻¹ for every pair passed over, dense, and the pairs' states."""
    P_pi = transition_matrix(model, policy).toarray()
    inverse = np.linalg.inv(np.eye(model.n_states) - gamma * P_pi)
    rows, states = [], []
    for s, a, row in zip(model.pair_state, model.pair_action, model.P.toarray(), strict=True):
        if policy[s] not in (-1, a):
            rows.append((P_pi[s] - row) @ inverse)
            states.append(s)
    return np.array(rows), np.array(states)


def objective(lead, state, R, l1):
    margins = [(lead[state == s] @ R).min() for s in np.unique(state)]
    return sum(margins) - l1 * np.abs(R).sum()


def dense_optimum(model, policy, gamma, l1, r_max):
    """(3.7) as it is written: variables R, |R| and the minima, with the explicit inverse."""
    lead, state = leads(model, policy, gamma)
    n, m = model.n_states, np.unique(state).size
    minimum = np.eye(m)[np.searchsorted(np.unique(state), state)]
    I, O = np.eye(n), np.zeros((n, m))
    A = np.block([[-lead, 0 * lead, minimum], [I, -I, O], [-I, -I, O]])
    cost = np.concatenate([np.zeros(n), np.full(n, l1), -np.ones(m)])
    bounds = [(-r_max, r_max)] * n + [(0, None)] * (n + m)
    return -linprog(cost, A_ub=A, b_ub=np.zeros(len(A)), bounds=bounds).fun


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("l1", [0.0, 0.3, 2.0])
def test_agrees_with_the_explicit_inverse(random_model, seed, l1):
    rng = np.random.default_rng(seed)
    model = random_model(rng, n_states=12, n_actions=3)
    _, Q = value_iteration(model, rng.normal(size=12), GAMMA, terminal=[4])
    policy = np.where(np.isfinite(Q).any(axis=1), Q.argmax(axis=1), -1)
    assert policy[4] == policy[-1] == -1
    R = lp(model, policy, GAMMA, l1=l1, r_max=2.0)
    lead, state = leads(model, policy, GAMMA)
    assert (lead @ R).min() >= -1e-8
    assert np.abs(R).max() <= 2.0
    reached = objective(lead, state, R, l1)
    assert reached == pytest.approx(dense_optimum(model, policy, GAMMA, l1, 2.0), abs=1e-7)


def test_the_given_policy_is_optimal_under_the_reward_found(stochastic):
    _, Q = value_iteration(stochastic, np.random.default_rng(0).normal(size=12), GAMMA)
    policy = np.where(np.isfinite(Q).any(axis=1), Q.argmax(axis=1), -1)
    V, Q = value_iteration(stochastic, lp(stochastic, policy, GAMMA, l1=0.1), GAMMA)
    acting = policy >= 0
    np.testing.assert_allclose(Q[acting, policy[acting]], V[acting], atol=1e-7)


def test_two_ends_have_their_closed_form():
    # From 0, action 0 enters 1 and action 1 enters 2; both end. The margin is R(1) − R(2).
    ends = TransitionModel.from_entries(
        3, 2, np.array([0, 0]), np.array([0, 1]), np.array([1, 2]), np.ones(2)
    )
    policy = np.array([0, -1, -1])
    np.testing.assert_allclose(lp(ends, policy, GAMMA, l1=0.9, r_max=5.0), [0, 5, -5], atol=1e-9)
    np.testing.assert_allclose(lp(ends, policy, GAMMA, l1=1.1, r_max=5.0), 0, atol=1e-9)


@pytest.mark.parametrize("slack", [0.0, 0.01, 1.0])
@pytest.mark.parametrize("l1", [0.0, 1.0])
def test_without_a_choice_there_is_no_reward(chain, slack, l1):
    # Where one action is feasible, or nothing was shown, R = 0 is as good as any.
    only = TransitionModel.from_entries(
        3, 2, np.array([0, 1]), np.array([1, 0]), np.array([1, 2]), np.ones(2)
    )
    for model, policy in ((only, [1, 0, -1]), (chain, [-1, -1, -1, -1])):
        R = lp(model, np.array(policy), GAMMA, l1=l1, slack=slack)
        np.testing.assert_array_equal(R, np.zeros(model.n_states))
        assert largest_l1(model, np.array(policy), GAMMA) == 0


def test_choices_that_contradict_one_another_have_no_reward():
    # 0 and 1 enter the same ends, 2 and 3; the policy prefers 2 in one and 3 in the other.
    ends = TransitionModel.from_entries(
        4, 2, np.repeat([0, 1], 2), np.tile([0, 1], 2), np.tile([2, 3], 2), np.ones(4)
    )
    policy = np.array([0, 1, -1, -1])
    for slack in (0.0, 0.01):
        np.testing.assert_array_equal(lp(ends, policy, GAMMA, l1=0.0, slack=slack), np.zeros(4))
    assert largest_l1(ends, policy, GAMMA) == 0


@pytest.mark.parametrize("seed", range(4))
def test_the_price_from_which_no_reward_is_best(random_model, seed):
    rng = np.random.default_rng(seed)
    model = random_model(rng, n_states=12, n_actions=3)
    _, Q = value_iteration(model, rng.normal(size=12), GAMMA, terminal=[4])
    policy = np.where(np.isfinite(Q).any(axis=1), Q.argmax(axis=1), -1)
    most = largest_l1(model, policy, GAMMA)
    # By bisection of the dense program's optimum, which is 0 from there.
    low, high = 0.0, 100.0
    for _ in range(40):
        middle = (low + high) / 2
        if dense_optimum(model, policy, GAMMA, middle, 1.0) > 1e-7:
            low = middle
        else:
            high = middle
    assert most == pytest.approx(low, rel=1e-4)
    assert lp(model, policy, GAMMA, l1=0.99 * most).any()
    assert not lp(model, policy, GAMMA, l1=1.01 * most).any()


def test_margins_are_over_the_best_other_action(stochastic):
    q = np.random.default_rng(1).normal(size=(12, 3))
    q[~stochastic.mask] = 100.0
    policy = np.array([stochastic.actions_of(s)[0] for s in range(11)] + [-1])
    policy[3] = -1
    expected = [
        q[s, policy[s]] - max(q[s, a] for a in stochastic.actions_of(s) if a != policy[s])
        for s in range(11)
        if policy[s] >= 0 and len(stochastic.actions_of(s)) > 1
    ]
    np.testing.assert_array_equal(margins(stochastic, q, policy), expected)


@pytest.mark.parametrize("grid", [5, 15], indirect=True)
@pytest.mark.parametrize("l1", [0.0, 0.5, 2.0])
def test_recovers_the_grid(grid, strict_policy, share_of_optimum, l1):
    R = lp(grid.model, strict_policy, GAMMA, l1=l1, slack=0.01)
    _, Q = value_iteration(grid.model, R, GAMMA)
    np.testing.assert_array_equal(Q.argmax(axis=1), strict_policy)
    assert share_of_optimum(Q.argmax(axis=1)).min() >= 0.99


@pytest.mark.parametrize("slack", [0.01, 0.2])
def test_slack_buys_the_smallest_margin_with_the_sum(grid, strict_policy, slack):
    lead, state = leads(grid.model, strict_policy, GAMMA)
    best, kept = (lp(grid.model, strict_policy, GAMMA, l1=0.5, slack=s) for s in (0.0, slack))
    sums = [objective(lead, state, R, 0.5) for R in (best, kept)]
    assert sums[1] == pytest.approx((1 - slack) * sums[0])
    assert (lead @ best).min() < 1e-6  # (3.7) alone leaves ties
    assert (lead @ kept).min() > 1e-3


def test_no_slack_parts_actions_that_the_policy_itself_confuses(grid, optimal_policy):
    # Two cells share two neighbours; one goes to the first and the other to the second.
    a, b = grid.index(grid.goal[0] - 1, grid.goal[1] - 1), grid.goal_state
    policy = optimal_policy.copy()
    policy[a], policy[b] = ACTIONS.index("right"), ACTIONS.index("left")
    lead, _ = leads(grid.model, policy, GAMMA)
    assert (lead @ lp(grid.model, policy, GAMMA, slack=0.5)).min() == pytest.approx(0, abs=1e-7)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"policy": np.zeros(4)}, "integer"),
        ({"policy": np.zeros(3, dtype=int)}, "integer"),
        ({"policy": np.zeros(4, dtype=int)}, "state 3, action 0 is not feasible"),
        ({"policy": np.array([5, 0, 0, -1])}, "state 0, action 5"),
        ({"gamma": 1.0}, "gamma"),
        ({"gamma": -0.1}, "gamma"),
        ({"l1": -1.0}, "l1"),
        ({"r_max": 0.0}, "r_max"),
        ({"slack": 1.1}, "slack"),
    ],
)
def test_bad_arguments_are_named(chain, arguments, words):
    given = {"policy": np.array([1, 1, 1, -1]), "gamma": GAMMA} | arguments
    with pytest.raises(InputError, match=words):
        lp(chain, **given)
