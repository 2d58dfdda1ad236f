"""The Gen3's inverse kinematics in closed form, with q3 as the redundancy parameter.

Frame B is the arm's base, E its end effector (`description/gen3.urdf`); a gripper or a table
change nothing here. In frames whose axes are parallel at q = 0, and with right angles, the arm is

    Rx(π) · Rz(q1) · Ry(−q2) · Rz(q3) · Ry(−q4) · Rz(q5) · Ry(−q6) · Rz(q7) · Rx(π),

two links between a shoulder, an elbow and a wrist, of which the first two have an offset along
their axis. The distance from shoulder to wrist gives q4, the wrist's height q2, its bearing q1,
and the remaining rotation q5 to q7: two answers each for q4, q2 and the wrist, eight in all. The
wrist's own offset of 0.35 mm and the right angles that the vendor rounds to 1.5708 have no part
in this; Newton's method on the exact chain accounts for them.

What is returned is exact and within the limits, everywhere. Answers may be missing, seldom all:

* Straight wrist (|q6| up to 0.01 rad; 0.05 beside another of these): only q5 + q7 is well
  determined. The offset leaves up to four answers, milliradians of q6 apart, where the arm with
  right angles has two; at most two are found.
* Stretched elbow, or wrist at its least distance from the first axis: two answers merge. They
  count as one within 1e-6 rad; within 0.02 rad Newton's method may miss one, up to one in fifty.
* Wrist on the first axis: q1 is free and Newton's equations are singular. One answer of the
  continuum comes back, or none. Another q3 has isolated ones.
"""

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.errors import ModelError
from models.rotations import require_rotation

Array = NDArray[np.float64]

Y = np.array([0.0, 0.005375, -0.21038, 0.006375, -0.20843, 0.00017505, -0.10593, 0.0])
"""Origins of joints 1 to 7 and of E in the preceding link, y [m]; x is zero."""
Z = np.array([0.15643, -0.12838, -0.006375, -0.21038, -0.006375, -0.10593, -0.00017505, -0.061525])
"""The same, z [m]."""
ROLL = np.array([3.1416, 1.5708, -1.5708, 1.5708, -1.5708, 1.5708, -1.5708, np.pi])
"""The same, rotation about x [rad], with the vendor's rounding; pitch and yaw are zero."""
LIMIT = np.array([np.inf, 2.24, np.inf, 2.57, np.inf, 2.09, np.inf])
"""Largest magnitude of each joint angle [rad]; infinite for an endless joint."""
BRANCHES = 8
"""Most answers for one pose and one q3."""

# Lengths of the arm with right angles [m].
_SHOULDER_HEIGHT = Z[0] - Z[1]
_SHOULDER_OFFSET, _UPPER_ARM = Y[1] - Z[2], -Y[2] - Z[3]
_ELBOW_OFFSET, _FOREARM = Y[3] - Z[4], -Y[4] - Z[5]
_HAND = -Y[6] - Z[7]

_COS_ROLL, _SIN_ROLL = np.cos(ROLL), np.sin(ROLL)
# What Newton's method turns: all but q3, whose place in the equations q7 takes.
_UNKNOWNS = np.array([0, 1, 6, 3, 4, 5])
_TOLERANCE = 1e-11  # of the pose [m, rad]
_ITERATIONS, _STEP = 20, 0.3  # Newton's method; two or three suffice mostly; [rad]
_SLACK = 0.1  # how far it may carry a joint back within its limit [rad]
_REACH_SLACK = 5e-3  # by how much the wrist's offset may seem to exceed the reach, relative
_APART = 0.03  # where it starts from two answers that merge: on either side, off the fold [rad]
_SAME = 1e-6  # answers nearer than this are one [rad]


def solve_branches(R_BE: ArrayLike, p_BE: ArrayLike, q3: float) -> Array:
    """Every branch within the joint limits that reaches one pose with a given q3.

    Args:
        R_BE: rotation of the end effector in the base ``[3, 3]``.
        p_BE: its position ``[3]`` [m].
        q3: the third joint's angle [rad].

    Returns:
        Joint angles ``[k, 7]`` [rad], 0 ≤ k ≤ 8, all but q3 within [−π, π); the pose is met
        within 1e-9 m and 1e-9 rad.

    Raises:
        ModelError: if a shape is another, a value not finite, or ``R_BE`` no rotation.
    """
    q = solve_batch(np.asarray(R_BE)[None], np.asarray(p_BE)[None], np.array([q3]))[0, 0]
    return q[~np.isnan(q[:, 0])]


