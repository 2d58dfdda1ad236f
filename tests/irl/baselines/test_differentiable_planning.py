import time

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from irl.baselines.differentiable_planning import HardMax, Planner, PNorm, SoftMax
from irl.errors import InputError
from irl.groups import Groups
from irl.mdp import TransitionModel
from irl.planning import value_iteration

MAXIMA = [HardMax(), SoftMax(1.0), SoftMax(0.05), PNorm(80.0)]


def dense_fixed_point(model, reward, gamma, maximum):
    """V by plain sweeps over dense tables."""
    V = np.zeros(model.n_states)
    for _ in range(300):
        Q = model.q_values(reward + gamma * V)
        V = np.array([maximum(q[np.isfinite(q)]) if np.isfinite(q).any() else 0.0 for q in Q])
    return V


def test_two_states_have_their_closed_form():
    # In 0 one may stay or go to 1, which stays; entering 1 earns r.
    state, action, after = np.array([[0, 0, 0], [0, 1, 1], [1, 1, 1]]).T
    model = TransitionModel.from_entries(2, 2, state, action, after, np.ones(3))
    gamma, r = 0.9, 2.0
    planner = Planner(model, gamma, SoftMax(0.5))
    f = planner.solve(np.array([0.0, r]))
    v1 = r / (1 - gamma)
    assert planner.V[1] == pytest.approx(v1)
    # v₀ = τ log(exp(γ v₀ / τ) + exp((r + γ v₁) / τ)).
    v0 = planner.V[0]
    assert np.exp(v0 / 0.5) == pytest.approx(np.exp(gamma * v0 / 0.5) + np.exp(v1 / 0.5))
    np.testing.assert_allclose(f, np.array([0.0, r]) + gamma * planner.V)
    # One action a state: V is linear in R, and so is the pull.
    cycle = TransitionModel.from_entries(
        2, 1, np.array([0, 1]), np.zeros(2, int), np.array([1, 0]), np.ones(2)
    )
    planner = Planner(cycle, gamma, SoftMax())
    planner.solve(np.array([1.0, 3.0]))
    onward = np.array([[0.0, 1.0], [1.0, 0.0]])
    dense = np.linalg.inv(np.eye(2) - gamma * onward)
    np.testing.assert_allclose(planner.V, onward @ dense @ [1.0, 3.0], rtol=1e-9)
    np.testing.assert_allclose(planner.pull(np.array([1.0, -2.0])), dense.T @ [1.0, -2.0])


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("maximum", MAXIMA)
def test_values_agree_with_plain_sweeps(random_model, seed, maximum):
    rng = np.random.default_rng(seed)
    model = random_model(rng, n_states=12, n_actions=3)
    planner = Planner(model, 0.9, maximum)
    for _ in range(2):  # the warm start must not show
        reward = rng.random(12)
        expected = dense_fixed_point(
            model,
            reward,
            0.9,
            lambda q: maximum.values(q, Groups.of_widths(np.array([q.size])))[0],
        )
        planner.solve(reward)
        np.testing.assert_allclose(planner.V, expected, atol=1e-8)


@pytest.mark.parametrize("gamma", [0.0, 0.5, 0.99])
def test_hard_maximum_agrees_with_value_iteration(random_model, gamma):
    rng = np.random.default_rng(7)
    model = random_model(rng)
    reward = rng.normal(size=model.n_states)
    f = Planner(model, gamma).solve(reward)
    V, _ = value_iteration(model, reward, gamma)
    np.testing.assert_allclose(f, reward + gamma * V, atol=1e-7)


@pytest.mark.parametrize("maximum", MAXIMA)
def test_maxima_lie_above_the_maximum_by_no_more_than_they_may(maximum):
    rng = np.random.default_rng(0)
    q = rng.random(30)
    groups = Groups.of_widths(np.full(6, 5))
    v = maximum.values(q, groups)
    hardest = q.reshape(6, 5).max(axis=1)
    slack = {SoftMax: lambda: maximum.temperature * np.log(5), HardMax: lambda: 0.0}.get(
        type(maximum), lambda: hardest * (5 ** (1 / 80) - 1)
    )()
    assert (v >= hardest - 1e-12).all()
    assert (v <= hardest + slack + 1e-12).all()
    slopes = maximum.slopes(q, v, groups)
    assert (slopes >= 0).all()
    assert (groups.sum(slopes) <= maximum.expansion(5) + 1e-9).all()


def test_p_norm_survives_powers_that_overflow_and_groups_of_zeros():
    q, groups = np.array([1e5, 1e5, 0.0, 0.0]), Groups.of_widths(np.array([2, 2]))
    norm = PNorm(100.0)
    v = norm.values(q, groups)
    np.testing.assert_allclose(v, [1e5 * 2**0.01, 0.0])
    np.testing.assert_allclose(norm.slopes(q, v, groups), 2**-0.99)


