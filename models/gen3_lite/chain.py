"""The Gen3 Lite's kinematic chain, exact, and Newton's method on it: the second stage.

Frame B is the arm's base, E its end effector (`description/gen3_lite.urdf`), which a gripper
or a table does not change.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.compiled import compiled
from models.rotations import rotation_x, rotation_y

Array = NDArray[np.float64]

ORIGIN = np.array(
    [
        [0.0, 0.0, 0.12825],
        [0.0, -0.03, 0.115],
        [0.0, 0.28, 0.0],
        [0.0, -0.14, 0.02],
        [0.0285, 0.0, 0.105],
        [-0.105, 0.0, 0.0285],
    ]
)
"""Origin of each joint in the preceding link ``[6, 3]`` [m]; E is the last link."""
TURN = np.stack(
    [
        np.eye(3),
        rotation_x(1.5708),
        rotation_x(-3.1416),
        rotation_x(1.5708),
        rotation_y(1.5708),
        rotation_y(-1.5708),
    ]
)
"""Rotation of each joint's frame in the preceding link at q = 0, with the vendor's rounding."""
LIMIT = np.array([2.68, 2.61, 2.61, 2.6, 2.53, 2.6])
"""Largest magnitude of each joint angle [rad]."""

TOLERANCE = 1e-11
"""Largest component of an answer's error [m, rad]."""

# Of Newton's method; two iterations suffice mostly; [rad] and [(m, rad)²].
_ITERATIONS, _STEP, _DAMPING = 30, 0.3, 1e-16


def forward(q: ArrayLike) -> tuple[Array, Array]:
    """R_BE ``[3, 3]`` and p_BE ``[3]`` [m] at joint angles ``q [6]`` [rad], by the exact chain."""
    return _chain(np.asarray(q, dtype=np.float64), np.empty((6, 6)))


def tune(q: ArrayLike, R_BE: ArrayLike, p_BE: ArrayLike) -> Array | None:
    """Newton's method on the exact chain, damped: the second stage alone, from any start.

    Args:
        q: joint angles ``[6]`` [rad] to start from.
        R_BE: wanted rotation of the end effector ``[3, 3]``.
        p_BE: wanted position ``[3]`` [m].

    Returns:
        Joint angles ``[6]`` within [−π, π) [rad] that meet the pose within 1e-11 m and rad; None
        if it does not converge.
    """
    tuned = np.array(q, dtype=np.float64)[None]
    R, p = np.array(R_BE, dtype=np.float64)[None], np.array(p_BE, dtype=np.float64)[None]
    return tuned[0] if tune_batch(tuned, R, p)[1, 0] < TOLERANCE else None


@compiled()
def tune_batch(q: Array, R_BE: Array, p_BE: Array) -> Array:
    """`tune` of n starts ``q [n, 6]``, each for its own pose, in place.

    Returns:
        Largest component of the pose's error [m, rad] before and after, ``[2, n]``.
    """
    errors = np.empty((2, len(q)))
    for i in range(len(q)):
        errors[0, i], errors[1, i] = _tune(q[i], R_BE[i], p_BE[i])
    return errors


@compiled(error_model="numpy")
def _tune(q: Array, R_BE: Array, p_BE: Array) -> tuple[float, float]:
    J, error = np.empty((6, 6)), np.empty(6)
    before = worst = np.inf
    for iteration in range(_ITERATIONS):
        R, p = _chain(q, J)
        worst, cosines, damping = 0.0, 0.0, _DAMPING
        for k in range(3):
            m, n = (k + 1) % 3, (k + 2) % 3
            error[k] = 0.0  # half the axes' cross products: the rotation vector, to first order
            for i in range(3):
                error[k] += 0.5 * (R[m, i] * R_BE[n, i] - R[n, i] * R_BE[m, i])
                cosines += R[k, i] * R_BE[k, i]
            error[k + 3] = p_BE[k] - p[k]
        for i in range(6):
            worst = max(worst, abs(error[i]))
            damping += 1e-2 * error[i] ** 2
        if cosines < 0.0:  # the cross products vanish at half a turn as well
            worst = np.inf
        if iteration == 0:
            before = worst
        if worst < 1e-2 * TOLERANCE:
            break
        _least_squares_step(J, error, damping)
        largest = np.abs(error).max()
        for i in range(6):
            q[i] += error[i] * min(1.0, _STEP / largest)
    for i in range(6):
        q[i] = (q[i] + np.pi) % (2.0 * np.pi) - np.pi
    return before, worst


@compiled()
def _least_squares_step(J: Array, x: Array, damping: float) -> None:
    """Replace ``x [6]`` by J^T (J J^T + damping)^-1 x, by Cholesky's decomposition."""
    C = np.zeros((6, 6))
    for i in range(6):
        for j in range(i + 1):
            total = damping if i == j else 0.0
            for k in range(6):
                total += J[i, k] * J[j, k]
            for k in range(j):
                total -= C[i, k] * C[j, k]
            C[i, j] = np.sqrt(total) if i == j else total / C[j, j]
    for i in range(6):
        for k in range(i):
            x[i] -= C[i, k] * x[k]
        x[i] /= C[i, i]
    for i in range(5, -1, -1):
        for k in range(i + 1, 6):
            x[i] -= C[k, i] * x[k]
        x[i] /= C[i, i]
    step = np.zeros(6)
    for i in range(6):
        for k in range(6):
            step[k] += J[i, k] * x[i]
    x[:] = step


@compiled()
def _chain(q: Array, J: Array) -> tuple[Array, Array]:
    """R_BE ``[3, 3]``, p_BE ``[3]``; writes the Jacobian ``J [6, 6]``: angular, linear, in B."""
    R, p, turned = np.eye(3), np.zeros(3), np.empty(3)
    for i in range(6):
        sine, cosine = np.sin(q[i]), np.cos(q[i])
        for k in range(3):
            for j in range(3):
                p[k] += R[k, j] * ORIGIN[i, j]
                turned[j] = 0.0
                for m in range(3):
                    turned[j] += R[k, m] * TURN[i, m, j]
            R[k, 0] = cosine * turned[0] + sine * turned[1]
            R[k, 1] = cosine * turned[1] - sine * turned[0]
            R[k, 2] = turned[2]
            J[k, i], J[k + 3, i] = R[k, 2], p[k]
    for i in range(6):
        x, y, z = p[0] - J[3, i], p[1] - J[4, i], p[2] - J[5, i]
        J[3, i] = J[1, i] * z - J[2, i] * y
        J[4, i] = J[2, i] * x - J[0, i] * z
        J[5, i] = J[0, i] * y - J[1, i] * x
    return R, p
