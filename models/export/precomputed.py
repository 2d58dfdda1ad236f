"""The arm's pre-computed joint trajectory as a file, and the check that one can be played.

Degrees; `models.export.trajectories` says where the rules come from. A file begins with what it
was made for, in lines of ``# name: value``, and goes on as CSV::

    # speed_limit_deg_s: 50
    time_s,joint_1_deg,…,joint_7_deg,joint_1_deg_s,…,joint_1_deg_s2,…
    0.000,…
    0.001,…
"""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from models.arrays import Array, finite_vector
from models.errors import ModelError
from models.export.trajectories import JOINT_NAMES, JOINT_SPEEDS, STEP, Motion
from models.texts import read_text

POSITION_LIMITS = np.array([np.inf, 128.9, np.inf, 147.8, np.inf, 120.3, np.inf])
"""Of each joint to either side [deg]; infinite where it turns without end. Gen3 user guide."""
MARGIN = 0.5
"""That a trajectory keeps from them [deg]."""
ACCELERATION_LIMITS = np.array([297.94] * 4 + [572.95] * 3)
"""Of each joint [deg/s²]; Gen3 user guide."""
AT_START = 0.1
"""How far the first point may be from where the arm is [deg]."""

SPEED = "speed_limit_deg_s"
COLUMNS = (
    "time_s",
    *(f"{name}_{unit}" for unit in ("deg", "deg_s", "deg_s2") for name in JOINT_NAMES),
)
_TELLING = 0.01  # by how much a printed speed may exceed a limit, or be no rest [deg/s]
_AGREEING = 1.0  # how far a speed may be from the slope of the angles [deg/s]


def to_precomputed(motion: Motion) -> str:
    """A motion as the text of such a file."""
    lines = [f"# {SPEED}: {motion.speed_limit:g}", ",".join(COLUMNS)]
    table = np.degrees(np.hstack([motion.q, motion.velocity, motion.acceleration]))
    for i, row in enumerate(table):
        lines.append(f"{i * STEP:.3f}," + ",".join(f"{value:.9f}" for value in row))
    return "\n".join(lines) + "\n"


def require_precomputed(path: Path | str, start: ArrayLike | None = None) -> None:
    """Refuse a file that the arm would refuse.

    Args:
        path: the file.
        start: joint angles ``[7]`` [rad] where the arm is, those of endless joints but for whole
            turns; None does not look at that.

    Raises:
        ModelError: naming the file, the line, the joint and what is valid there.
    """
    require_precomputed_text(read_text(path, "a trajectory in CSV"), str(path), start)


