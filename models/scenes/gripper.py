"""The 2F-85's linkage: opening between the pads, pad height and force, from the knuckle angle.

The outer fingers turn with the knuckles and the inner fingers turn back by the same angle, so
the pads stay parallel and travel on a circle. Lengths from `description/robotiq_2f_85.urdf`.
"""

import numpy as np
from numpy.typing import ArrayLike

KNUCKLE_Y = 0.0306011
"""Knuckle axis from the gripper's middle plane [m]."""
LINK_Y, LINK_Z = 0.0315 + 0.0061, -0.0041 + 0.0471
"""Knuckle axis to inner-finger joint, in the outer knuckle's frame [m]."""
PAD_SURFACE_Y = -0.0220203 - 0.00635 / 2
"""Inner-finger joint to the pad's surface along the closing axis [m]."""

TCP_FROM_FLANGE = 0.1425
"""Origin of frame G before the gripper's base, along the approach [m]; as `gen3_2f85.dmd.yaml`."""
MAX_OPENING = 0.085
"""Rated stroke [m]."""
KNUCKLE_LIMIT = 0.8
"""Largest knuckle angle [rad]."""


def opening(knuckle: ArrayLike) -> np.ndarray:
    """Distance between the pads' surfaces [m] at a knuckle angle [rad]; any shape."""
    knuckle = np.asarray(knuckle, dtype=float)
    return 2.0 * (KNUCKLE_Y + PAD_SURFACE_Y + LINK_Y * np.cos(knuckle) - LINK_Z * np.sin(knuckle))


def knuckle_angle(width: ArrayLike) -> np.ndarray:
    """Knuckle angle [rad] that opens the pads by ``width`` [m]; inverse of `opening`.

    ``width`` is clipped to what the linkage can do, 0 to 85 mm.
    """
    half = np.clip(np.asarray(width, dtype=float), 0.0, MAX_OPENING) / 2.0
    radius, phase = np.hypot(LINK_Y, LINK_Z), np.arctan2(LINK_Z, LINK_Y)
    angle = np.arccos((half - KNUCKLE_Y - PAD_SURFACE_Y) / radius) - phase
    return np.clip(angle, 0.0, KNUCKLE_LIMIT)


def closing_rate(knuckle: ArrayLike) -> np.ndarray:
    """Inward travel of one pad per knuckle angle [m/rad]: torque = pad force × this."""
    knuckle = np.asarray(knuckle, dtype=float)
    return LINK_Y * np.sin(knuckle) + LINK_Z * np.cos(knuckle)


def joint_positions(knuckle: float) -> np.ndarray:
    """Positions [rad] of the six joints in `JOINTS`, as the couplers hold them."""
    return knuckle * MULTIPLIERS


JOINTS = (
    "left_knuckle",
    "left_inner_knuckle",
    "left_inner_finger",
    "right_knuckle",
    "right_inner_knuckle",
    "right_inner_finger",
)
MULTIPLIERS = np.array([1.0, 1.0, -1.0, 1.0, 1.0, -1.0])
