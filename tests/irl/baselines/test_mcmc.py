from itertools import islice

import numpy as np
import pytest

from irl.baselines.mcmc import crank_nicolson, effective_sample_size, split_r_hat


def walk(log_likelihood, start, seed=0, scale=2.0, burn_in=500, n=20_000):
    steps = crank_nicolson(log_likelihood, start, scale, np.random.default_rng(seed), burn_in)
    return list(islice(steps, n))


def test_draws_have_the_moments_of_a_gaussian_posterior():
    # Prior N(0, 2²); one observation each, 1 and −3, with standard deviations 0.5 and 1.
    seen, noise = np.array([1.0, -3.0]), np.array([0.5, 1.0])
    steps = walk(lambda x: (-((((x - seen) / noise) ** 2).sum()) / 2, x.sum()), np.zeros(2))
    x = np.array([step.x for step in steps])
    precision = 1 / 4 + 1 / noise**2
    np.testing.assert_allclose(x.mean(axis=0), seen / noise**2 / precision, atol=0.05)
    np.testing.assert_allclose(x.std(axis=0), precision**-0.5, rtol=0.06)
    for step in steps[::1000]:
        assert step.extra == step.x.sum()
    assert 0.2 < np.mean([step.accepted for step in steps]) < 0.4


def test_without_evidence_the_prior_is_drawn_from():
    x = np.array([step.x[0] for step in walk(lambda x: (0.0, None), np.array([40.0]))])
    assert abs(x.mean()) < 0.1
    assert x.std() == pytest.approx(2.0, rel=0.05)


def autoregressive(rho, rng, m, n):
    draws = np.empty((m, n))
    here = rng.standard_normal(m)
    for k in range(n):
        here = rho * here + np.sqrt(1 - rho**2) * rng.standard_normal(m)
        draws[:, k] = here
    return draws


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9])
def test_effective_size_is_that_of_an_autoregressive_chain(rho):
    draws = autoregressive(rho, np.random.default_rng(0), 4, 5000)
    expected = draws.size * (1 - rho) / (1 + rho)
    assert effective_sample_size(draws) == pytest.approx(expected, rel=0.15)


def test_r_hat_tells_chains_apart():
    draws = np.random.default_rng(0).standard_normal((4, 500, 3))
    assert split_r_hat(draws).shape == effective_sample_size(draws).shape == (3,)
    assert (split_r_hat(draws) < 1.02).all()
    draws[0, :, 1] += 2.0  # one chain elsewhere
    draws[:, :, 2] += np.linspace(0, 3, 500)  # all drift together
    apart = split_r_hat(draws)
    assert apart[0] < 1.02
    assert (apart[1:] > 1.2).all()
    assert effective_sample_size(draws)[1] < 50


def test_what_does_not_vary_has_converged():
    assert split_r_hat(np.ones((2, 10))) == 1.0
    assert effective_sample_size(np.ones((2, 10))) == 20
