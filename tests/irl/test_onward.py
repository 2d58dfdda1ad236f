from fractions import Fraction

import numpy as np
import pytest
from scipy import sparse

from irl import onward
from irl.onward import Onward

GAMMA = 1 - 2.0**-20


def ring(n: int) -> sparse.csr_matrix:
    """Each state leads to the next, half of the time back to the first."""
    after = np.stack([(np.arange(n) + 1) % n, np.zeros(n, dtype=int)])
    entries = np.full(2 * n, 0.5), (np.tile(np.arange(n), 2), after.ravel())
    return sparse.csr_matrix(entries, shape=(n, n))


@pytest.mark.parametrize("krylov", [True, False])
def test_answers_are_exact_near_gamma_1(krylov):
    n, M = 24, ring(24)
    b = np.random.default_rng(0).normal(size=n)
    x = Onward(M, GAMMA, krylov).solve(b)
    # In fractions: x_i = b_i + γ/2 (x_{i+1} + x_0), each x being c + d x_0.
    half, c, d = Fraction(GAMMA) / 2, Fraction(0), Fraction(1)
    coefficients = []
    for i in reversed(range(n)):
        c, d = Fraction(b[i]) + half * c, half * (d + 1)
        coefficients.append((c, d))
    c0, d0 = coefficients[-1]
    x0 = c0 / (1 - d0)
    exact = np.array([float(c + d * x0) for c, d in reversed(coefficients)])
    assert np.abs(x - exact).max() <= 1e-13 * np.abs(exact).max()


def test_a_slow_chain_is_factorised_and_too_large_a_one_is_left(monkeypatch):
    n = 2000
    forth = sparse.diags([np.full(n, 0.5), np.full(n - 1, 0.5)], [0, 1], format="csr")
    system = Onward(forth, GAMMA)
    x = system.solve(np.ones(n))
    assert not system.krylov
    np.testing.assert_allclose(x - GAMMA * (forth @ x), 1.0, rtol=1e-9)
    monkeypatch.setattr(onward, "LARGEST", n - 1)
    assert Onward(forth, GAMMA).solve(np.ones(n)) is None


def test_nothing_earned_is_worth_nothing():
    assert not Onward(ring(5), GAMMA).solve(np.zeros(5)).any()


def test_tiny_rewards_are_worth_as_much_in_their_unit():
    b = np.random.default_rng(1).normal(size=24)
    scaled = Onward(ring(24), GAMMA).solve(b * 2.0**-900) * 2.0**900
    np.testing.assert_allclose(scaled, Onward(ring(24), GAMMA).solve(b), rtol=1e-13)


@pytest.mark.parametrize("across", [False, True])
@pytest.mark.parametrize("gamma", [0.0, 0.5, 0.95, 0.995])
def test_where_states_lead_to_many_and_sweeps_are_few_nothing_is_factorised(
    gamma, across, monkeypatch
):
    """Factors of a system whose states all lead to many others fill up."""
    monkeypatch.setattr(onward, "splu", None)
    rng = np.random.default_rng(2)
    W = sparse.random(200, 200, 0.1, random_state=rng, format="csr")
    W = sparse.diags(1 / np.maximum(np.asarray(W.sum(axis=1)).ravel(), 1e-9)) @ W
    W = (W.T if across else W).tocsr()
    b = rng.normal(size=200)
    x = Onward(W, gamma, krylov=False).solve(b)
    exact = np.linalg.solve(np.eye(200) - gamma * W.toarray(), b)
    np.testing.assert_allclose(x, exact, atol=1e-12 * np.abs(exact).max())
