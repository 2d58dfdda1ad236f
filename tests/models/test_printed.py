"""Rotation matrices that were printed are rotations again, and what is none is refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from models.errors import ModelError
from models.printed import SIX_DECIMALS, renormalised
from models.rotations import ORTHONORMAL, matrix_to_quaternion, require_rotation


def defect(R):
    return np.linalg.norm(np.swapaxes(R, -1, -2) @ R - np.eye(3), axis=(-2, -1))


def test_a_printed_matrix_becomes_the_rotation_that_was_printed():
    R = Rotation.random(10_000, random_state=0).as_matrix()
    printed = np.round(R, 6)
    assert (defect(printed) > ORTHONORMAL).any()  # what a log holds is refused everywhere
    with pytest.raises(ModelError, match="not a rotation"):
        require_rotation(printed)
    again = renormalised(printed)
    assert defect(again).max() < 1e-14
    assert np.linalg.norm(again - R, axis=(-2, -1)).max() <= 2 * SIX_DECIMALS
    assert np.linalg.norm(again - printed, axis=(-2, -1)).max() <= SIX_DECIMALS
    matrix_to_quaternion(again)


def test_it_is_the_nearest_rotation_also_by_scipy():
    """SciPy finds it by the quaternion of the polar decomposition."""
    R = np.round(Rotation.random(1000, random_state=1).as_matrix(), 6)
    wanted = Rotation.from_matrix(R).as_matrix()
    np.testing.assert_allclose(renormalised(R), wanted, atol=1e-12)


@given(st.integers(2, 6), st.integers(0, 2**32 - 1))
@settings(max_examples=100, deadline=None)
def test_tolerances_go_with_the_decimals(decimals, seed):
    R = Rotation.random(random_state=seed).as_matrix()
    assert defect(renormalised(np.round(R, decimals), 1.5 * 10.0**-decimals)) < 1e-14


def test_shapes_are_kept_and_a_rotation_stays_itself():
    R = Rotation.random(6, random_state=2).as_matrix().reshape(2, 3, 3, 3)
    np.testing.assert_allclose(renormalised(R), R, atol=1e-15)
    assert renormalised(np.eye(3)).shape == (3, 3)


@pytest.mark.parametrize(
    ("R", "message"),
    [
        (np.diag([1.0, 1.0, -1.0]), "R is 2 from the nearest rotation; valid: at most 1.5e-06"),
        (np.stack([np.eye(3), 1.001 * np.eye(3)]), r"R\[1\] is 0.00173"),
        (np.round(Rotation.random(random_state=0).as_matrix(), 3), "from the nearest rotation"),
        (np.zeros((3, 3)), "from the nearest rotation"),
        (np.eye(4), r"shape \[4, 4\]; valid: \[..., 3, 3\]"),
        (1.0, r"shape \[\]"),
        (np.full((3, 3), np.nan), "not finite"),
        ("rotation", "valid: numbers"),
    ],
)
def test_what_is_no_printed_rotation_is_refused(R, message):
    with pytest.raises(ModelError, match=message):
        renormalised(R)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, np.nan, 0.2])
def test_tolerances_that_are_none_are_refused(tolerance):
    with pytest.raises(ModelError, match="tolerance"):
        renormalised(np.eye(3), tolerance)
