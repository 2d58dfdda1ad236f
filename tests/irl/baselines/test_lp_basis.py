import numpy as np
import pytest

from irl.baselines.lp_basis import entry_values, lp_basis
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.planning import transition_matrix, value_iteration

GAMMA = 0.9


def objective(model, policy, features, weights, states):
    """(3.12) as it is written, state by state, action by action, for each column of weights."""
    P_pi = transition_matrix(model, policy).toarray()
    f = np.linalg.solve(np.eye(model.n_states) - GAMMA * P_pi, features @ weights)
    total = 0.0
    for s in states:
        rows = [model.pair_index(s, a) for a in model.actions_of(s) if a != policy[s]]
        if rows:
            lead = P_pi[s] @ f - model.P[rows] @ f
            total = total + np.where(lead >= 0, lead, 2 * lead).min(axis=0)
    return total


@pytest.mark.parametrize("seed", range(4))
def test_no_weights_do_better(random_model, seed):
    rng = np.random.default_rng(seed)
    model = random_model(rng, n_states=12, n_actions=3)
    policy = np.array([rng.choice(model.actions_of(s)) for s in range(11)] + [-1])
    features, states = rng.normal(size=(12, 2)), rng.choice(11, 6, replace=False)
    R, weights = lp_basis(model, policy, features, gamma=GAMMA, states=states)
    np.testing.assert_allclose(R, features @ weights)
    assert np.abs(weights).max() <= 1 + 1e-9
    reached = objective(model, policy, features, weights, states)
    steps = np.linspace(-1, 1, 41)
    scan = np.stack(np.meshgrid(steps, steps)).reshape(2, -1)
    others = objective(model, policy, features, scan, states)
    assert reached - 0.1 * abs(reached) <= others.max() <= reached + 1e-9


def test_unlabelled_states_are_valued_by_what_is_done_there(random_model):
    rng = np.random.default_rng(5)
    model = random_model(rng, n_states=12, n_actions=3)
    policy = np.full(12, -1)
    policy[:4] = [rng.choice(model.actions_of(s)) for s in range(4)]
    even = model.mask / np.maximum(model.mask.sum(axis=1, keepdims=True), 1)
    features = rng.normal(size=(12, 2))
    _, weights = lp_basis(model, policy, features, gamma=GAMMA, elsewhere=even)
    done = even.copy()
    done[range(4)] = np.eye(3)[policy[:4]]
    P_pi = np.zeros((12, 12))
    for s, a, row in zip(model.pair_state, model.pair_action, model.P.toarray(), strict=True):
        P_pi[s] += done[s, a] * row
    f = np.linalg.solve(np.eye(12) - GAMMA * P_pi, features)

    def total(columns):
        found = 0.0
        for s in range(4):
            rows = [model.pair_index(s, a) for a in model.actions_of(s) if a != policy[s]]
            if rows:
                lead = (P_pi[s] - model.P[rows].toarray()) @ f @ columns
                found = found + np.where(lead >= 0, lead, 2 * lead).min(axis=0)
        return found

    steps = np.linspace(-1, 1, 41)
    scan = total(np.stack(np.meshgrid(steps, steps)).reshape(2, -1))
    reached = total(weights[:, None]).item()
    assert scan.max() - 1e-9 <= reached <= scan.max() + 0.1 * abs(reached)


def test_no_weights_where_none_do_better():
    only = TransitionModel.from_entries(
        2, 1, np.array([0]), np.array([0]), np.array([1]), np.ones(1)
    )
    for policy in ([0, -1], [-1, -1]):
        R, weights = lp_basis(only, np.array(policy), np.array([[0.3], [1.0]]), gamma=GAMMA)
        assert not R.any()
        assert not weights.any()


