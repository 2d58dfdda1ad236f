"""The Gen3's inverse kinematics in closed form, with q3 as the redundancy parameter.

Frame B is the arm's base, E its end effector (`description/gen3.urdf`). What is returned is exact
and within the limits, everywhere. Answers may be missing, seldom all:

* Straight wrist (|q6| up to 0.01 rad; 0.05 beside another of these): only q5 + q7 is well
  determined. The wrist's offset leaves up to four answers, milliradians of q6 apart, where an arm
  without it has two; at most two are found.
* Stretched elbow, or wrist at its least distance from the first axis: two answers merge. They
  count as one within 1e-6 rad; within 0.02 rad Newton's method may miss one, up to one in fifty.
* Wrist on the first axis: q1 is free and Newton's equations are singular. One answer of the
  continuum comes back, or none. Another q3 has isolated ones.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.arrays import finite_array
from models.compiled import FAST, compiled
from models.errors import ModelError
from models.gen3.branches import BRANCHES, solve_into, wrist_in_reach
from models.gen3.chain import Array
from models.gen3.newton import MET, OUT_OF_REACH, work_arrays
from models.rotations import require_rotation

_TOLERANCE = 1e-11  # of the pose [m, rad]
_FIRST_TOLERANCE = 1e-6  # where the first answer will do


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
        ModelError: if a shape is another, a value is not finite, or ``R_BE`` is not a rotation.
    """
    R, p = finite_array(R_BE, (), "R_BE"), finite_array(p_BE, (), "p_BE")
    q = solve_batch(R[None], p[None], [q3])[0, 0]
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
        ModelError: if a shape is another, a value is not finite, or a matrix is not a rotation.
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
        ModelError: if a shape is another, a value is not finite, or a matrix is not a rotation.
    """
    return _solve_first(*_checked(R_BE, p_BE, q3))


def _checked(R_BE: ArrayLike, p_BE: ArrayLike, q3: ArrayLike) -> tuple[Array, Array, Array]:
    R = require_rotation(R_BE)
    p, q3 = finite_array(p_BE, (), "p_BE"), finite_array(q3, (), "q3")
    if R.ndim != 3 or p.shape != (len(R), 3) or q3.ndim != 1:
        shapes = f"{list(R.shape)}, {list(p.shape)}, {list(q3.shape)}"
        raise ModelError(f"R_BE, p_BE, q3 have shapes {shapes}; wanted [n, 3, 3], [n, 3], [m]")
    # One memory layout, else each further one is compiled anew.
    return np.ascontiguousarray(R), np.ascontiguousarray(p), np.ascontiguousarray(q3)


@compiled(**FAST)
def _solve_batch(R: Array, p: Array, q3: Array) -> Array:
    q = np.full((len(R), len(q3), BRANCHES, 7), np.nan)
    work = work_arrays()
    for i in range(len(R)):
        for j in range(len(q3)):
            solve_into(R[i], p[i], q3[j], q[i, j], BRANCHES, _TOLERANCE, work)
    return q


@compiled(**FAST)
def _solve_first(R: Array, p: Array, q3: Array) -> tuple[Array, NDArray[np.int8]]:
    q, met = np.full((len(R), 7), np.nan), np.zeros(len(R), dtype=np.int8)
    answers, work = np.empty((BRANCHES, 7)), work_arrays()
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
