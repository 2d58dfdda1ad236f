"""Rotations: group axioms, an independent library, and every singular case by name."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from models import rotations as rot
from models.errors import ModelError

angle = st.floats(-10.0, 10.0)
angles = st.tuples(angle, angle, angle)

TO_MATRIX = {
    "xyz": rot.xyz_euler_to_matrix,
    "zyx": rot.zyx_euler_to_matrix,
    "quaternion": rot.quaternion_to_matrix,
    "vector": rot.rotation_vector_to_matrix,
}
FROM_MATRIX = {
    "xyz": rot.matrix_to_xyz_euler,
    "zyx": rot.matrix_to_zyx_euler,
    "quaternion": rot.matrix_to_quaternion,
    "vector": rot.matrix_to_rotation_vector,
}
NOTATIONS = sorted(TO_MATRIX)


def random_matrices(n: int, seed: int = 0) -> np.ndarray:
    return Rotation.random(n, rng=np.random.default_rng(seed)).as_matrix()


def right_angle_matrices() -> np.ndarray:
    """The 24 rotations of a cube and those half-way between: every border case at once."""
    turns = np.radians(45.0 * np.arange(8))
    grid = np.stack(np.meshgrid(turns, turns, turns, indexing="ij"), axis=-1).reshape(-1, 3)
    return rot.xyz_euler_to_matrix(grid)


@settings(max_examples=60, deadline=None)
@given(angles)
def test_matrices_are_orthonormal(v):
    for notation in ("xyz", "zyx", "vector"):
        R = TO_MATRIX[notation](v)
        np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-14)
        assert np.linalg.det(R) == pytest.approx(1.0)


@settings(max_examples=60, deadline=None)
@given(angles, st.sampled_from(NOTATIONS))
def test_round_trip_from_a_matrix(v, notation):
    R = rot.xyz_euler_to_matrix(v)
    np.testing.assert_allclose(TO_MATRIX[notation](FROM_MATRIX[notation](R)), R, atol=1e-9)


@settings(max_examples=60, deadline=None)
@given(angles, angles)
def test_quaternions_compose_like_matrices(u, v):
    def product(a, b):
        (aw, ax, ay, az), (bw, bx, by, bz) = a, b
        return [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ]

    R1, R2 = rot.xyz_euler_to_matrix(u), rot.zyx_euler_to_matrix(v)
    q = product(rot.matrix_to_quaternion(R1), rot.matrix_to_quaternion(R2))
    np.testing.assert_allclose(rot.quaternion_to_matrix(q), R1 @ R2, atol=1e-13)


@settings(max_examples=60, deadline=None)
@given(angles)
def test_opposite_vectors_are_inverse_rotations(v):
    R = rot.rotation_vector_to_matrix(v)
    np.testing.assert_allclose(rot.rotation_vector_to_matrix(-np.array(v)), R.T, atol=1e-15)


@pytest.mark.parametrize("matrices", [random_matrices(500), right_angle_matrices()])
@pytest.mark.parametrize("notation", NOTATIONS)
def test_agrees_with_scipy(notation, matrices):
    ours = FROM_MATRIX[notation](matrices)
    reference = {
        "xyz": lambda v: Rotation.from_euler("XYZ", v),
        "zyx": lambda v: Rotation.from_euler("ZYX", v),
        "quaternion": lambda v: Rotation.from_quat(v, scalar_first=True),
        "vector": Rotation.from_rotvec,
    }[notation](ours)
    np.testing.assert_allclose(reference.as_matrix(), matrices, atol=1e-12)
    np.testing.assert_allclose(TO_MATRIX[notation](ours), reference.as_matrix(), atol=1e-13)


@pytest.mark.parametrize("notation", NOTATIONS)
def test_one_orientation_has_one_representative_whatever_the_rounding(notation):
    R = right_angle_matrices()
    noisy = R + np.random.default_rng(1).uniform(-1e-15, 1e-15, R.shape)
    np.testing.assert_allclose(FROM_MATRIX[notation](noisy), FROM_MATRIX[notation](R), atol=1e-12)


@pytest.mark.parametrize("notation", NOTATIONS)
def test_batches_are_elementwise(notation):
    R = random_matrices(6).reshape(2, 3, 3, 3)
    whole = FROM_MATRIX[notation](R)
    np.testing.assert_array_equal(whole[1, 2], FROM_MATRIX[notation](R[1, 2]))
    np.testing.assert_array_equal(
        TO_MATRIX[notation](whole)[0, 1], TO_MATRIX[notation](whole[0, 1])
    )


def test_ranges_of_the_canonical_representatives():
    R = np.concatenate([random_matrices(500), right_angle_matrices()])
    for notation in ("xyz", "zyx"):
        alpha, beta, gamma = FROM_MATRIX[notation](R).T
        assert (np.abs(beta) <= np.pi / 2).all()
        for turn in (alpha, gamma):
            assert (turn > -np.pi).all() and (turn <= np.pi).all()
    assert (rot.matrix_to_quaternion(R)[:, 0] >= -1e-12).all()
    assert (np.linalg.norm(rot.matrix_to_rotation_vector(R), axis=1) <= np.pi + 1e-12).all()


@pytest.mark.parametrize(
    ("euler", "canonical"),
    [
        # thesis 5.7.1: α + γ at β = π/2, α − γ at β = −π/2, and γ = 0.
        ((0.3, np.pi / 2, 0.4), (0.7, np.pi / 2, 0.0)),
        ((0.3, -np.pi / 2, 0.4), (-0.1, -np.pi / 2, 0.0)),
        ((0.1, np.pi - 0.2, 0.3), (0.1 - np.pi, 0.2, 0.3 - np.pi)),
        ((-np.pi, 0.0, 0.0), (np.pi, 0.0, 0.0)),
    ],
)
def test_xyz_euler_aliases(euler, canonical):
    R = rot.xyz_euler_to_matrix(euler)
    np.testing.assert_allclose(rot.matrix_to_xyz_euler(R), canonical, atol=1e-12)


@pytest.mark.parametrize(
    ("euler", "canonical"),
    [
        # thesis 5.7.2: α − γ at β = π/2, α + γ at β = −π/2, and γ = 0.
        ((0.3, np.pi / 2, 0.4), (-0.1, np.pi / 2, 0.0)),
        ((0.3, -np.pi / 2, 0.4), (0.7, -np.pi / 2, 0.0)),
    ],
)
def test_zyx_euler_aliases(euler, canonical):
    R = rot.zyx_euler_to_matrix(euler)
    np.testing.assert_allclose(rot.matrix_to_zyx_euler(R), canonical, atol=1e-12)


@pytest.mark.parametrize("short_of_lock", [1e-4, 1e-7, 1e-9, 1e-11, 0.0])
@pytest.mark.parametrize("notation", ["xyz", "zyx"])
def test_nothing_is_lost_near_gimbal_lock(notation, short_of_lock):
    R = TO_MATRIX[notation]((0.3, np.pi / 2 - short_of_lock, 0.4))
    euler = FROM_MATRIX[notation](R)
    np.testing.assert_allclose(TO_MATRIX[notation](euler), R, atol=2e-11)
    assert euler[1] == pytest.approx(np.pi / 2 - short_of_lock, abs=1e-15)


def test_quaternions_near_unit_are_normalised_and_signed():
    np.testing.assert_allclose(
        rot.canonical_quaternion([-2.0, 0, 0, -2.0]), [0.5**0.5, 0, 0, 0.5**0.5]
    )
    np.testing.assert_allclose(rot.canonical_quaternion([0, -3.0, 0, 4.0]), [0, 0.6, 0, -0.8])
    np.testing.assert_allclose(rot.canonical_quaternion([1e-200, 0, 0, 0]), [1, 0, 0, 0])
    R = rot.quaternion_to_matrix([1.001, 0.02, -0.03, 0.04])
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-15)


def test_rotation_vector_at_zero_and_at_half_a_turn():
    np.testing.assert_array_equal(rot.matrix_to_rotation_vector(np.eye(3)), np.zeros(3))
    np.testing.assert_array_equal(rot.rotation_vector_to_matrix(np.zeros(3)), np.eye(3))
    for axis in ([1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0.6, -0.8], [-0.6, 0, 0.8]):
        half_turn = 2 * np.outer(axis, axis) - np.eye(3)
        first = next(component for component in axis if component)
        np.testing.assert_allclose(
            rot.matrix_to_rotation_vector(half_turn), np.pi * np.sign(first) * np.array(axis)
        )


@pytest.mark.parametrize("size", [1e-300, 1e-12, 1e-8, 1e-4, 1.0, 3.0, np.pi - 1e-5, np.pi - 1e-9])
def test_small_and_large_angles_keep_their_digits(size):
    v = size * np.array([2.0, -1.0, 2.0]) / 3
    R = rot.rotation_vector_to_matrix(v)
    np.testing.assert_allclose(rot.matrix_to_rotation_vector(R), v, rtol=1e-12, atol=1e-15)
    base = random_matrices(1)[0]
    assert rot.geodesic_angle(base, base @ R) == pytest.approx(size, rel=1e-6, abs=1e-15)


def test_geodesic_angle_is_a_metric():
    A, B, C = random_matrices(300).reshape(3, 100, 3, 3)
    np.testing.assert_allclose(rot.geodesic_angle(A, B), rot.geodesic_angle(B, A), atol=1e-14)
    np.testing.assert_allclose(rot.geodesic_angle(A, A), 0, atol=1e-15)
    assert (
        rot.geodesic_angle(A, C) <= rot.geodesic_angle(A, B) + rot.geodesic_angle(B, C) + 1e-14
    ).all()
    assert rot.geodesic_angle(A[:, None], B[None]).shape == (100, 100)


def test_elementary_rotations_turn_counter_clockwise():
    quarter = np.pi / 2
    x, y, z = np.eye(3)
    np.testing.assert_allclose(rot.rotation_x(quarter) @ y, z, atol=1e-15)
    np.testing.assert_allclose(rot.rotation_y(quarter) @ z, x, atol=1e-15)
    np.testing.assert_allclose(rot.rotation_z(quarter) @ x, y, atol=1e-15)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: rot.matrix_to_quaternion(np.diag([1.0, 1, -1])), "det = -1"),
        (lambda: rot.matrix_to_xyz_euler(1.1 * np.eye(3)), "‖RᵀR − I‖ = 0.364"),
        (lambda: rot.require_rotation([np.eye(3), np.zeros((3, 3))], "R_WO"), r"R_WO\[1\]"),
        (lambda: rot.matrix_to_zyx_euler(np.eye(4)), r"shape \[4, 4\]; wanted \[\.\.\., 3, 3\]"),
        (lambda: rot.matrix_to_quaternion(np.full((3, 3), np.nan)), "not finite"),
        (lambda: rot.quaternion_to_matrix([0, 0, 0, 0]), "is zero"),
        (lambda: rot.quaternion_to_matrix([1, 0, 0]), r"wanted \[\.\.\., 4\]"),
        (lambda: rot.rotation_vector_to_matrix(1.0), r"shape \[\]"),
    ],
)
def test_what_is_no_rotation_is_refused(call, said):
    with pytest.raises(ModelError, match=said) as error:
        call()
    assert "\n" not in str(error.value)