def test_values_follow_from_the_features(stochastic):
    rng = np.random.default_rng(0)
    policy = np.array([stochastic.actions_of(s)[0] for s in range(11)] + [-1])
    P, phi = transition_matrix(stochastic, policy), rng.normal(size=(12, 3))
    f = entry_values(P, phi, GAMMA)
    np.testing.assert_allclose(f, phi + GAMMA * (P @ f))


def test_a_violation_counts_twice():
    # 0 and 1 enter the same ends, 2 and 3; the policy prefers 2 in both, or in one only.
    ends = TransitionModel.from_entries(
        4, 2, np.repeat([0, 1], 2), np.tile([0, 1], 2), np.tile([2, 3], 2), np.ones(4)
    )
    phi = np.array([[0.0], [0.0], [1.0], [0.0]])
    _, weights = lp_basis(ends, np.array([0, 0, -1, -1]), phi, gamma=GAMMA)
    np.testing.assert_allclose(weights, [1.0])
    # One gains what the other loses, and losses weigh more: best no reward at all.
    _, weights = lp_basis(ends, np.array([0, 1, -1, -1]), phi, gamma=GAMMA)
    np.testing.assert_allclose(weights, [0.0], atol=1e-9)
    _, weights = lp_basis(ends, np.array([0, 1, -1, -1]), phi, gamma=GAMMA, states=np.array([1]))
    np.testing.assert_allclose(weights, [-1.0])


@pytest.mark.parametrize("grid", [5, 15], indirect=True)
def test_recovers_the_grid(grid, strict_policy, share_of_optimum):
    blocks = grid.cells[:, None] * 5 // grid.n == np.indices((5, 5)).reshape(2, -1).T
    goal = np.eye(grid.n_states)[:, [grid.goal_state]]
    features = np.hstack([goal, grid.features, blocks.all(axis=2)])
    R, _ = lp_basis(grid.model, strict_policy, features, gamma=GAMMA)
    _, Q = value_iteration(grid.model, R, GAMMA)
    assert share_of_optimum(Q.argmax(axis=1)).min() >= 0.99


def test_bad_arguments_are_named(chain):
    policy = np.array([1, 1, 1, -1])
    with pytest.raises(InputError, match="gamma"):
        lp_basis(chain, policy, gamma=1.0)
    with pytest.raises(InputError, match="not feasible"):
        lp_basis(chain, np.zeros(4, dtype=int), gamma=GAMMA)
    with pytest.raises(InputError, match="features"):
        lp_basis(chain, policy, np.zeros((3, 2)), gamma=GAMMA)


def test_of_rewards_that_are_nearly_as_good_the_smallest_margin_is_made_largest(random_model):
    # By dense algebra: f = (I − γ P_π)⁻¹ Φ ω, and a margin is P_π f − P_a f.
    rng = np.random.default_rng(5)
    model = random_model(rng, n_states=12, n_actions=3)
    phi = rng.normal(size=(12, 4))
    policy = np.where(model.widths > 0, value_iteration(model, phi[:, 0], 0.9)[1].argmax(1), -1)

    def smallest_and_sum(slack):
        R, _ = lp_basis(model, policy, phi, gamma=0.9, slack=slack)
        P = transition_matrix(model, policy).toarray()
        q = model.q_values(np.linalg.solve(np.eye(12) - 0.9 * P, R))
        lead = []
        for s in np.flatnonzero(model.widths > 1):
            others = np.delete(q[s], policy[s])
            lead.append(q[s, policy[s]] - others.max())
        return min(lead), sum(np.where(np.array(lead) < 0, 2 * np.array(lead), lead))

    smallest, total = smallest_and_sum(0.0)
    for slack in (0.05, 0.3):
        larger, kept = smallest_and_sum(slack)
        assert larger >= smallest - 1e-9
        assert kept >= (1 - slack) * total - 1e-6
    assert larger > smallest + 1e-3
    with pytest.raises(InputError, match="slack"):
        lp_basis(model, policy, phi, gamma=0.9, slack=1.5)
