import numpy as np
import pytest
from scipy.optimize import approx_fprime

from irl.baselines.bellman_gradient import smooth_maximum
from irl.baselines.differentiable_planning import HardMax, SoftMax
from irl.baselines.planned_likelihood import PlannedLikelihood
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.planning import value_iteration

REWARD = np.array([0.1, -0.2, 0.3, 1.0])
SHOWN = Demonstrations.from_pairs([(0, 1), (2, 1), (2, 0)])


@pytest.mark.parametrize("gamma", [0.0, 0.6, 0.95])
@pytest.mark.parametrize(
    ("maximum", "seeds", "near"),
    [
        (HardMax(), range(4), {"atol": 1e-4}),
        (SoftMax(), (4,), {"atol": 1e-5}),
        (smooth_maximum("soft", 5.0), (5,), {"rtol": 1e-3, "atol": 2e-5}),
        (smooth_maximum("norm", 60.0), (5,), {"rtol": 1e-3, "atol": 2e-5}),
    ],
)
def test_gradient_agrees_with_finite_differences(random_model, gamma, maximum, seeds, near):
    for seed in seeds:
        rng = np.random.default_rng(seed)
        model = random_model(rng, n_states=12, n_actions=3)
        features, weights = rng.normal(size=(12, 4)), rng.normal(size=4)
        rows = rng.integers(model.n_pairs, size=9)
        shown = Demonstrations.from_pairs(
            zip(model.pair_state[rows], model.pair_action[rows], strict=True)
        )
        likelihood = PlannedLikelihood.build(model, shown, gamma, maximum, beta=1.7)
        value = lambda w: likelihood.in_weights(features, w)[0]  # noqa: B023, E731
        numeric = approx_fprime(weights, value, 1e-6)
        gradient = likelihood.in_weights(features, weights)[1]
        np.testing.assert_allclose(gradient, numeric, **({"rtol": 0} | near))


def test_with_the_maximum_it_is_that_of_the_boltzmann_policy(chain):
    likelihood = PlannedLikelihood.build(chain, SHOWN, 0.9, HardMax(), beta=2.5)
    _, Q = value_iteration(chain, REWARD, 0.9)
    e = np.exp(2.5 * Q[:3])
    log_pi = np.log(e / e.sum(axis=1, keepdims=True))
    expected = np.mean([log_pi[pair] for pair in SHOWN.pairs])
    assert likelihood.value_and_gradient(REWARD)[0] == pytest.approx(expected)


def test_with_the_soft_maximum_it_is_that_of_the_soft_optimal_policy(chain):
    likelihood = PlannedLikelihood.build(chain, SHOWN, 0.9, SoftMax(), beta=1.0)
    V = np.zeros(4)
    for _ in range(1000):
        Q = chain.q_values(REWARD + 0.9 * V)
        V[:3] = np.log(np.exp(Q[:3]).sum(axis=1))
    log_pi = Q[:3] - V[:3, None]
    expected = np.mean([log_pi[pair] for pair in SHOWN.pairs])
    assert likelihood.value_and_gradient(REWARD)[0] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("shown", "gamma", "words"),
    [
        (Demonstrations.empty(), 0.9, "at least one"),
        (Demonstrations.from_pairs([(3, 1)]), 0.9, "infeasible"),
        (SHOWN, 1.0, "gamma"),
    ],
)
def test_bad_arguments_are_named(chain, shown, gamma, words):
    with pytest.raises(InputError, match=words):
        PlannedLikelihood.build(chain, shown, gamma, HardMax(), beta=1.0)
