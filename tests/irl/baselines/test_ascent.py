import numpy as np
import pytest

from irl.baselines.ascent import (
    AscentConfig,
    RidgeConfig,
    ascend,
    proximal_ascend,
    ridge_ascend,
    sparse_ascend,
)


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
    found = ascend(quadratic, np.zeros(6), AscentConfig(1e-8, 10_000))
    np.testing.assert_allclose(found.x, best, atol=1e-6)
    assert found.value == pytest.approx(quadratic(best)[0])


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5])
def test_proximal_ascent_meets_the_conditions_of_the_lasso(quadratic, share):
    l1 = share * np.abs(quadratic(np.zeros(6))[1]).max()
    found = proximal_ascend(quadratic, np.zeros(6), l1, AscentConfig(1e-10, 10_000))
    gradient = quadratic(found.x)[1]
    used = found.x != 0
    np.testing.assert_allclose(gradient[used], l1 * np.sign(found.x[used]), atol=1e-6)
    assert (np.abs(gradient[~used]) <= l1 + 1e-6).all()
    assert found.value == pytest.approx(quadratic(found.x)[0] - l1 * np.abs(found.x).sum())


def test_price_above_all_gradients_leaves_nothing(quadratic):
    l1 = 1.01 * np.abs(quadratic(np.zeros(6))[1]).max()
    found = proximal_ascend(quadratic, np.zeros(6), l1, AscentConfig(1e-9, 100))
    assert not found.x.any()
    assert found.iterations == 0


def test_callback_follows(quadratic):
    told = []
    found = ascend(
        quadratic,
        np.zeros(6),
        AscentConfig(1e-3, 50),
        callback=lambda done, value: told.append((done, value)),
    )
    assert [done for done, _ in told] == list(range(1, found.iterations + 1))
    assert max(value for _, value in told) == found.value


@pytest.mark.parametrize("sparsity", [0.0, 0.2, 1.0])
def test_the_price_is_a_share_of_that_which_leaves_nothing(quadratic, sparsity):
    found, l1 = sparse_ascend(quadratic, np.zeros(6), sparsity, AscentConfig(1e-9, 10_000))
    assert l1 == sparsity * np.abs(quadratic(np.zeros(6))[1]).max()
    assert found.x.any() == (sparsity < 1)


@pytest.mark.parametrize("l2", [0.0, 0.5, 30.0])
def test_ridge_ascent_agrees_with_the_closed_form(quadratic, l2):
    A, b = quadratic.A, quadratic.b
    best = np.linalg.solve(A.T @ A + l2 * np.eye(6), A.T @ b)
    found = ridge_ascend(quadratic, np.zeros(6), RidgeConfig(l2=l2))
    np.testing.assert_allclose(found, best, atol=1e-6)
