"""Newton's method on the Gen3's exact chain, for a given q3."""

import numpy as np

from models.compiled import FAST, compiled
from models.gen3.chain import HAND_LENGTH, LIMIT, Array, chain
from models.scenes.limits import ROUNDING

OUT_OF_REACH, NOT_MET, BEYOND_LIMITS, MET = -1, 0, 1, 2
"""What became of a pose: proved too far or too near; not met by any posture tried; met by some,
but beyond a joint limit; met within the limits."""

Work = tuple[Array, Array, Array, Array, Array, Array]

# What Newton's method turns: all but q3, whose place in the equations q7 takes.
_UNKNOWNS = np.array([0, 1, 6, 3, 4, 5])
_ITERATIONS, _STEP = 20, 0.3  # two or three suffice mostly; [rad]
_FINE = 1e-11  # an error of the pose that leaves none of a joint's angle to speak of [m, rad]
_AT_LIMIT = 100.0  # a joint so much further off than the pose may be at its limit
_QUICK = 4  # of the iterations that may leave the wrist's offset out
_FLAT_ARM, _FLAT_WRIST = 2e-3, 0.05  # determinants below which they do not [m³, 1]


@compiled(**FAST)
def work_arrays() -> Work:
    """Arrays that compiled functions work in: posture, rotation, pose, joint axes, step, levers."""
    return (
        np.empty(7),
        np.empty((3, 3)),
        np.empty((3, 4)),
        np.empty((6, 7)),
        np.empty(6),
        np.empty((3, 4)),
    )


@compiled(**FAST)
def refine(q: Array, R: Array, p: Array, tolerance: float, work: Work) -> int:
    """Newton's method on the exact chain; what ``q [7]`` then is.

    Returns:
        `MET`, `BEYOND_LIMITS` or `NOT_MET`.
    """
    _, _, X, J, step, lever = work
    for iteration in range(_ITERATIONS):
        chain(q, J, X)
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
            beyond = 0.0
            for i in range(7):
                if i != 2:
                    q[i] = wrap(q[i])
                beyond = max(beyond, abs(q[i]) - LIMIT[i])
            # Just beyond a limit, a coarse answer tells nothing.
            if not ROUNDING < beyond < _AT_LIMIT * tolerance or worst < _FINE:
                for i in range(7):
                    q[i] = min(max(q[i], -LIMIT[i]), LIMIT[i])
                # The cross products vanish at half a turn as well.
                return NOT_MET if cosines <= 0.0 else MET if beyond <= ROUNDING else BEYOND_LIMITS
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


@compiled(**FAST)
def _quick_step(J: Array, X: Array, step: Array, lever: Array) -> bool:
    """Newton's step as if the wrist were a point: q1, q2, q4 move it, q5 to q7 turn the rest.

    The wrist's offset, left out, makes the error shrink by about 1,000 a step instead of
    quadratically, at a fifth of the cost.

    Returns:
        Whether ``step [6]``, given as rotation and translation, was replaced by angles; it is not
        where either system is close to singular.
    """
    for i in (0, 1, 3):
        x = X[0, 3] - HAND_LENGTH * X[0, 2] - J[3, i]
        y = X[1, 3] - HAND_LENGTH * X[1, 2] - J[4, i]
        z = X[2, 3] - HAND_LENGTH * X[2, 2] - J[5, i]
        lever[0, i] = J[1, i] * z - J[2, i] * y
        lever[1, i] = J[2, i] * x - J[0, i] * z
        lever[2, i] = J[0, i] * y - J[1, i] * x
    # How far the wanted rotation moves the hand does not count as an error of the wrist.
    x = step[3] - HAND_LENGTH * (step[1] * X[2, 2] - step[2] * X[1, 2])
    y = step[4] - HAND_LENGTH * (step[2] * X[0, 2] - step[0] * X[2, 2])
    z = step[5] - HAND_LENGTH * (step[0] * X[1, 2] - step[1] * X[0, 2])
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


@compiled(**FAST)
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


@compiled(**FAST)
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


@compiled(**FAST)
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


@compiled(**FAST)
def wrap(angle: float) -> float:
    """The same angle [rad] within [−π, π)."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi
