import numpy as np
import pytest
import torch

from irl.errors import InputError
from irl.likelihood import LikelihoodProblem

BETA = 3.0
LAST = 29  # the terminal state of the random model
FIXED = {LAST: -1.0}


@pytest.fixture
def model(random_model):
    return random_model(np.random.default_rng(0))


def pose(model, fixed=FIXED, weight=None):
    into_last = model.P[:, [LAST]].nonzero()[0][0]
    row = np.array([0, 3, 3, 5, 9, 9, into_last, model.n_pairs - 1])
    state, action = model.pair_state[row], model.pair_action[row]
    return state, action, LikelihoodProblem.build(model, state, action, weight, fixed)


def reference(model, state, action, weight, f, beta):
    """(3.19) as a weighted mean, written with dense torch operations."""
    q = torch.as_tensor(model.P.toarray()) @ f
    table = torch.full((model.n_states, model.n_actions), -torch.inf, dtype=torch.float64)
    table[model.pair_state, model.pair_action] = beta * q
    log_policy = torch.log_softmax(table[torch.as_tensor(state, dtype=torch.long)], dim=1)
    chosen = log_policy[torch.arange(len(state)), torch.as_tensor(action, dtype=torch.long)]
    weight = torch.as_tensor(weight)
    return (weight * chosen).sum() / weight.sum()


@pytest.mark.parametrize("weighted", [False, True])
def test_value_and_gradients_are_those_of_autograd(model, weighted):
    rng = np.random.default_rng(1)
    weight = rng.uniform(0.5, 2, 8) if weighted else None
    state, action, problem = pose(model, weight=weight)
    values = rng.uniform(-1, 1, model.n_states)
    value, df, dbeta = problem.value_and_gradient(values[problem.states], BETA)

    free = torch.tensor(values, requires_grad=True)
    pinned = free.clone()
    pinned[LAST] = -1.0
    beta = torch.tensor(BETA, dtype=torch.float64, requires_grad=True)
    expected = reference(
        model, state, action, np.ones(8) if weight is None else weight, pinned, beta
    )
    expected.backward()
    assert value == pytest.approx(expected.item(), abs=1e-12)
    np.testing.assert_allclose(df, free.grad.numpy()[problem.states], atol=1e-12)
    assert dbeta == pytest.approx(beta.grad.item(), abs=1e-12)
    untouched = np.setdiff1d(np.arange(model.n_states), problem.states)
    assert not free.grad.numpy()[untouched].any()


def test_gradients_agree_with_finite_differences(model):
    *_, problem = pose(model)
    f = np.random.default_rng(2).uniform(-1, 1, problem.states.size)
    _, df, dbeta = problem.value_and_gradient(f, BETA)
    h = 1e-6
    for i, step in enumerate(np.eye(f.size) * h):
        up, down = (problem.value_and_gradient(f + s, BETA)[0] for s in (step, -step))
        assert (up - down) / (2 * h) == pytest.approx(df[i], abs=1e-8)
    up, down = (problem.value_and_gradient(f, BETA + s)[0] for s in (h, -h))
    assert (up - down) / (2 * h) == pytest.approx(dbeta, abs=1e-8)


def test_constant_values_give_the_uniform_policy(model):
    state, _, problem = pose(model, fixed=None)
    value, *_ = problem.value_and_gradient(np.full(problem.states.size, 0.3), BETA)
    assert value == pytest.approx(-np.log(model.mask.sum(axis=1)[state]).mean(), abs=1e-12)


def test_only_successors_of_demonstrated_states_are_asked_for(model):
    state, _, problem = pose(model)
    successors = model.P[np.isin(model.pair_state, state)].indices
    assert problem.states.tolist() == np.unique(successors).tolist()


def test_pinned_values_are_what_counts_and_the_input_is_left_alone(model):
    *_, problem = pose(model)
    where = int(np.flatnonzero(problem.states == LAST)[0])
    f = np.zeros(problem.states.size)
    value, df, _ = problem.value_and_gradient(f, BETA)
    f[where] = 0.7
    other, *_ = problem.value_and_gradient(f, BETA)
    assert value == other
    assert df[where] == 0
    assert f[where] == 0.7


def test_large_beta_neither_overflows_nor_vanishes(model):
    *_, problem = pose(model)
    f = np.random.default_rng(3).uniform(-1, 1, problem.states.size)
    value, df, dbeta = problem.value_and_gradient(f, 1e6)
    assert np.isfinite([value, dbeta, *df]).all()


def test_infeasible_pair_is_named_with_the_feasible_ones(model):
    s, a = np.argwhere(~model.mask & model.mask.any(axis=1, keepdims=True))[0]
    with pytest.raises(InputError, match=f"state {s}, action {a} is infeasible") as told:
        LikelihoodProblem.build(model, np.array([s]), np.array([a]))
    assert str(np.flatnonzero(model.mask[s])[0]) in str(told.value)
    assert "\n" not in str(told.value)
    with pytest.raises(InputError, match="none"):
        LikelihoodProblem.build(model, np.array([LAST]), np.array([0]))


@pytest.mark.parametrize(
    ("state", "action", "weight", "message"),
    [
        ([], [], None, "at least one"),
        ([0, 1], [0], None, "one length"),
        ([30], [0], None, "'state'"),
        ([0], [-1], None, "'action'"),
        ([0], [0], [0.0], "'weight'"),
    ],
)
def test_bad_input_is_named(model, state, action, weight, message):
    with pytest.raises(InputError, match=message):
        LikelihoodProblem.build(model, np.array(state), np.array(action), weight)
