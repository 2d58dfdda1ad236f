from itertools import product

import numpy as np
import pytest
from scipy.optimize import linprog

from irl.advice import Advice
from irl.baselines.lp_advice import TrustConfig, lp_advice
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.planning import transition_matrix, value_iteration

GAMMA = 0.9


def random_case(random_model, seed):
    """A model, an action in every state, and advice about the others in two states."""
    rng = np.random.default_rng(seed)
    model = random_model(rng, n_states=10, n_actions=4)
    action = np.array([rng.choice(model.actions_of(s)) for s in range(9)])
    advice = Advice.none(10, 4)
    for s in [s for s in range(9) if len(model.actions_of(s)) >= 3][:2]:
        order = rng.permutation(np.setdiff1d(model.actions_of(s), action[s]))
        advice = advice.add([s], order[:1], order[1:])
    return model, Demonstrations.from_labels(enumerate(action.tolist())), advice


def dense_optimum(model, action, advice, trusts, delta, r_max):
    """(3.9) as it is written: every pair of actions a row, the explicit inverse, and |R|."""
    n = model.n_states
    P_pi = transition_matrix(model, np.append(action, -1)).toarray()
    to_f = np.linalg.inv(np.eye(n) - GAMMA * P_pi)
    P = model.P.toarray()
    advised = np.flatnonzero(advice.preferred.any(axis=1))
    m, k = n - 1, advised.size
    rows, least = [], []
    for s in range(m):
        for a in model.actions_of(s):
            if a != action[s]:
                lead = (P_pi[s] - P[model.pair_index(s, a)]) @ to_f
                rows.append(np.concatenate([lead, np.zeros(n), -np.eye(m)[s], np.zeros(k)]))
                least.append(0.0)
    for j, s in enumerate(advised):
        pairs = product(np.flatnonzero(advice.preferred[s]), np.flatnonzero(advice.avoided[s]))
        for good, bad in pairs:
            lead = (P[model.pair_index(s, good)] - P[model.pair_index(s, bad)]) @ to_f
            rows.append(np.concatenate([lead, np.zeros(n + m), -np.eye(k)[j]]))
            least.append(delta)
    for sign in (1, -1):  # |R| is at least ±R
        rows += list(np.hstack([sign * np.eye(n), np.eye(n), np.zeros((n, m + k))]))
        least += [0.0] * n
    cost = np.concatenate([np.zeros(n), np.ones(n), np.full(m, -trusts[0]), np.full(k, -trusts[1])])
    # A state whose only action is taken has no ξ; any bound will do.
    free = [(None, None) if len(model.actions_of(s)) > 1 else (0, 0) for s in range(m)]
    bounds = [(-r_max, r_max)] * n + [(0, None)] * n + free + [(0, None)] * k
    return -linprog(cost, A_ub=-np.array(rows), b_ub=-np.array(least), bounds=bounds).fun


def objective(model, action, advice, trusts, delta, R):
    P_pi = transition_matrix(model, np.append(action, -1)).toarray()
    q = model.q_values(np.linalg.solve(np.eye(model.n_states) - GAMMA * P_pi, R))
    total = -np.abs(R).sum()
    for s in range(model.n_states - 1):
        others = [q[s, action[s]] - q[s, a] for a in model.actions_of(s) if a != action[s]]
        total += trusts[0] * min(others, default=0.0)
        good, bad = advice.preferred[s], advice.avoided[s]
        if good.any():
            zeta = q[s, good].min() - q[s, bad].max() - delta
            assert zeta >= -1e-7
            total += trusts[1] * zeta
    return total


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    ("trusts", "delta"), [((1.0, 1.0), 0.0), ((0.3, 2.0), 0.2), ((1, 0), -0.5)]
)
def test_agrees_with_the_explicit_inverse(random_model, seed, trusts, delta):
    model, shown, advice = random_case(random_model, seed)
    R = lp_advice(
        model,
        shown,
        advice,
        gamma=GAMMA,
        config=TrustConfig(*trusts, hardness=delta, r_max=2.0),
    )
    assert np.abs(R).max() <= 2.0 + 1e-9
    reached = objective(model, shown.action, advice, trusts, delta, R)
    optimum = dense_optimum(model, shown.action, advice, trusts, delta, 2.0)
    assert reached == pytest.approx(optimum, abs=1e-6)


@pytest.fixture
def ends() -> TransitionModel:
    """From 0 the actions 0, 1, 2 enter 1, 2, 3, which end."""
    zero = np.zeros(3, dtype=int)
    return TransitionModel.from_entries(4, 3, zero, np.arange(3), np.arange(1, 4), np.ones(3))


