"""The Gen3 Lite's inverse kinematics: all real solutions of a pose, up to 16, in two stages.

As the thesis does (A.2): a polynomial in one unknown gives every solution of the arm with right
angles (`polynomial`), and a numerical stage removes what is left of the error
(`chain`). Left are the description's right angles, rounded to 1.5708, and the rounding
of multiple roots. Where solutions merge, within about 1e-3 rad, one of them may be missing.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.arrays import finite_array
from models.compiled import compiled
from models.errors import ModelError
from models.gen3_lite.chain import LIMIT, TOLERANCE, tune_batch
from models.gen3_lite.polynomial import SOLUTIONS, approximate
from models.rotations import require_rotation
from models.scenes.limits import ROUNDING

Array = NDArray[np.float64]

_SAME = 1e-6  # solutions nearer than this are one [rad]
_CHUNK = 4096  # poses at a time, for the sake of memory


class Solutions(NamedTuple):
    """Every solution of each of n poses; what does not exist is NaN.

    Attributes:
        q: joint angles ``[n, 16, 6]`` within [−π, π) [rad], any joint limits left aside.
        rough_error: error of the polynomial's answer before fine-tuning ``[n, 16]``, the largest
            component of position [m] and rotation vector [rad].
        error: the same after it.
        starts: how many answers of the polynomial went into fine-tuning ``[n]``.
        failures: how many of them it could not bring to the pose ``[n]``.
    """

    q: Array
    rough_error: Array
    error: Array
    starts: NDArray[np.int64]
    failures: NDArray[np.int64]


def solve(R_BE: ArrayLike, p_BE: ArrayLike) -> Array:
    """Every joint configuration that reaches one pose, limits left aside.

    Args:
        R_BE: rotation of the end effector in the base ``[3, 3]``.
        p_BE: its position ``[3]`` [m].

    Returns:
        Joint angles ``[k, 6]`` [rad], 0 ≤ k ≤ 16, within [−π, π), met within 1e-11 m and rad.

    Raises:
        ModelError: if a shape is another, a value is not finite, or ``R_BE`` is not a rotation.
    """
    R, p = finite_array(R_BE, (), "R_BE"), finite_array(p_BE, (), "p_BE")
    q = solve_batch(R[None], p[None]).q[0]
    return q[~np.isnan(q[:, 0])]


def solve_batch(R_BE: ArrayLike, p_BE: ArrayLike) -> Solutions:
    """`solve` for every pose, with what each stage contributed; compiled at the first call.

    Args:
        R_BE: rotations of the end effector in the base ``[n, 3, 3]``.
        p_BE: its positions ``[n, 3]`` [m].

    Raises:
        ModelError: if a shape is another, a value is not finite, or a matrix is not a rotation.
    """
    R, p = require_rotation(R_BE, "R_BE"), finite_array(p_BE, (), "p_BE")
    if R.ndim != 3 or p.shape != (len(R), 3):
        shapes = f"{list(R.shape)}, {list(p.shape)}"
        raise ModelError(f"R_BE, p_BE have shapes {shapes}; wanted [n, 3, 3], [n, 3]")
    # One memory layout, else each further one is compiled anew.
    R, p = np.ascontiguousarray(R), np.ascontiguousarray(p)
    chunks = [_solve(R[i : i + _CHUNK], p[i : i + _CHUNK]) for i in range(0, len(R), _CHUNK)]
    chunks = chunks or [_solve(R, p)]
    return Solutions(*(np.concatenate(arrays) for arrays in zip(*chunks, strict=True)))


def within_limits(q: ArrayLike) -> NDArray[np.bool_]:
    """Whether configurations ``[..., 6]`` [rad] respect the joint limits; NaN does not.

    One at a limit does, within a rounding.
    """
    return (np.abs(np.asarray(q)) <= LIMIT + ROUNDING).all(axis=-1)


def _solve(R: Array, p: Array) -> Solutions:
    pose, q, misfit = approximate(R, p)
    order = np.lexsort((misfit, pose))  # of answers that tune to the same, the best is kept
    pose, q = pose[order], q[order]
    before, after = tune_batch(q, R[pose], p[pose])
    met = after < TOLERANCE
    kept, place = _distinct(pose[met], q[met], len(R))
    found = Solutions(
        np.full((len(R), SOLUTIONS, 6), np.nan),
        np.full((len(R), SOLUTIONS), np.nan),
        np.full((len(R), SOLUTIONS), np.nan),
        np.bincount(pose, minlength=len(R)),
        np.bincount(pose[~met], minlength=len(R)),
    )
    slots = pose[met][kept], place[kept]
    found.q[slots], found.rough_error[slots] = q[met][kept], before[met][kept]
    found.error[slots] = after[met][kept]
    return found


@compiled()
def _distinct(
    pose: NDArray[np.int64], q: Array, n_poses: int
) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Which of ``q [k, 6]`` are new to their pose, 16 at most, and their places ``[k]`` there."""
    kept, place = np.zeros(len(q), dtype=np.bool_), np.zeros(len(q), dtype=np.int64)
    counts = np.zeros(n_poses, dtype=np.int64)
    known = np.empty((SOLUTIONS, 6))
    for i in range(len(q)):
        count = counts[pose[i]]  # answers come pose by pose
        if count < SOLUTIONS and _is_new(q[i], known[:count]):
            known[count], kept[i], place[i] = q[i], True, count
            counts[pose[i]] += 1
    return kept, place


@compiled()
def _is_new(q: Array, others: Array) -> bool:
    for other in others:
        apart = 0.0
        for i in range(6):
            apart = max(apart, abs((q[i] - other[i] + np.pi) % (2.0 * np.pi) - np.pi))
        if apart < _SAME:
            return False
    return True
