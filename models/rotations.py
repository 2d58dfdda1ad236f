"""Rotations in every notation of the thesis, both ways, batched.

Arrays carry any leading dimensions ``[...]`` before the last one or two: rotation matrices
``[..., 3, 3]``, Euler angles and rotation vectors ``[..., 3]``, quaternions ``[..., 4]`` in
the order (w, x, y, z). Angles are in radians.

An orientation has many Euler angles, two quaternions and endlessly many rotation vectors.
Every ``matrix_to_…`` therefore answers one canonical representative, so that going to a
matrix and back is the cure for aliasing (thesis 5.7.1):

* Euler: β in [−π/2, π/2], α and γ in (−π, π], and γ = 0 at gimbal lock;
* quaternion: w ≥ 0, and where w = 0 the first component that is not zero is positive;
* rotation vector: angle in [0, π], and at π the first component that is not zero is positive.

A value within `ROUNDING` of such a border counts as on it; otherwise rounding alone could turn
one representative into another.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.arrays import finite_array, refuse_first
from models.errors import ModelError

ROUNDING = 1e-12
"""Distance (radians, unit quaternion components, cos β at gimbal lock) that counts as none."""
ORTHONORMAL = 1e-6
"""Largest ‖RᵀR − I‖ (Frobenius) accepted of a rotation matrix."""
LARGEST_ANGLE = 1e6
"""Largest angle, or component of a rotation vector, accepted [rad]: floats fix it to 1e-10."""

Array = NDArray[np.float64]


def rotation_x(angle: ArrayLike) -> Array:
    """Rotation about x by ``angle [...]`` in radians; ``[..., 3, 3]``.

    Raises:
        ModelError: if an angle is not a finite number, or beyond `LARGEST_ANGLE`.
    """
    return _about(0, angle)


def rotation_y(angle: ArrayLike) -> Array:
    """Rotation about y by ``angle [...]`` in radians; ``[..., 3, 3]``.

    Raises:
        ModelError: if an angle is not a finite number, or beyond `LARGEST_ANGLE`.
    """
    return _about(1, angle)


def rotation_z(angle: ArrayLike) -> Array:
    """Rotation about z by ``angle [...]`` in radians; ``[..., 3, 3]``.

    Raises:
        ModelError: if an angle is not a finite number, or beyond `LARGEST_ANGLE`.
    """
    return _about(2, angle)


def require_rotation(R: ArrayLike, name: str = "R") -> Array:
    """Give ``R [..., 3, 3]`` back as float64, if every matrix in it is a rotation.

    Raises:
        ModelError: if the shape is another, an entry is not finite, a matrix is not
            orthonormal within `ORTHONORMAL`, or it is a reflection.
    """
    R = finite_array(R, (3, 3), name)
    clipped = np.clip(R, -1e3, 1e3)  # no rotation either way, and its squares do not overflow
    gram = np.swapaxes(clipped, -1, -2) @ clipped - np.eye(3)
    defect = np.linalg.norm(gram, axis=(-2, -1))
    determinant = np.linalg.det(clipped)
    bad = (defect > ORTHONORMAL) | (determinant < 0)
    refuse_first(
        bad,
        name,
        lambda first: (
            f"is not a rotation: ‖RᵀR − I‖ = {defect[first]:.3g}, det = "
            f"{determinant[first]:.3g}; wanted at most {ORTHONORMAL:g} and +1"
        ),
    )
    return R


def xyz_euler_to_matrix(angles: ArrayLike) -> Array:
    """R = Rx(α)·Ry(β)·Rz(γ), thesis (5.5).

    Args:
        angles: (α, β, γ) ``[..., 3]`` in radians, about x, y, z.

    Raises:
        ModelError: if the shape is another, or an angle is not finite or beyond `LARGEST_ANGLE`.
    """
    return _turned_about((0, 1, 2), angles, "X-Y-Z Euler angles")


def zyx_euler_to_matrix(angles: ArrayLike) -> Array:
    """R = Rz(α)·Ry(β)·Rx(γ), thesis (5.7).

    Args:
        angles: (α, β, γ) ``[..., 3]`` in radians, about z, y, x: in (5.7) α is the turn
            about z, whereas Table 4.1 gives that name to the turn about x.

    Raises:
        ModelError: if the shape is another, or an angle is not finite or beyond `LARGEST_ANGLE`.
    """
    return _turned_about((2, 1, 0), angles, "Z-Y-X Euler angles")


def matrix_to_xyz_euler(R: ArrayLike) -> Array:
    """Canonical (α, β, γ) ``[..., 3]`` of ``R [..., 3, 3]``, the inverse of (5.5).

    Raises:
        ModelError: if a matrix is not a rotation.
    """
    return _canonical_euler(*_xyz_angles(require_rotation(R)))


def matrix_to_zyx_euler(R: ArrayLike) -> Array:
    """Canonical (α, β, γ) ``[..., 3]`` about z, y, x of ``R [..., 3, 3]``, the inverse of (5.7).

    Raises:
        ModelError: if a matrix is not a rotation.
    """
    # Counting the axes backwards mirrors space, so every turn changes its sign:
    # Rz(α)·Ry(β)·Rx(γ) becomes Rx(−α)·Ry(−β)·Rz(−γ).
    alpha, beta, gamma = _xyz_angles(require_rotation(R)[..., ::-1, ::-1])
    return _canonical_euler(-alpha, -beta, -gamma)


def canonical_quaternion(quaternion: ArrayLike) -> Array:
    """Unit quaternion ``[..., 4]`` (w, x, y, z) of the same rotation, canonical sign.

    Raises:
        ModelError: if the shape is another, a component is not finite, or all are zero.
    """
    q = finite_array(quaternion, (4,), "quaternion (w, x, y, z)")
    # Scaled by the largest component first: squares of tiny or huge ones leave the range.
    scale = np.max(np.abs(q), axis=-1, keepdims=True)
    if np.any(scale == 0):
        raise ModelError("quaternion (w, x, y, z) is zero: it names no rotation; give a unit one")
    q = q / scale
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return _first_positive(q)


def quaternion_to_matrix(quaternion: ArrayLike) -> Array:
    """Rotation matrix ``[..., 3, 3]`` of a quaternion ``[..., 4]``, normalised first; (5.8).

    Raises:
        ModelError: if the shape is another, a component is not finite, or all are zero.
    """
    w, x, y, z = np.moveaxis(canonical_quaternion(quaternion), -1, 0)
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def matrix_to_quaternion(R: ArrayLike) -> Array:
    """Canonical quaternion ``[..., 4]`` of ``R [..., 3, 3]``, the pseudocode of 5.7.3.

    Raises:
        ModelError: if a matrix is not a rotation.
    """
    R = require_rotation(R)
    r11, r12, r13, r21, r22, r23, r31, r32, r33 = np.moveaxis(R.reshape(*R.shape[:-2], 9), -1, 0)
    # 4·q·qᵀ, linear in R; each row is a multiple of q. The thesis' four branches are these
    # rows; the one with the largest diagonal never divides by a small number.
    rows = [
        [1 + r11 + r22 + r33, r32 - r23, r13 - r31, r21 - r12],
        [r32 - r23, 1 + r11 - r22 - r33, r12 + r21, r13 + r31],
        [r13 - r31, r12 + r21, 1 - r11 + r22 - r33, r23 + r32],
        [r21 - r12, r13 + r31, r23 + r32, 1 - r11 - r22 + r33],
    ]
    outer = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    largest = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
    row = np.take_along_axis(outer, largest[..., None, None], axis=-2)[..., 0, :]
    return canonical_quaternion(row)


def rotation_vector_to_matrix(vector: ArrayLike) -> Array:
    """R = exp([v]×) of a rotation vector: angle times unit axis, thesis (A.1), (A.2).

    The thesis calls this notation "X-Y-Z fixed-angle".

    Args:
        vector: ``[..., 3]`` in radians, in the frame that does not turn.

    Raises:
        ModelError: if the shape is another, or a component is not finite or beyond `LARGEST_ANGLE`.
    """
    v = _require_angles(vector, (3,), "rotation vector")
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(v, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*v.shape[:-1], 3, 3)
    # sin θ / θ and (1 − cos θ) / θ², both finite at θ = 0, where (A.1) divides by zero.
    sine = np.sinc(angle / np.pi)
    cosine = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    return np.eye(3) + sine * cross + cosine * (cross @ cross)


def matrix_to_rotation_vector(R: ArrayLike) -> Array:
    """Canonical rotation vector ``[..., 3]`` of ``R [..., 3, 3]``, thesis (A.3), (A.4).

    By way of the quaternion, which is exact where (A.3) divides by sin θ = 0 and where (A.4)
    divides by an α that may be zero.

    Raises:
        ModelError: if a matrix is not a rotation.
    """
    q = matrix_to_quaternion(R)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, q[..., :1])
    # angle / sine tends to 2 as both vanish; w < 0 by rounding only may exceed π by as much.
    factor = np.divide(np.minimum(angle, np.pi), sine, out=np.full_like(sine, 2.0), where=sine > 0)
    return factor * q[..., 1:]


def geodesic_angle(R1: ArrayLike, R2: ArrayLike) -> Array:
    """Angle in [0, π] of the rotation R1ᵀR2, precise near 0 and near π; shapes broadcast.

    Args:
        R1: rotation matrices ``[..., 3, 3]``.
        R2: rotation matrices ``[..., 3, 3]``.

    Raises:
        ModelError: if a matrix is not a rotation.
    """
    R1, R2 = require_rotation(R1, "R1"), require_rotation(R2, "R2")
    R = np.swapaxes(R1, -1, -2) @ R2
    twice_sine_axis = np.stack(
        [
            R[..., 2, 1] - R[..., 1, 2],
            R[..., 0, 2] - R[..., 2, 0],
            R[..., 1, 0] - R[..., 0, 1],
        ],
        axis=-1,
    )
    # arccos of the trace would lose half the digits at both ends.
    return np.arctan2(
        np.linalg.norm(twice_sine_axis, axis=-1), np.trace(R, axis1=-2, axis2=-1) - 1.0
    )


def _turned_about(axes: tuple[int, int, int], angles: ArrayLike, name: str) -> Array:
    angles = _require_angles(angles, (3,), name)
    first, second, third = (_about(axis, angles[..., i]) for i, axis in enumerate(axes))
    return first @ second @ third


def _xyz_angles(R: Array) -> tuple[Array, Array, Array]:
    """Angles α, β, γ of R = Rx(α)·Ry(β)·Rz(γ), γ = 0 at lock, signs of zero and π left aside."""
    cos_beta = np.hypot(R[..., 1, 2], R[..., 2, 2])
    locked = cos_beta < ROUNDING
    # At lock only α ± γ is defined: γ = 0 leaves R = Rx(α)·Ry(±π/2).
    alpha = np.where(
        locked,
        np.arctan2(R[..., 2, 1], R[..., 1, 1]),
        np.arctan2(-R[..., 1, 2], R[..., 2, 2]),
    )
    # arcsin loses half the digits near ±π/2; atan2 none.
    beta = np.arctan2(R[..., 0, 2], cos_beta)
    # The second row of Rx(α)ᵀR is (sin γ, cos γ, 0): γ makes up for whatever noise α has near lock.
    row = np.cos(alpha)[..., None] * R[..., 1, :] + np.sin(alpha)[..., None] * R[..., 2, :]
    gamma = np.where(locked, 0.0, np.arctan2(row[..., 0], row[..., 1]))
    return alpha, beta, gamma


def _canonical_euler(alpha: Array, beta: Array, gamma: Array) -> Array:
    return np.stack([_one_turn(alpha), beta + 0.0, _one_turn(gamma)], axis=-1)


def _about(axis: int, angle: ArrayLike) -> Array:
    angle = _require_angles(angle, (), "angle")
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.zeros((*angle.shape, 3, 3))
    R[..., axis, axis] = 1.0
    R[..., i, i] = R[..., j, j] = np.cos(angle)
    R[..., j, i] = np.sin(angle)
    R[..., i, j] = -R[..., j, i]
    return R


def _require_angles(value: ArrayLike, trailing: tuple[int, ...], name: str) -> Array:
    array = finite_array(value, trailing, name)
    if not (np.abs(array) <= LARGEST_ANGLE).all():
        raise ModelError(f"{name} holds an angle beyond {LARGEST_ANGLE:g} rad; wanted smaller ones")
    return array


def _one_turn(angle: Array) -> Array:
    """Map −π, reached by rounding only, to π; drop the sign of zero."""
    return np.where(angle <= ROUNDING - np.pi, np.pi, angle) + 0.0


def _first_positive(q: Array) -> Array:
    """Make w positive; where it is zero within rounding, the first component that is not."""
    clear = np.abs(q) > ROUNDING
    leading = np.take_along_axis(q, np.argmax(clear, axis=-1)[..., None], axis=-1)
    return q * np.where(leading < 0, -1.0, 1.0) + 0.0
