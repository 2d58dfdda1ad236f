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
Work = tuple[Array, Array, Array, Array, Array, Array]

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

OUT_OF_REACH, NOT_MET, BEYOND_LIMITS, MET = -1, 0, 1, 2
"""What became of a pose: proved too far or too near; not met by any posture tried; met by some,
but beyond a joint limit; met within the limits."""

# Lengths of the arm with right angles [m].
_SHOULDER_HEIGHT = Z[0] - Z[1]
_SHOULDER_OFFSET, _UPPER_ARM = Y[1] - Z[2], -Y[2] - Z[3]
_ELBOW_OFFSET, _FOREARM = Y[3] - Z[4], -Y[4] - Z[5]
_HAND = -Y[6] - Z[7]

_SQUARES = _UPPER_ARM**2 + _FOREARM**2 + _SHOULDER_OFFSET**2 + _ELBOW_OFFSET**2
# Bounds of the wrist's distance from the shoulder: any q3, q4 within its limit, and 1 mm for the
# wrist's offset and the rounded angles [m].
_FARTHEST = 1e-3 + np.sqrt(
    _SQUARES
    + 2.0 * _SHOULDER_OFFSET * _ELBOW_OFFSET
    + 2.0 * _FOREARM * np.hypot(_UPPER_ARM, _SHOULDER_OFFSET)
)
_NEAREST = -1e-3 + np.sqrt(
    _SQUARES
    - 2.0 * _SHOULDER_OFFSET * _ELBOW_OFFSET
    + 2.0 * _FOREARM * (_UPPER_ARM * np.cos(LIMIT[3]) - _SHOULDER_OFFSET)
)

_COS_ROLL, _SIN_ROLL = np.cos(ROLL), np.sin(ROLL)
# What Newton's method turns: all but q3, whose place in the equations q7 takes.
_UNKNOWNS = np.array([0, 1, 6, 3, 4, 5])
_TOLERANCE = 1e-11  # of the pose [m, rad]
_FIRST_TOLERANCE = 1e-6  # where the first answer will do
_ITERATIONS, _STEP = 20, 0.3  # Newton's method; two or three suffice mostly; [rad]
_QUICK = 4  # of the iterations that may leave the wrist's offset out
_FLAT_ARM, _FLAT_WRIST = 2e-3, 0.05  # determinants below which they do not [m³, 1]
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
    return _solve_batch(*_checked(R_BE, p_BE, q3))


def solve_first(R_BE: ArrayLike, p_BE: ArrayLike, q3: ArrayLike) -> tuple[Array, NDArray[np.int8]]:
    """One answer a pose, for the first q3 that has any; compiled at the first call.

    Args:
        R_BE: rotations of the end effector in the base ``[n, 3, 3]``.
        p_BE: its positions ``[n, 3]`` [m].
        q3: the third joint's angles to try, in this order ``[m]`` [rad].

    Returns:
        Joint angles ``[n, 7]`` [rad], NaN where there is no answer, else exact within 2e-6 m and
        2e-6 rad; and `MET` or the reason ``[n]``.

    Raises:
        ModelError: if a shape is another, a value not finite, or a matrix no rotation.
    """
    return _solve_first(*_checked(R_BE, p_BE, q3))


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
    X = np.empty((3, 4))
    _chain(np.asarray(q, dtype=np.float64), np.empty((6, 7)), X)
    return X[:, :3], X[:, 3]


