"""The Gen3's chain of joints as plain arrays, for compiled code.

Frame B is the arm's base, E its end effector (`description/gen3.urdf`); a gripper or a table
change nothing here.
"""

import numpy as np
from numpy.typing import NDArray

from models.compiled import FAST, compiled

Array = NDArray[np.float64]

Y = np.array([0.0, 0.005375, -0.21038, 0.006375, -0.20843, 0.00017505, -0.10593, 0.0])
"""Origins of joints 1 to 7 and of E in the preceding link, y [m]; x is zero."""
Z = np.array([0.15643, -0.12838, -0.006375, -0.21038, -0.006375, -0.10593, -0.00017505, -0.061525])
"""The same, z [m]."""
ROLL = np.array([3.1416, 1.5708, -1.5708, 1.5708, -1.5708, 1.5708, -1.5708, np.pi])
"""The same, rotation about x [rad], with the vendor's rounding; pitch and yaw are zero."""
LIMIT = np.array([np.inf, 2.24, np.inf, 2.57, np.inf, 2.09, np.inf])
"""Largest magnitude of each joint angle [rad]; infinite for an endless joint."""
HAND_LENGTH = -Y[6] - Z[7]
"""From the wrist to the end effector along its z [m]."""

_COS_ROLL, _SIN_ROLL = np.cos(ROLL), np.sin(ROLL)


def forward(q: Array) -> tuple[Array, Array]:
    """R_BE ``[3, 3]`` and p_BE ``[3]`` [m] at joint angles ``q [7]`` [rad], by the exact chain."""
    X = np.empty((3, 4))
    chain(np.asarray(q, dtype=np.float64), np.empty((6, 7)), X)
    return X[:, :3], X[:, 3]


@compiled(**FAST)
def chain(q: Array, J: Array, X: Array) -> None:
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


@compiled(**FAST)
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
