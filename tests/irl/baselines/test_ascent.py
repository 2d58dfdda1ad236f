import numpy as np
import pytest

from irl.baselines.ascent import ascend, proximal_ascend


@pytest.fixture
def quadratic():
    """−|A x − b|² / 2, badly scaled, and its gradient."""
    rng = np.random.default_rng(0)
    A, b = rng.normal(size=(20, 6)) * np.array([1, 2, 4, 1, 0.5, 3]), rng.normal(size=20)

    def objective(x):
        return -((A @ x - b) ** 2).sum() / 2, A.T @ (b - A @ x)

    objective.A, objective.b = A, b
    return objective


def test_ascent_reaches_least_squares(quadratic):
    best = np.linalg.lstsq(quadratic.A, quadratic.b, rcond=None)[0]
    found = ascend(quadratic, np.zeros(6), tolerance=1e-8, max_iterations=10_000)
    np.testing.assert_allclose(found.x, best, atol=1e-6)
    assert found.value == pytest.approx(quadratic(best)[0])


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5])
def test_proximal_ascent_meets_the_conditions_of_the_lasso(quadratic, share):
    l1 = share * np.abs(quadratic(np.zeros(6))[1]).max()
    found = proximal_ascend(quadratic, np.zeros(6), l1, tolerance=1e-10, max_iterations=10_000)
    gradient = quadratic(found.x)[1]
    used = found.x != 0
    np.testing.assert_allclose(gradient[used], l1 * np.sign(found.x[used]), atol=1e-6)
    assert (np.abs(gradient[~used]) <= l1 + 1e-6).all()
    assert found.value == pytest.approx(quadratic(found.x)[0] - l1 * np.abs(found.x).sum())


def test_price_above_all_gradients_leaves_nothing(quadratic):
    l1 = 1.01 * np.abs(quadratic(np.zeros(6))[1]).max()
    found = proximal_ascend(quadratic, np.zeros(6), l1, tolerance=1e-9, max_iterations=100)
    assert not found.x.any()
    assert found.iterations == 0


def test_callback_follows(quadratic):
    told = []
    found = ascend(
        quadratic,
        np.zeros(6),
        tolerance=1e-3,
        max_iterations=50,
        callback=lambda done, value: told.append((done, value)),
    )
    assert [done for done, _ in told] == list(range(1, found.iterations + 1))
    assert max(value for _, value in told) == found.value