def require_precomputed_text(text: str, name: str, start: ArrayLike | None = None) -> None:
    """Refuse the text of a file that the arm would refuse, as `require_precomputed`."""
    lines = text.splitlines()
    first = next((i for i, line in enumerate(lines) if not line.startswith("#")), len(lines))
    speed_limit = _speed_limit(lines[:first], name)
    found = tuple(lines[first].split(",")) if first < len(lines) else ()
    if found != COLUMNS:
        wrong = next((c for c in COLUMNS if c not in found), "their order")
        raise ModelError(f"{name}: line {first + 1}: columns lack {wrong}; valid: {COLUMNS[0]}, …")
    table = _numbers(lines[first + 1 :], name, first + 2)
    if len(table) < 2:
        raise ModelError(f"{name}: line {len(lines)}: ends there; valid: two points or more")

    def refuse(bad: np.ndarray, said: Array, unit: str, valid: object) -> None:
        """Name the first line of a ``[n, 7]`` or ``[n]`` mask, its joint and value."""
        if not bad.any():
            return
        row = int(np.flatnonzero(bad.reshape(len(bad), -1).any(axis=1))[0])
        place = f"{name}: line {row + first + 2}: "
        if bad.ndim == 1:
            raise ModelError(f"{place}{said[row]:.9g} {unit}; valid: {valid}")
        joint = int(np.flatnonzero(bad[row])[0])
        allowed = valid[joint] if isinstance(valid, np.ndarray) else valid
        raise ModelError(
            f"{place}{JOINT_NAMES[joint]} at {said[row, joint]:.9g} {unit}; valid: {allowed}"
        )

    time, (q, v, a) = table[:, 0], np.split(table[:, 1:], 3, axis=1)
    due = STEP * np.arange(len(time))
    refuse(np.abs(time - due) > 1e-7, time, "s", "0 first, then a point every 0.001 s")
    if start is not None:
        here = np.degrees(finite_vector(start, len(JOINT_NAMES), "start"))
        apart = (q[:1] - here + 180.0) % 360.0 - 180.0
        apart = np.where(np.isfinite(POSITION_LIMITS), q[:1] - here, apart)
        refuse(np.abs(apart) > AT_START, q[:1], "deg", f"where the arm is, to {AT_START} deg")
    limits = POSITION_LIMITS - MARGIN
    refuse(np.abs(q) > limits, q, "deg", np.array([f"±{limit:.6g} deg" for limit in limits]))
    speeds = np.minimum(JOINT_SPEEDS, speed_limit)
    told = np.array([f"±{speed:.6g} deg/s" for speed in speeds])
    refuse(np.abs(v) > speeds + _TELLING, v, "deg/s", told)
    slope = np.vstack([np.zeros(q.shape[1]), np.diff(q, axis=0) / STEP])
    refuse(np.abs(slope) > speeds + _TELLING, slope, "deg/s since the line before", told)
    allowed = np.array([f"±{limit:.6g} deg/s²" for limit in ACCELERATION_LIMITS])
    refuse(np.abs(a) > ACCELERATION_LIMITS, a, "deg/s²", allowed)
    moving = np.zeros(v.shape, dtype=bool)
    moving[[0, -1]] = np.abs(v[[0, -1]]) > ACCELERATION_LIMITS * STEP
    refuse(moving, v, "deg/s", "at rest first and last")
    change = np.vstack([np.zeros(v.shape[1]), np.diff(v, axis=0) / STEP])
    beyond = np.abs(change) > ACCELERATION_LIMITS + _TELLING / STEP
    refuse(beyond, change, "deg/s² since the line before", allowed)
    disagreeing = np.abs(slope[1:] - (v[1:] + v[:-1]) / 2.0) > _AGREEING
    refuse(np.vstack([disagreeing[:1] & False, disagreeing]), v, "deg/s", "the slope of its angles")


def _speed_limit(comments: list[str], name: str) -> float:
    """The limit that a file was made for [deg/s]."""
    for number, line in enumerate(comments, 1):
        key, _, value = line.lstrip("# ").partition(":")
        if key == SPEED:
            try:
                limit = float(value)
            except ValueError:
                limit = np.nan
            if 0.0 < limit <= JOINT_SPEEDS.max() + 1.0:
                return limit
            raise ModelError(
                f"{name}: line {number}: {SPEED} is {value.strip()!r}; valid: above 0, at most 80"
            )
    raise ModelError(f"{name}: line 1: no '# {SPEED}: …'; valid: the limit that it was timed for")


def _numbers(lines: list[str], name: str, first: int) -> Array:
    """The table ``[n, 22]`` of lines of numbers, the first of which has this number."""
    table = np.empty((len(lines), len(COLUMNS)))
    for i, line in enumerate(lines):
        cells = line.split(",")
        if len(cells) != len(COLUMNS):
            raise ModelError(
                f"{name}: line {first + i}: {len(cells)} values; valid: {len(COLUMNS)}"
            )
        for j, cell in enumerate(cells):
            try:
                table[i, j] = float(cell)
            except ValueError:
                table[i, j] = np.nan
            if not np.isfinite(table[i, j]):
                raise ModelError(
                    f"{name}: line {first + i}: {COLUMNS[j]} is {cell!r:.40}; "
                    "valid: a finite number"
                )
    return table
