from itertools import pairwise

import numpy as np
import pytest
import torch

from irl.baselines.deep_max_ent import DeepMaxEntConfig, RewardNetwork, deep_max_ent
from irl.baselines.max_ent import FeatureMatching
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.planning import value_iteration

torch.set_num_threads(1)  # networks this small gain nothing from more
GAMMA = 0.9


def objective_by_autograd(model, walks, features, layers, r_max):
    """The same objective from dense tables in float64, differentiable in the layers."""
    x = torch.tensor(features)
    for weight, bias in layers[:-1]:
        x = torch.relu(x @ weight.T + bias)
    weight, bias = layers[-1]
    R = r_max * torch.tanh(x @ weight.T + bias)[:, 0]
    P = torch.tensor(model.P.toarray())
    state = torch.tensor(model.pair_state.astype(np.int64))
    V = torch.zeros(model.n_states, dtype=torch.float64)
    for _ in range(300):
        q = P @ (R + GAMMA * V)
        sums = torch.zeros_like(V).index_add(0, state, torch.exp(q))
        V = torch.where(sums > 0, torch.log(torch.where(sums > 0, sums, 1.0)), 0.0)
    total = (q[model.pair_index(walks.state, walks.action)] - V[walks.state]).sum()
    return total / np.unique(walks.trajectory).size


@pytest.mark.parametrize("seed", range(3))
def test_gradient_agrees_with_automatic_differentiation(stochastic, seed):
    rng = np.random.default_rng(seed)
    features = rng.normal(size=(12, 3)).astype(np.float32).astype(np.float64)
    walks = []
    for n in (1, 3, 4):
        state, run = int(rng.integers(11)), []
        while len(run) < n and stochastic.actions_of(state).size:
            run.append((state, int(stochastic.actions_of(state)[0])))
            state = stochastic.sample(*run[-1], rng)
        walks.append(run)
    walks = Demonstrations.from_trajectories(walks)
    problem = RewardNetwork.build(
        stochastic,
        walks,
        features,
        DeepMaxEntConfig(hidden=(6, 5), r_max=2.0),
        gamma=GAMMA,
        rng=rng,
    )
    value, gradient = problem.value_and_gradient()

    arrays = problem.network.arrays()
    layers = [
        tuple(
            torch.tensor(arrays[f"0.{k}.{part}"].astype(np.float64), requires_grad=True)
            for part in ("weight", "bias")
        )
        for k in range(3)
    ]
    expected = objective_by_autograd(stochastic, walks, features, layers, 2.0)
    assert value == pytest.approx(expected.item(), rel=1e-5)
    expected.backward()
    rows = [torch.cat([w.grad, b.grad[:, None]], dim=1).ravel() for w, b in layers]
    expected = torch.cat(rows).numpy()
    np.testing.assert_allclose(gradient.numpy(), expected, rtol=1e-3, atol=1e-5)


def test_gradient_agrees_with_finite_differences(grid, optimal_walks):
    problem = RewardNetwork.build(
        grid.model,
        optimal_walks,
        grid.features,
        DeepMaxEntConfig(hidden=(8,), r_max=2.0),
        gamma=GAMMA,
        rng=np.random.default_rng(0),
    )
    gradient = problem.value_and_gradient()[1].clone()
    # Along the gradient, in steps that float32 resolves.
    direction = gradient / gradient.norm()
    at, values = problem.network.parameters.clone(), []
    for step in (-3e-3, 3e-3):
        problem.network.parameters.copy_(at + step * direction)
        values.append(problem.value_and_gradient()[0])
    slope = (values[1] - values[0]) / 6e-3
    assert slope == pytest.approx(float(gradient.norm()), rel=1e-2)


@pytest.mark.parametrize("grid", [5, 15], indirect=True)
def test_recovers_the_grid(grid, optimal_walks, share_of_optimum):
    R, network = deep_max_ent(
        grid.model,
        optimal_walks,
        grid.features,
        gamma=GAMMA,
        rng=np.random.default_rng(0),
        config=DeepMaxEntConfig(iterations=200),
    )
    np.testing.assert_allclose(R, 10 * network.values(grid.features), atol=1e-5)
    _, Q = value_iteration(grid.model, R, GAMMA)
    assert share_of_optimum(Q.argmax(axis=1)).min() >= 0.99


def test_training_climbs_and_is_deterministic(grid, optimal_walks):
    def after(iterations, seed=0):
        rng = np.random.default_rng(seed)
        config = DeepMaxEntConfig(iterations=iterations)
        return deep_max_ent(
            grid.model, optimal_walks, grid.features, gamma=GAMMA, rng=rng, config=config
        )

    rewards = [after(n)[0] for n in (0, 10, 100)]
    matching = FeatureMatching.build(grid.model, optimal_walks, gamma=GAMMA)
    values = [matching.value_and_surplus(R)[0] for R in rewards]
    assert all(b > a for a, b in pairwise(values))
    np.testing.assert_array_equal(rewards[1], after(10)[0])
    assert not np.array_equal(rewards[1], after(10, seed=1)[0])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"demonstrations": Demonstrations.empty()}, "at least one"),
        ({"features": np.zeros((3, 2))}, "features"),
        ({"features": None}, "features"),
        ({"gamma": 1.0}, "gamma"),
    ],
)
def test_bad_arguments_are_named(chain, arguments, words):
    given = {
        "demonstrations": Demonstrations.from_pairs([(0, 1)]),
        "features": np.zeros((4, 2)),
        "gamma": GAMMA,
        "rng": np.random.default_rng(0),
    }
    with pytest.raises(InputError, match=words):
        deep_max_ent(chain, **(given | arguments))