def solve_batch(R_BE: ArrayLike, p_BE: ArrayLike, q3: ArrayLike) -> Array:
    """`solve_branches` for every pose with every q3; compiled at the first call.

    Args:
        R_BE: rotations of the end effector in the base ``[n, 3, 3]``.
        p_BE: its positions ``[n, 3]`` [m].
        q3: the third joint's angles ``[m]`` [rad].

    Returns:
        Joint angles ``[n, m, 8, 7]`` [rad]; a branch that does not exist is NaN throughout.

    Raises:
        ModelError: if a shape is another, a value not finite, or a matrix no rotation.
    """
    R = require_rotation(R_BE)
    p, q3 = np.asarray(p_BE, dtype=np.float64), np.asarray(q3, dtype=np.float64)
    if R.ndim != 3 or p.shape != (len(R), 3) or q3.ndim != 1:
        shapes = f"{list(R.shape)}, {list(p.shape)}, {list(q3.shape)}"
        raise ModelError(f"R_BE, p_BE, q3 have shapes {shapes}; wanted [n, 3, 3], [n, 3], [m]")
    if not (np.isfinite(p).all() and np.isfinite(q3).all()):
        raise ModelError("p_BE or q3 holds a value that is not finite; wanted finite numbers only")
    # One memory layout, else each further one is compiled anew.
    return _solve_batch(*(np.ascontiguousarray(array) for array in (R, p, q3)))


def nearest(q: Array, seed: Array) -> Array | None:
    """The branch nearest to a posture, its endless joints wound to within half a turn of that.

    Args:
        q: branches ``[k, 7]`` [rad].
        seed: the posture ``[7]`` [rad].

    Returns:
        Joint angles ``[7]`` [rad]; None if ``k`` is zero.
    """
    if not len(q):
        return None
    turns = np.where(np.isinf(LIMIT), np.round((q - seed) / (2.0 * np.pi)), 0.0)
    wound = q - 2.0 * np.pi * turns
    return wound[np.argmin(np.linalg.norm(wound - seed, axis=1))]


def forward(q: Array) -> tuple[Array, Array]:
    """R_BE ``[3, 3]`` and p_BE ``[3]`` [m] at joint angles ``q [7]`` [rad], by the exact chain."""
    return _chain(np.asarray(q, dtype=np.float64), np.empty((6, 7)))


@numba.njit(cache=True)
def _solve_batch(R: Array, p: Array, q3: Array) -> Array:
    q = np.full((len(R), len(q3), BRANCHES, 7), np.nan)
    for i in range(len(R)):
        for j in range(len(q3)):
            _solve(R[i], p[i], q3[j], q[i, j])
    return q


@numba.njit(cache=True)
def _solve(R: Array, p: Array, q3: float, answers: Array) -> None:
    """Write the branches into ``answers [8, 7]``, which holds NaN."""
    # From here on in frame 0, the base turned over, where z points down.
    wrist_x, wrist_y = p[0] - _HAND * R[0, 2], _HAND * R[1, 2] - p[1]
    wrist_z = _SHOULDER_HEIGHT + _HAND * R[2, 2] - p[2]
    s3, c3 = np.sin(q3), np.cos(q3)

    squares = _UPPER_ARM**2 + _FOREARM**2 + _SHOULDER_OFFSET**2 + _ELBOW_OFFSET**2
    C = wrist_x**2 + wrist_y**2 + wrist_z**2 - squares
    C -= 2.0 * _SHOULDER_OFFSET * _ELBOW_OFFSET * c3
    A, B = 2.0 * _UPPER_ARM * _FOREARM, 2.0 * _SHOULDER_OFFSET * _FOREARM * s3
    bend = _angle(C / np.hypot(A, B))
    q, M = np.empty(7), np.empty((3, 3))
    q[2] = q3
    for branch in range(BRANCHES):
        elbow, shoulder, twist = 1 - 2 * (branch & 1), 1 - (branch & 2), 1 - (branch & 4) // 2
        q[3] = _wrap(np.arctan2(B, A) + elbow * bend)
        if not abs(q[3]) < LIMIT[3] + _SLACK:  # also where there is no bend: NaN
            continue
        # Shoulder to wrist, in the upper arm; turning it by q2 must give the wrist's height.
        s4, c4 = np.sin(q[3]), np.cos(q[3])
        x = c3 * _FOREARM * s4 - s3 * _ELBOW_OFFSET
        y = s3 * _FOREARM * s4 + c3 * _ELBOW_OFFSET + _SHOULDER_OFFSET
        z = -_FOREARM * c4 - _UPPER_ARM
        q[1] = _wrap(np.arctan2(x, z) + shoulder * _angle(wrist_z / np.hypot(x, z)))
        if not abs(q[1]) < LIMIT[1] + _SLACK:
            continue
        s2, c2 = np.sin(q[1]), np.cos(q[1])
        q[0] = np.arctan2(wrist_y, wrist_x) - np.arctan2(y, c2 * x - s2 * z)
        # What is left to the wrist: Rz(q5)·Ry(−q6)·Rz(q7).
        for i in range(3):
            for j in range(3):
                M[i, j] = R[i, j] if (i == 0) == (j == 0) else -R[i, j]
        _unturn(M, 1, q[0])
        _unturn(M, 2, q[1])
        _unturn(M, 1, q[2])
        _unturn(M, 2, q[3])
        q[5] = twist * np.arctan2(np.hypot(M[0, 2], M[1, 2]), M[2, 2])
        if not abs(q[5]) < LIMIT[5] + _SLACK:
            continue
        q[4] = np.arctan2(-twist * M[1, 2], -twist * M[0, 2])
        # By way of q5, so that the rotation is met even where q6 = 0 leaves q5 to rounding.
        _unturn(M, 1, q[4])
        q[6] = np.arctan2(M[1, 0], M[1, 1])
        if _refine(q, R, p) and _is_new(q, answers[:branch]):
            answers[branch] = q


