"""Roots against polynomials made from known ones."""

import numpy as np
import pytest

from models.gen3_lite.trigonometric_roots import trigonometric_roots


def sampled(angles, degree):
    """Values of Π sin((x − a)/2) at 2·degree + 1 equispaced angles; one row."""
    x = 2.0 * np.pi * np.arange(2 * degree + 1) / (2 * degree + 1)
    return np.prod(np.sin((x[:, None] - angles) / 2.0), axis=1)[None]


@pytest.mark.parametrize("degree", [1, 2, 5, 8])
def test_real_roots_lie_on_the_circle(degree):
    rng = np.random.default_rng(degree)
    # Well apart: neighbouring roots trade accuracy.
    angles = np.sort(np.linspace(-3.0, 2.8, 2 * degree) + rng.uniform(-0.1, 0.1, 2 * degree))
    roots = trigonometric_roots(sampled(angles, degree))[0]
    np.testing.assert_allclose(np.abs(roots), 1.0, atol=1e-7)
    np.testing.assert_allclose(np.sort(np.angle(roots)), angles, atol=1e-7)


def test_other_roots_are_mirrored_at_the_circle():
    # cos(x − 0.3) = 2 at x = 0.3 ± i·arccosh 2.
    x = 2.0 * np.pi * np.arange(3) / 3
    roots = trigonometric_roots((np.cos(x - 0.3) - 2.0)[None])[0]
    np.testing.assert_allclose(np.angle(roots), 0.3, atol=1e-12)
    np.testing.assert_allclose(np.sort(np.log(np.abs(roots))), [-np.arccosh(2), np.arccosh(2)])


def test_a_double_root_stays_near_the_circle():
    roots = trigonometric_roots(sampled(np.array([1.0, 1.0, -2.0, 2.0]), 2))[0]
    near = roots[np.abs(np.angle(roots) - 1.0) < 0.5]
    assert len(near) == 2
    np.testing.assert_allclose(near, np.exp(1j), atol=1e-6)


def test_missing_harmonics_take_roots_away():
    angles = np.array([0.5, -1.0])
    x = 2.0 * np.pi * np.arange(17) / 17
    low = np.prod(np.sin((x[:, None] - angles) / 2.0), axis=1)
    roots = trigonometric_roots(np.stack([low, np.ones(17), np.zeros(17)]))
    assert roots.shape == (3, 16)
    assert np.isnan(roots[1:]).all()
    found = roots[0][~np.isnan(roots[0])]
    np.testing.assert_allclose(np.sort(np.angle(found)), np.sort(angles), atol=1e-12)


def test_rows_are_independent():
    rng = np.random.default_rng(0)
    values = rng.normal(size=(7, 17))
    together = trigonometric_roots(values)
    for row, roots in zip(values, together, strict=True):
        np.testing.assert_allclose(trigonometric_roots(row[None])[0], roots)
        assert (np.sort(np.abs(roots)) > 0).all()