def _checked(R_BE: ArrayLike, p_BE: ArrayLike, q3: ArrayLike) -> tuple[Array, Array, Array]:
    R = require_rotation(R_BE)
    p, q3 = np.asarray(p_BE, dtype=np.float64), np.asarray(q3, dtype=np.float64)
    if R.ndim != 3 or p.shape != (len(R), 3) or q3.ndim != 1:
        shapes = f"{list(R.shape)}, {list(p.shape)}, {list(q3.shape)}"
        raise ModelError(f"R_BE, p_BE, q3 have shapes {shapes}; wanted [n, 3, 3], [n, 3], [m]")
    if not (np.isfinite(p).all() and np.isfinite(q3).all()):
        raise ModelError("p_BE or q3 holds a value that is not finite; wanted finite numbers only")
    # One memory layout, else each further one is compiled anew.
    return np.ascontiguousarray(R), np.ascontiguousarray(p), np.ascontiguousarray(q3)


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def _solve_batch(R: Array, p: Array, q3: Array) -> Array:
    q = np.full((len(R), len(q3), BRANCHES, 7), np.nan)
    work = workspace()
    for i in range(len(R)):
        for j in range(len(q3)):
            solve_into(R[i], p[i], q3[j], q[i, j], BRANCHES, _TOLERANCE, work)
    return q


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def _solve_first(R: Array, p: Array, q3: Array) -> tuple[Array, NDArray[np.int8]]:
    q, met = np.full((len(R), 7), np.nan), np.zeros(len(R), dtype=np.int8)
    answers, work = np.empty((BRANCHES, 7)), workspace()
    for i in range(len(R)):
        if not wrist_in_reach(R[i], p[i]):
            met[i] = OUT_OF_REACH
            continue
        for j in range(len(q3)):
            answers[:] = np.nan
            status = solve_into(R[i], p[i], q3[j], answers, 1, _FIRST_TOLERANCE, work)
            met[i] = max(met[i], status)
            if status == MET:
                for branch in range(BRANCHES):
                    if not np.isnan(answers[branch, 0]):
                        q[i] = answers[branch]
                break
    return q, met


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def workspace() -> Work:
    """Arrays that `solve_into` works in: posture, rotation, pose, joint axes, step, levers."""
    return (
        np.empty(7),
        np.empty((3, 3)),
        np.empty((3, 4)),
        np.empty((6, 7)),
        np.empty(6),
        np.empty((3, 4)),
    )


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def wrist_in_reach(R: Array, p: Array) -> bool:
    """Whether distance and the fourth joint's limit leave any hope for a pose; False proves none.

    The wrist's distance from the shoulder follows from q4 and, by 50 µm, from q3.
    """
    x, y = p[0] - _HAND * R[0, 2], p[1] - _HAND * R[1, 2]
    z = p[2] - _HAND * R[2, 2] - _SHOULDER_HEIGHT
    squared = x * x + y * y + z * z
    return _NEAREST**2 <= squared <= _FARTHEST**2


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def solve_into(
    R: Array,
    p: Array,
    q3: float,
    answers: Array,
    most: int,
    tolerance: float,
    work: Work,
) -> int:
    """Write up to ``most`` branches into ``answers [8, 7]``, which holds NaN.

    Returns:
        `MET`, `BEYOND_LIMITS` or `NOT_MET`.
    """
    q, M = work[0], work[1]
    # From here on in frame 0, the base turned over, where z points down.
    wrist_x, wrist_y = p[0] - _HAND * R[0, 2], _HAND * R[1, 2] - p[1]
    wrist_z = _SHOULDER_HEIGHT + _HAND * R[2, 2] - p[2]
    s3, c3 = np.sin(q3), np.cos(q3)

    C = wrist_x**2 + wrist_y**2 + wrist_z**2 - _SQUARES
    C -= 2.0 * _SHOULDER_OFFSET * _ELBOW_OFFSET * c3
    A, B = 2.0 * _UPPER_ARM * _FOREARM, 2.0 * _SHOULDER_OFFSET * _FOREARM * s3
    bend = _angle(C / np.hypot(A, B))
    if np.isnan(bend):
        return NOT_MET
    middle, bearing = np.arctan2(B, A), np.arctan2(wrist_y, wrist_x)
    count, status = 0, NOT_MET
    for pair in range(4):
        elbow, shoulder = 1 - 2 * (pair & 1), 1 - (pair & 2)
        q4 = _wrap(middle + elbow * bend)
        if abs(q4) >= LIMIT[3] + _SLACK:
            status = max(status, BEYOND_LIMITS)
            continue
        # Shoulder to wrist, in the upper arm; turning it by q2 must give the wrist's height.
        s4, c4 = np.sin(q4), np.cos(q4)
        x = c3 * _FOREARM * s4 - s3 * _ELBOW_OFFSET
        y = s3 * _FOREARM * s4 + c3 * _ELBOW_OFFSET + _SHOULDER_OFFSET
        z = -_FOREARM * c4 - _UPPER_ARM
        lean = _angle(wrist_z / np.hypot(x, z))
        if np.isnan(lean):
            continue
        q2 = _wrap(np.arctan2(x, z) + shoulder * lean)
        if abs(q2) >= LIMIT[1] + _SLACK:
            status = max(status, BEYOND_LIMITS)
            continue
        s2, c2 = np.sin(q2), np.cos(q2)
        q1 = bearing - np.arctan2(y, c2 * x - s2 * z)
        # What is left to the wrist: Rz(q5)·Ry(−q6)·Rz(q7).
        for i in range(3):
            for j in range(3):
                M[i, j] = R[i, j] if (i == 0) == (j == 0) else -R[i, j]
        _unturn(M, 1, np.sin(q1), np.cos(q1))
        _unturn(M, 2, s2, c2)
        _unturn(M, 1, s3, c3)
        _unturn(M, 2, s4, c4)
        sideways = np.hypot(M[0, 2], M[1, 2])
        q6 = np.arctan2(sideways, M[2, 2])
        if q6 >= LIMIT[5] + _SLACK:
            status = max(status, BEYOND_LIMITS)
            continue
        for twist in (1, -1):
            q[0], q[1], q[2], q[3] = q1, q2, q3, q4
            q[4] = np.arctan2(-twist * M[1, 2], -twist * M[0, 2])
            q[5] = twist * q6
            # By way of q5, so that the rotation is met even where q6 = 0 leaves q5 to rounding.
            s5, c5 = np.sin(q[4]), np.cos(q[4])
            q[6] = np.arctan2(c5 * M[1, 0] - s5 * M[0, 0], c5 * M[1, 1] - s5 * M[0, 1])
            outcome = _refine(q, R, p, tolerance, work)
            status = max(status, outcome)
            if outcome == MET and _is_new(q, answers):
                answers[pair if twist > 0 else pair + 4] = q
                count += 1
                if count == most:
                    return MET
    return status


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def _unturn(M: Array, row: int, sine: float, cosine: float) -> None:
    """Multiply ``M [3, 3]`` by Rz(−angle) from the left if ``row`` is 1, by Ry(angle) if 2."""
    for i in range(3):
        first, second = M[0, i], M[row, i]
        M[0, i] = cosine * first + sine * second
        M[row, i] = cosine * second - sine * first


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def _angle(cosine: float) -> float:
    """Arc cosine in [_APART, π − _APART], for a cosine that may exceed 1 slightly; else NaN."""
    if abs(cosine) > 1.0 + _REACH_SLACK:
        return np.nan
    return min(max(np.arccos(min(max(cosine, -1.0), 1.0)), _APART), np.pi - _APART)


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def _wrap(angle: float) -> float:
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def _is_new(q: Array, answers: Array) -> bool:
    for branch in range(BRANCHES):
        if not np.isnan(answers[branch, 0]):
            apart = 0.0
            for i in range(7):
                apart = max(apart, abs(_wrap(q[i] - answers[branch, i])))
            if apart < _SAME:
                return False
    return True


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def _refine(q: Array, R: Array, p: Array, tolerance: float, work: Work) -> int:
    """Newton's method on the exact chain; what ``q [7]`` then is, as `solve_into` says."""
    _, _, X, J, step, lever = work
    for iteration in range(_ITERATIONS):
        _chain(q, J, X)
        worst, cosines = 0.0, 0.0
        for k in range(3):
            m, n = (k + 1) % 3, (k + 2) % 3
            turn = 0.0  # half the axes' cross products: the rotation vector, to first order
            for i in range(3):
                turn += 0.5 * (X[m, i] * R[n, i] - X[n, i] * R[m, i])
                cosines += X[k, i] * R[k, i]
            step[k], step[k + 3] = turn, p[k] - X[k, 3]
            worst = max(worst, abs(turn), abs(step[k + 3]))
        if worst < tolerance:
            within = True
            for i in range(7):
                if i != 2:
                    q[i] = _wrap(q[i])
                within = within and abs(q[i]) <= LIMIT[i]
            # The cross products vanish at half a turn as well.
            return NOT_MET if cosines <= 0.0 else MET if within else BEYOND_LIMITS
        if not (iteration < _QUICK and _quick_step(J, X, step, lever)) and not _full_step(
            J, X, step
        ):
            return NOT_MET
        largest = 0.0
        for i in range(6):
            largest = max(largest, abs(step[i]))
        scale = min(1.0, _STEP / largest)
        for i in range(6):
            q[_UNKNOWNS[i]] += step[i] * scale
    return NOT_MET


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def _chain(q: Array, J: Array, X: Array) -> None:
    """Write ``X [3, 4]``, R_BE beside p_BE, and ``J [6, 7]``: the joints' axes and origins."""
    for k in range(3):
        for i in range(4):
            X[k, i] = 1.0 if i == k else 0.0
    for i in range(8):
        sine, cosine = (np.sin(q[i]), np.cos(q[i])) if i < 7 else (0.0, 1.0)
        for k in range(3):
            x, y, z = X[k, 0], X[k, 1], X[k, 2]
            X[k, 3] += Y[i] * y + Z[i] * z
            y, z = _COS_ROLL[i] * y + _SIN_ROLL[i] * z, _COS_ROLL[i] * z - _SIN_ROLL[i] * y
            X[k, 0], X[k, 1], X[k, 2] = cosine * x + sine * y, cosine * y - sine * x, z
            if i < 7:
                J[k, i], J[k + 3, i] = z, X[k, 3]


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def _quick_step(J: Array, X: Array, step: Array, lever: Array) -> bool:
    """Newton's step as if the wrist were a point: q1, q2, q4 move it, q5 to q7 turn the rest.

    The wrist's offset, left out, makes the error shrink by about 1,000 a step instead of
    quadratically, at a fifth of the cost.

    Returns:
        Whether ``step [6]``, given as rotation and translation, was replaced by angles; it is not
        where either system is close to singular.
    """
    for i in (0, 1, 3):
        x = X[0, 3] - _HAND * X[0, 2] - J[3, i]
        y = X[1, 3] - _HAND * X[1, 2] - J[4, i]
        z = X[2, 3] - _HAND * X[2, 2] - J[5, i]
        lever[0, i] = J[1, i] * z - J[2, i] * y
        lever[1, i] = J[2, i] * x - J[0, i] * z
        lever[2, i] = J[0, i] * y - J[1, i] * x
    # What the rotation wanted moves of the hand is no error of the wrist's.
    x = step[3] - _HAND * (step[1] * X[2, 2] - step[2] * X[1, 2])
    y = step[4] - _HAND * (step[2] * X[0, 2] - step[0] * X[2, 2])
    z = step[5] - _HAND * (step[0] * X[1, 2] - step[1] * X[0, 2])
    det, q1, q2, q4 = _cramer(lever, 0, 1, 3, x, y, z)
    if abs(det) < _FLAT_ARM:
        return False
    x = step[0] - J[0, 0] * q1 - J[0, 1] * q2 - J[0, 3] * q4
    y = step[1] - J[1, 0] * q1 - J[1, 1] * q2 - J[1, 3] * q4
    z = step[2] - J[2, 0] * q1 - J[2, 1] * q2 - J[2, 3] * q4
    det, q5, q6, q7 = _cramer(J, 4, 5, 6, x, y, z)
    if abs(det) < _FLAT_WRIST:
        return False
    step[0], step[1], step[2], step[3], step[4], step[5] = q1, q2, q7, q4, q5, q6
    return True


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def _cramer(
    A: Array, i: int, j: int, k: int, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """Determinant of columns ``i, j, k`` of ``A``, and what multiplies them to give (x, y, z)."""
    ux = A[1, j] * A[2, k] - A[2, j] * A[1, k]
    uy = A[2, j] * A[0, k] - A[0, j] * A[2, k]
    uz = A[0, j] * A[1, k] - A[1, j] * A[0, k]
    det = A[0, i] * ux + A[1, i] * uy + A[2, i] * uz
    vx, vy, vz = y * A[2, i] - z * A[1, i], z * A[0, i] - x * A[2, i], x * A[1, i] - y * A[0, i]
    a = (x * ux + y * uy + z * uz) / det
    b = -(vx * A[0, k] + vy * A[1, k] + vz * A[2, k]) / det
    c = (vx * A[0, j] + vy * A[1, j] + vz * A[2, j]) / det
    return det, a, b, c


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def _full_step(J: Array, X: Array, step: Array) -> bool:
    """Newton's step proper: replace ``step [6]``, rotation and translation, by angles."""
    for i in range(7):
        x, y, z = X[0, 3] - J[3, i], X[1, 3] - J[4, i], X[2, 3] - J[5, i]
        J[3, i] = J[1, i] * z - J[2, i] * y
        J[4, i] = J[2, i] * x - J[0, i] * z
        J[5, i] = J[0, i] * y - J[1, i] * x
    for k in range(6):
        J[k, 2], J[k, 6] = J[k, 6], step[k]
    if not _eliminate(J):
        return False
    for k in range(6):
        step[k] = J[k, 6]
    return True


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
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


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def link_frames(q: Array, frames: Array) -> None:
    """Write the links' frames in B ``[8, 3, 4]``, rotation beside position: base, then 1 to 7."""
    for k in range(3):
        for i in range(4):
            frames[0, k, i] = 1.0 if i == k else 0.0
    for i in range(7):
        sine, cosine = np.sin(q[i]), np.cos(q[i])
        for k in range(3):
            x, y, z = frames[i, k, 0], frames[i, k, 1], frames[i, k, 2]
            frames[i + 1, k, 3] = frames[i, k, 3] + Y[i] * y + Z[i] * z
            y, z = _COS_ROLL[i] * y + _SIN_ROLL[i] * z, _COS_ROLL[i] * z - _SIN_ROLL[i] * y
            frames[i + 1, k, 0] = cosine * x + sine * y
            frames[i + 1, k, 1], frames[i + 1, k, 2] = cosine * y - sine * x, z