@numba.njit(cache=True)
def _unturn(M: Array, row: int, angle: float) -> None:
    """Multiply ``M [3, 3]`` by Rz(−angle) from the left if ``row`` is 1, by Ry(angle) if 2."""
    sine, cosine = np.sin(angle), np.cos(angle)
    for i in range(3):
        first, second = M[0, i], M[row, i]
        M[0, i] = cosine * first + sine * second
        M[row, i] = cosine * second - sine * first


@numba.njit(cache=True)
def _angle(cosine: float) -> float:
    """Arc cosine in [_APART, π − _APART], for a cosine that may exceed 1 slightly; else NaN."""
    if abs(cosine) > 1.0 + _REACH_SLACK:
        return np.nan
    return min(max(np.arccos(min(max(cosine, -1.0), 1.0)), _APART), np.pi - _APART)


@numba.njit(cache=True)
def _wrap(angle: float) -> float:
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


@numba.njit(cache=True)
def _is_new(q: Array, answers: Array) -> bool:
    for other in answers:
        apart = 0.0
        for i in range(7):
            apart = max(apart, abs(_wrap(q[i] - other[i])))
        if apart < _SAME and not np.isnan(other[0]):
            return False
    return True


@numba.njit(cache=True)
def _refine(q: Array, R_BE: Array, p_BE: Array) -> bool:
    """Newton's method on the exact chain; whether ``q [7]`` then meets pose and limits."""
    J = np.empty((6, 7))
    for _ in range(_ITERATIONS):
        R, p = _chain(q, J)
        worst, cosines = 0.0, 0.0
        for k in range(3):
            m, n = (k + 1) % 3, (k + 2) % 3
            turn = 0.0  # half the axes' cross products: the rotation vector, to first order
            for i in range(3):
                turn += 0.5 * (R[m, i] * R_BE[n, i] - R[n, i] * R_BE[m, i])
                cosines += R[k, i] * R_BE[k, i]
            J[k, 2], J[k, 6] = J[k, 6], turn
            J[k + 3, 2], J[k + 3, 6] = J[k + 3, 6], p_BE[k] - p[k]
            worst = max(worst, abs(turn), abs(p_BE[k] - p[k]))
        if worst < _TOLERANCE:
            within = cosines > 0.0  # the cross products vanish at half a turn as well
            for i in range(7):
                if i != 2:
                    q[i] = _wrap(q[i])
                within = within and abs(q[i]) <= LIMIT[i]
            return within
        if not _eliminate(J):
            return False
        largest = 0.0
        for i in range(6):
            largest = max(largest, abs(J[i, 6]))
        for i in range(6):
            q[_UNKNOWNS[i]] += J[i, 6] * min(1.0, _STEP / largest)
    return False


@numba.njit(cache=True)
def _chain(q: Array, J: Array) -> tuple[Array, Array]:
    """R_BE ``[3, 3]``, p_BE ``[3]``; writes the Jacobian ``J [6, 7]``: angular, linear, in B."""
    R, p = np.eye(3), np.zeros(3)
    for i in range(8):
        sine, cosine = (np.sin(q[i]), np.cos(q[i])) if i < 7 else (0.0, 1.0)
        for k in range(3):
            x, y, z = R[k, 0], R[k, 1], R[k, 2]
            p[k] += Y[i] * y + Z[i] * z
            y, z = _COS_ROLL[i] * y + _SIN_ROLL[i] * z, _COS_ROLL[i] * z - _SIN_ROLL[i] * y
            R[k, 0], R[k, 1], R[k, 2] = cosine * x + sine * y, cosine * y - sine * x, z
            if i < 7:
                J[k, i], J[k + 3, i] = z, p[k]
    for i in range(7):
        x, y, z = p[0] - J[3, i], p[1] - J[4, i], p[2] - J[5, i]
        J[3, i] = J[1, i] * z - J[2, i] * y
        J[4, i] = J[2, i] * x - J[0, i] * z
        J[5, i] = J[0, i] * y - J[1, i] * x
    return R, p


@numba.njit(cache=True)
def _eliminate(system: Array) -> bool:
    """Solve ``[A | b] [6, 7]`` in place, x in the last column; False if A is singular."""
    for i in range(6):
        pivot = i
        for j in range(i + 1, 6):
            if abs(system[j, i]) > abs(system[pivot, i]):
                pivot = j
        if abs(system[pivot, i]) < 1e-14:
            return False
        for k in range(i, 7):
            system[i, k], system[pivot, k] = system[pivot, k], system[i, k]
        for j in range(6):
            if j != i:
                factor = system[j, i] / system[i, i]
                for k in range(i, 7):
                    system[j, k] -= factor * system[i, k]
    for i in range(6):
        system[i, 6] /= system[i, i]
    return True
