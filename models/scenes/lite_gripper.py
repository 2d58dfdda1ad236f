"""The Gen3 Lite's gripper: opening between the fingertips, from the angle of the bottom joints.

Each finger's tip link turns back by 0.676 of what the bottom joint opens, so the tips stay
nearly parallel. Lengths from `description/gen3_lite_2f.urdf`.
"""

import numpy as np
from numpy.typing import ArrayLike

JOINTS = ("right_finger_bottom", "right_finger_tip", "left_finger_bottom", "left_finger_tip")
LOWER, UPPER = -0.09, 0.96
"""Range of a bottom joint [rad]; open at the upper end."""

_BOTTOM_Y = 0.0305  # bottom joint from the gripper's middle plane [m]
_TIP_Y, _TIP_Z = 0.020423, 0.045636  # bottom joint to tip joint, at zero [m]
_PAD_Y, _PAD_Z = 0.006831, 0.017054  # tip joint to the middle of the tip's inner face [m]
_TIP_RATE, _TIP_OFFSET = -0.676, 0.149  # tip angle = rate × bottom angle + offset [rad]


def opening(bottom: ArrayLike) -> np.ndarray:
    """Distance between the middles of the tips' inner faces [m] at a bottom angle [rad]."""
    bottom = np.asarray(bottom, dtype=float)
    total = bottom + _TIP_RATE * bottom + _TIP_OFFSET
    inward = _TIP_Y * np.cos(bottom) - _TIP_Z * np.sin(bottom)
    inward = inward + _PAD_Y * np.cos(total) - _PAD_Z * np.sin(total)
    return 2.0 * (_BOTTOM_Y - inward)


MAX_OPENING = float(opening(UPPER))
"""Opening at the joints' upper end [m]."""


def joint_positions(width: float) -> np.ndarray:
    """Positions [rad] of the joints in `JOINTS` that open the tips by ``width`` [m].

    ``width`` is clipped to what the joints can do.
    """
    angles = np.linspace(LOWER, UPPER, 2001)  # to 1e-7 m
    bottom = np.interp(width, opening(angles), angles)
    return np.tile([bottom, _TIP_RATE * bottom + _TIP_OFFSET], 2)
