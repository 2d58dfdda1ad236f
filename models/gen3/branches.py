"""The Gen3's postures for one pose and one q3: eight guesses in closed form, each refined.

In frames whose axes are parallel at q = 0, and with right angles, the arm is

    Rx(π) · Rz(q1) · Ry(−q2) · Rz(q3) · Ry(−q4) · Rz(q5) · Ry(−q6) · Rz(q7) · Rx(π),

two links between a shoulder, an elbow and a wrist, of which the first two have an offset along
their axis. The distance from shoulder to wrist gives q4, the wrist's height q2, its bearing q1,
and the remaining rotation q5 to q7: two answers each for q4, q2 and the wrist, eight in all. The
wrist's own offset of 0.35 mm and the right angles that the vendor rounds to 1.5708 have no part
in this; Newton's method on the exact chain accounts for them.
"""

import numpy as np

from models.compiled import FAST, compiled
from models.gen3.chain import HAND_LENGTH, LIMIT, Array, Y, Z
from models.gen3.newton import BEYOND_LIMITS, MET, NOT_MET, Work, refine, wrap

BRANCHES = 8
"""Most answers for one pose and one q3."""

# Lengths of the arm with right angles [m].
_SHOULDER_HEIGHT = Z[0] - Z[1]
_SHOULDER_OFFSET, _UPPER_ARM = Y[1] - Z[2], -Y[2] - Z[3]
_ELBOW_OFFSET, _FOREARM = Y[3] - Z[4], -Y[4] - Z[5]

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

_SLACK = 0.1  # how far Newton's method may carry a joint back within its limit [rad]
_REACH_SLACK = 5e-3  # by how much the wrist's offset may seem to exceed the reach, relative
_APART = 0.03  # where it starts from two answers that merge: on either side, off the fold [rad]
_SAME = 1e-6  # answers nearer than this are one [rad]


@compiled(**FAST)
def wrist_in_reach(R: Array, p: Array) -> bool:
    """Whether distance and the fourth joint's limit leave any hope for a pose; False proves none.

    The wrist's distance from the shoulder follows from q4 and, by 50 µm, from q3.
    """
    x, y = p[0] - HAND_LENGTH * R[0, 2], p[1] - HAND_LENGTH * R[1, 2]
    z = p[2] - HAND_LENGTH * R[2, 2] - _SHOULDER_HEIGHT
    squared = x * x + y * y + z * z
    return _NEAREST**2 <= squared <= _FARTHEST**2


@compiled(**FAST)
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
    wrist_x, wrist_y = p[0] - HAND_LENGTH * R[0, 2], HAND_LENGTH * R[1, 2] - p[1]
    wrist_z = _SHOULDER_HEIGHT + HAND_LENGTH * R[2, 2] - p[2]
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
        q4 = wrap(middle + elbow * bend)
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
        q2 = wrap(np.arctan2(x, z) + shoulder * lean)
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
            outcome = refine(q, R, p, tolerance, work)
            status = max(status, outcome)
            if outcome == MET and _is_new(q, answers):
                answers[pair if twist > 0 else pair + 4] = q
                count += 1
                if count == most:
                    return MET
    return status


@compiled(**FAST)
def _unturn(M: Array, row: int, sine: float, cosine: float) -> None:
    """Multiply ``M [3, 3]`` by Rz(−angle) from the left if ``row`` is 1, by Ry(angle) if 2."""
    for i in range(3):
        first, second = M[0, i], M[row, i]
        M[0, i] = cosine * first + sine * second
        M[row, i] = cosine * second - sine * first


@compiled(**FAST)
def _angle(cosine: float) -> float:
    """Arc cosine in [_APART, π − _APART], for a cosine that may exceed 1 slightly; else NaN."""
    if abs(cosine) > 1.0 + _REACH_SLACK:
        return np.nan
    return min(max(np.arccos(min(max(cosine, -1.0), 1.0)), _APART), np.pi - _APART)


@compiled(**FAST)
def _is_new(q: Array, answers: Array) -> bool:
    for branch in range(BRANCHES):
        if not np.isnan(answers[branch, 0]):
            apart = 0.0
            for i in range(7):
                apart = max(apart, abs(wrap(q[i] - answers[branch, i])))
            if apart < _SAME:
                return False
    return True