@pytest.mark.parametrize("gamma", [0.0, 0.6, 0.95])
@pytest.mark.parametrize("maximum", [HardMax(), SoftMax(0.3), PNorm(80.0)])
def test_pull_agrees_with_finite_differences(random_model, gamma, maximum):
    rng = np.random.default_rng(1)
    model = random_model(rng, n_states=12, n_actions=3)
    reward, g = rng.random(12) + 0.1, rng.normal(size=12)
    planner = Planner(model, gamma, maximum)
    numeric = approx_fprime(reward, lambda r: g @ planner.solve(r), 1e-6)
    planner.solve(reward)
    np.testing.assert_allclose(planner.pull(g), numeric, atol=2e-4)


@pytest.mark.parametrize("size", [1e-300, 1e-47, 1e-12, 1.0, 1e200])
def test_a_gradient_of_any_size_is_pulled_alike(random_model, size, monkeypatch):
    """Where labels are all but certain it is tiny, and the last one was larger by far."""
    monkeypatch.setattr("irl.onward.splu", None)
    rng = np.random.default_rng(3)
    model = random_model(rng, n_states=12, n_actions=3)
    g = rng.normal(size=12)
    planner = Planner(model, 0.95, SoftMax(0.3))
    planner.solve(rng.random(12))
    expected = planner.pull(g)
    planner.pull(rng.normal(size=12))
    np.testing.assert_allclose(planner.pull(size * g) / size, expected, rtol=1e-6)
    assert not planner.pull(np.zeros(12)).any()


def test_pull_is_bellman_gradient_iteration_transposed(random_model):
    rng = np.random.default_rng(2)
    model = random_model(rng, n_states=12, n_actions=3)
    reward, g, gamma, norm = rng.random(12), rng.normal(size=12), 0.8, SoftMax(0.2)
    planner = Planner(model, gamma, norm)
    f = planner.solve(reward)
    # The published iteration: ∂Q/∂R ← P (I + γ ∂V/∂R), ∂V/∂R by the maximum's slopes.
    q = model.P @ f
    weight = norm.slopes(q, planner.V[model.acting], model.groups)
    dV = np.zeros((12, 12))
    for _ in range(300):
        dQ = model.P @ (np.eye(12) + gamma * dV)
        dV = np.zeros((12, 12))
        np.add.at(dV, model.pair_state, weight[:, None] * dQ)
    np.testing.assert_allclose(planner.pull(g), (np.eye(12) + gamma * dV).T @ g, atol=1e-8)


@pytest.mark.parametrize("maximum", [HardMax(), SoftMax(1.0), SoftMax(0.01)])
@pytest.mark.parametrize("ends", [False, True])
def test_a_long_future_costs_no_sweeps(maximum, ends):
    # Along a corridor of 300 states a step in ten fails; the last state ends the run or stays.
    n, gamma = 300, 1 - 1e-6
    s = np.arange(n - ends)
    rows = []
    for action, to in enumerate((np.maximum(s - 1, 0), np.minimum(s + 1, n - 1))):
        rows += [(i, action, j, 0.9) for i, j in zip(s, to, strict=True) if i != j]
        rows += [(i, action, i, 0.1 if i != j else 1.0) for i, j in zip(s, to, strict=True)]
    state, action, after, p = map(np.array, zip(*rows, strict=True))
    model = TransitionModel.from_entries(n, 2, state, action, after, p)
    rng = np.random.default_rng(3)
    reward, g = rng.normal(size=n), rng.normal(size=n)
    planner = Planner(model, gamma, maximum)
    began = time.process_time()
    f = planner.solve(reward)
    pull = planner.pull(g)
    assert time.process_time() - began < 3
    # Bellman's equation holds, and so does that of the pull, by dense tables.
    q = model.P @ f
    V = maximum.values(q, model.groups)
    scale = np.abs(V).max()
    assert np.abs(V - planner.V[model.acting]).max() <= 1e-13 * scale
    onward = np.zeros((n, n))
    np.add.at(
        onward,
        model.pair_state,
        maximum.slopes(q, V, model.groups)[:, None] * model.P.toarray(),
    )
    dense = np.linalg.solve((np.eye(n) - gamma * onward).T, g)
    np.testing.assert_allclose(pull, dense, atol=1e-6 * np.abs(dense).max())


def test_bad_arguments_are_named(chain):
    with pytest.raises(InputError, match="gamma"):
        Planner(chain, 1.0)
    with pytest.raises(InputError, match="higher order"):
        Planner(chain, 0.9, PNorm(2.0))
    with pytest.raises(InputError, match="temperature"):
        SoftMax(0.0)
    with pytest.raises(InputError, match="order"):
        PNorm(0.5)
    with pytest.raises(InputError, match="reward"):
        Planner(chain, 0.9).solve(np.full(4, np.nan))