def test_advice_outweighs_a_demonstration_as_far_as_it_is_trusted(ends):
    shown = Demonstrations.from_pairs([(0, 0)])
    advice = Advice.none(4, 3).add([0], [1], [0])

    def q(**options):
        config = TrustConfig(r_max=5.0, **options)
        return lp_advice(ends, shown, advice, gamma=GAMMA, config=config)[1:]

    # Demonstrated: R(1) leads the others by ξ. Advised: R(2) leads R(1) by ζ, from 0.
    R = q(demonstration_trust=0.0, advice_trust=1.5)
    np.testing.assert_allclose(R, [-5, 5, 0], atol=1e-9)
    np.testing.assert_allclose(q(demonstration_trust=0.0, advice_trust=0.9), 0, atol=1e-9)
    # A hard margin is met at the least price, whatever the trust.
    R = q(demonstration_trust=0.0, advice_trust=0.0, hardness=3.0)
    assert R[1] - R[0] == pytest.approx(3.0)
    assert np.abs(R).sum() == pytest.approx(3.0)
    with pytest.raises(InputError, match="no reward within ±5 meets"):
        q(hardness=10.1)
    # Allowed to be violated by 4, the advice yields to a demonstration that is trusted.
    R = q(demonstration_trust=3.0, advice_trust=0.0, hardness=-4.0)
    assert R[0] - R[1] == pytest.approx(4.0)


@pytest.mark.parametrize(("preferred", "avoided"), [([1], []), ([], [1])])
def test_one_set_alone_is_set_against_the_rest(ends, preferred, avoided):
    advice = Advice.none(4, 3).add([0], preferred, avoided)
    R = lp_advice(
        ends, Demonstrations.empty(), advice, gamma=GAMMA, config=TrustConfig(hardness=0.5)
    )
    lead = R[2] - np.array([R[1], R[3]])
    assert (lead >= 0.5 - 1e-9).all() if preferred else (lead <= -0.5 + 1e-9).all()


def test_advice_about_what_cannot_be_done_has_no_effect(chain):
    advice = Advice.none(4, 2).add([3], [0], [1])
    shown = Demonstrations.from_pairs([(0, 1), (1, 1), (2, 1)])
    with_, without = (lp_advice(chain, shown, a, gamma=GAMMA) for a in (advice, Advice.none(4, 2)))
    np.testing.assert_array_equal(with_, without)


@pytest.fixture
def worse_actions(grid, true_reward) -> Advice:
    """Advice to avoid whatever is not optimal."""
    _, Q = value_iteration(grid.model, true_reward, GAMMA)
    worse = np.isfinite(Q) & (Q.max(axis=1, keepdims=True) - 1e-9 > Q)
    return Advice(np.zeros_like(worse), worse)


@pytest.mark.parametrize("grid", [5, 15], indirect=True)
def test_recovers_the_grid(grid, optimal_walks, worse_actions, share_of_optimum):
    R = lp_advice(grid.model, optimal_walks, worse_actions, gamma=GAMMA)
    _, Q = value_iteration(grid.model, R, GAMMA)
    # (3.9) with δ = 0 lets an avoided action tie with the best: it is not to be taken then.
    assert share_of_optimum(worse_actions.apply(Q, grid.model.mask).argmax(axis=1)).min() >= 0.99


def test_advice_makes_up_for_bad_demonstrations(
    grid, border_walks, worse_actions, share_of_optimum
):
    rng = np.random.default_rng(0)
    action = border_walks.action.copy()
    for k in np.flatnonzero(rng.random(action.size) < 0.3):
        action[k] = rng.choice(grid.model.actions_of(border_walks.state[k]))
    noisy = Demonstrations.from_labels(zip(border_walks.state, action, strict=True))
    least = []
    for advice in (Advice.none(grid.n_states, 4), worse_actions):
        R = lp_advice(grid.model, noisy, advice, gamma=GAMMA)
        _, Q = value_iteration(grid.model, R, GAMMA)
        least.append(share_of_optimum(Q.argmax(axis=1)).min())
    assert least[0] < 0.5
    assert least[1] >= 0.99


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"demonstrations": Demonstrations.from_pairs([(3, 1)])}, "not feasible"),
        ({"advice": Advice.none(3, 2)}, "advice"),
        ({"gamma": 1.0}, "gamma"),
        ({"config": TrustConfig(hardness=np.zeros(3))}, "hardness"),
    ],
)
def test_bad_arguments_are_named(chain, arguments, words):
    given = {
        "demonstrations": Demonstrations.from_pairs([(0, 1)]),
        "advice": Advice.none(4, 2),
        "gamma": GAMMA,
    }
    with pytest.raises(InputError, match=words):
        lp_advice(chain, **(given | arguments))
