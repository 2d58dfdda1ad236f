"""Rotations: group axioms, an independent library, and every singular case by name."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.common.eigen_geometry import AngleAxis, Quaternion
from pydrake.math import RollPitchYaw, RotationMatrix
from scipy.spatial.transform import Rotation

from models import rotations as rot
from models.errors import ModelError

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
SCIPY = {
    "xyz": lambda v: Rotation.from_euler("XYZ", v),
    "zyx": lambda v: Rotation.from_euler("ZYX", v),
    "quaternion": lambda v: Rotation.from_quat(v, scalar_first=True),
    "vector": Rotation.from_rotvec,
}
DRAKE = {
    "xyz": lambda v: (
        RotationMatrix.MakeXRotation(v[0])
        @ RotationMatrix.MakeYRotation(v[1])
        @ RotationMatrix.MakeZRotation(v[2])
    ),
    "zyx": lambda v: RollPitchYaw(v[2], v[1], v[0]).ToRotationMatrix(),
    "quaternion": lambda v: RotationMatrix(Quaternion(v / np.linalg.norm(v))),
    "vector": lambda v: RotationMatrix(
        AngleAxis(np.linalg.norm(v), v / np.linalg.norm(v))
        if np.linalg.norm(v) > 1e-100
        else AngleAxis()
    ),
}

# Every singular case lies at a multiple of 90° or at a component that vanishes: numbers at,
# near and away from them.
_near_zero = st.one_of(
    st.just(0.0), st.builds(lambda e, s: s * 10.0**e, st.floats(-16, -3), st.sampled_from([-1, 1]))
)
_turn = st.one_of(
    st.floats(-np.pi, np.pi),
    st.builds(lambda k, d: k * np.pi / 2 + d, st.integers(-4, 4), _near_zero),
)
_component = st.one_of(st.floats(-1.0, 1.0), _near_zero, st.sampled_from([-1.0, 1.0]))
_eulers = st.tuples(_turn, _turn, _turn).map(np.array)
_vectors = (
    st.tuples(_component, _component, _component)
    .map(np.array)
    .filter(lambda v: np.linalg.norm(v) > 1e-3)
    .flatmap(lambda v: _turn.map(lambda angle: angle * v / np.linalg.norm(v)))
)
_quaternions = (
    st.tuples(_component, _component, _component, _component)
    .map(np.array)
    .filter(lambda q: np.linalg.norm(q) > 1e-3)
    .flatmap(lambda q: _near_zero.map(lambda d: (1.0 + d) * q / np.linalg.norm(q)))
)
VALUES = {"xyz": _eulers, "zyx": _eulers, "quaternion": _quaternions, "vector": _vectors}
named_values = st.sampled_from(NOTATIONS).flatmap(
    lambda name: st.tuples(st.just(name), VALUES[name])
)
matrices = named_values.map(lambda named: TO_MATRIX[named[0]](named[1]))
every_notation = pytest.mark.parametrize("notation", NOTATIONS)
thorough = settings(max_examples=50, deadline=None)


def random_matrices(n: int, seed: int = 0) -> np.ndarray:
    return Rotation.random(n, rng=np.random.default_rng(seed)).as_matrix()


def right_angle_matrices() -> np.ndarray:
    """The 24 rotations of a cube and those half-way between: every border case at once."""
    turns = np.radians(45.0 * np.arange(8))
    grid = np.stack(np.meshgrid(turns, turns, turns, indexing="ij"), axis=-1).reshape(-1, 3)
    return rot.xyz_euler_to_matrix(grid)


@thorough
@given(named_values)
def test_matrices_are_orthonormal(named):
    notation, value = named
    R = TO_MATRIX[notation](value)
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=3e-15)
    assert np.linalg.det(R) == pytest.approx(1.0)


@every_notation
@thorough
@given(matrices)
def test_round_trip_from_a_matrix(notation, R):
    back = TO_MATRIX[notation](FROM_MATRIX[notation](R))
    np.testing.assert_allclose(back, R, atol=1.5 * rot.ROUNDING)


@every_notation
@thorough
@given(data=st.data())
def test_both_independent_libraries_agree_everywhere(notation, data):
    value = data.draw(VALUES[notation])
    R = TO_MATRIX[notation](value)
    np.testing.assert_allclose(R, SCIPY[notation](value).as_matrix(), atol=3e-15)
    np.testing.assert_allclose(R, DRAKE[notation](value).matrix(), atol=3e-15)


@thorough
@given(matrices)
def test_quaternions_agree_with_both_libraries_up_to_their_sign(R):
    ours = rot.matrix_to_quaternion(R)
    for theirs in (
        Rotation.from_matrix(R).as_quat(scalar_first=True),
        RotationMatrix(R).ToQuaternion().wxyz(),
    ):
        sign = np.sign(theirs @ ours)
        np.testing.assert_allclose(sign * theirs, ours, atol=2e-15)


@thorough
@given(matrices, matrices)
def test_angle_between_rotations_agrees_with_scipy(R1, R2):
    theirs = (Rotation.from_matrix(R1).inv() * Rotation.from_matrix(R2)).magnitude()
    assert rot.geodesic_angle(R1, R2) == pytest.approx(theirs, abs=1e-14)


@thorough
@given(_vectors)
def test_rotation_vectors_keep_every_digit(v):
    """Near 0 and near half a turn too, where (A.3) loses half of them."""
    angle = np.linalg.norm(v)
    turns = np.round(angle / (2 * np.pi))
    wrapped = v - 2 * np.pi * turns * v / angle if turns else v
    back = rot.matrix_to_rotation_vector(rot.rotation_vector_to_matrix(v))
    if np.pi - np.linalg.norm(wrapped) < 2 * rot.ROUNDING and back @ wrapped < 0:
        wrapped = -wrapped
    np.testing.assert_allclose(
        back, wrapped, atol=4 * rot.ROUNDING if turns or angle > 3 else 1e-14
    )


@pytest.mark.parametrize("notation", ["xyz", "zyx"])
@thorough
@given(_turn, _near_zero, _turn, st.sampled_from([-1.0, 1.0]))
def test_the_middle_euler_angle_keeps_every_digit_at_lock(notation, alpha, short, gamma, side):
    """arcsin would lose half of them."""
    beta = side * (np.pi / 2 - np.abs(short))
    R = TO_MATRIX[notation]((alpha, beta, gamma))
    assert FROM_MATRIX[notation](R)[1] == pytest.approx(beta, abs=1e-15)


@thorough
@given(matrices, matrices, matrices)
def test_group_axioms_in_every_notation(A, B, C):
    for notation in NOTATIONS:
        a, b, c = (TO_MATRIX[notation](FROM_MATRIX[notation](R)) for R in (A, B, C))
        np.testing.assert_allclose((a @ b) @ c, A @ (B @ C), atol=5 * rot.ROUNDING)
        inverse = TO_MATRIX[notation](FROM_MATRIX[notation](a.T))
        np.testing.assert_allclose(inverse @ a, np.eye(3), atol=3 * rot.ROUNDING)
        np.testing.assert_array_equal(
            TO_MATRIX[notation](FROM_MATRIX[notation](np.eye(3))), np.eye(3)
        )


@thorough
@given(_quaternions, st.floats(-300, 300), st.sampled_from([-1.0, 1.0]))
def test_a_quaternion_and_its_multiples_are_one_rotation(q, exponent, sign):
    q = np.where(np.abs(q) < 1e-14, 0.0, q)  # what scaling would underflow
    scaled = sign * 10.0**exponent * q
    np.testing.assert_allclose(
        rot.quaternion_to_matrix(scaled), rot.quaternion_to_matrix(q), atol=3e-15
    )


@thorough
@given(
    matrices,
    st.lists(st.floats(-1.0, 1.0), min_size=9, max_size=9).filter(lambda e: max(map(abs, e)) > 0.1),
    st.floats(-12.0, -1.0),
)
def test_a_matrix_is_refused_exactly_if_its_defect_is_too_large(R, entries, exponent):
    noisy = R + 10.0**exponent * np.reshape(entries, (3, 3))
    defect = np.linalg.norm(noisy.T @ noisy - np.eye(3))
    for convert in FROM_MATRIX.values():
        if defect > rot.ORTHONORMAL * (1 + 1e-9):
            with pytest.raises(ModelError, match=f"= {defect:.3g}".replace("+", r"\+")):
                convert(noisy)
        elif defect < rot.ORTHONORMAL * (1 - 1e-9):
            convert(noisy)


@thorough
@given(_eulers, _eulers)
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


@thorough
@given(_vectors)
def test_opposite_vectors_are_inverse_rotations(v):
    R = rot.rotation_vector_to_matrix(v)
    np.testing.assert_allclose(rot.rotation_vector_to_matrix(-v), R.T, atol=1e-15)


@pytest.mark.parametrize("matrices", [random_matrices(500), right_angle_matrices()])
@every_notation
def test_agrees_with_scipy(notation, matrices):
    ours = FROM_MATRIX[notation](matrices)
    reference = SCIPY[notation](ours)
    np.testing.assert_allclose(reference.as_matrix(), matrices, atol=1e-12)
    np.testing.assert_allclose(TO_MATRIX[notation](ours), reference.as_matrix(), atol=1e-13)


@every_notation
def test_one_orientation_has_one_representative_whatever_the_rounding(notation):
    R = right_angle_matrices()
    noisy = R + np.random.default_rng(1).uniform(-1e-15, 1e-15, R.shape)
    np.testing.assert_allclose(FROM_MATRIX[notation](noisy), FROM_MATRIX[notation](R), atol=1e-12)


@every_notation
@pytest.mark.parametrize("shape", [(), (4,), (2, 3), (0,), (2, 0), (1, 2, 3)])
def test_batches_are_elementwise_whatever_their_shape(notation, shape):
    R = (
        random_matrices(int(np.prod(shape))).reshape(*shape, 3, 3)
        if 0 not in shape
        else (np.zeros((*shape, 3, 3)))
    )
    values = FROM_MATRIX[notation](R)
    back = TO_MATRIX[notation](values)
    assert values.shape == (*shape, 4 if notation == "quaternion" else 3)
    assert back.shape == (*shape, 3, 3)
    for index in np.ndindex(shape):
        np.testing.assert_array_equal(values[index], FROM_MATRIX[notation](R[index]))
        np.testing.assert_array_equal(back[index], TO_MATRIX[notation](values[index]))
    assert rot.geodesic_angle(R, R).shape == shape
    for about in (rot.rotation_x, rot.rotation_y, rot.rotation_z):
        assert about(np.zeros(shape)).shape == (*shape, 3, 3)


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
    np.testing.assert_allclose(TO_MATRIX[notation](euler), R, atol=2e-12)
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
