"""The gripper poses that the task and its motions need, and how they are looked up.

Three layers, each for all 18 gripper orientations: the 18 *cells* where a cube is held, the
*grasp* poses at a cube on the table, and *vias* high above each column, through which motions
pass.
"""

from collections.abc import Iterator
from enum import StrEnum

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from models.errors import ModelError
from models.task.spaces import GRID_Z, N_GRIPPERS, POSITIONS, R_WG, REST_HEIGHT, VERTICAL

VIA_HEIGHT = 0.75
"""Height of the poses that motions pass through [m]."""
RETREAT = 0.005
"""How far short of the cube's centre a hand that is not vertical stops, along its approach [m].

Tilted hands would touch the table without it; vertical ones reach the centre itself.
"""

Key = tuple[int, int, int, int]


class Layer(StrEnum):
    """What a pose is for; `ADDED` are all that the task does not name."""

    CELL = "cell"
    VIA = "via"
    GRASP = "grasp"
    ADDED = "added"


def pose_key(p_WG: np.ndarray, gripper: int) -> Key:
    """Hash key of a pose: position ``[3]`` [m] rounded to 0.1 mm, and orientation 0…17.

    Raises:
        ModelError: if the position is not three finite numbers, or the orientation is unknown.
    """
    p_WG = np.asarray(p_WG, dtype=float)
    if p_WG.shape != (3,) or not np.isfinite(p_WG).all():
        raise ModelError(f"gripper position {p_WG.tolist()}; valid: three finite metres")
    if gripper not in range(N_GRIPPERS):
        raise ModelError(f"gripper orientation {gripper}; valid: 0…{N_GRIPPERS - 1}")
    x, y, z = (round(coordinate * 1e4) for coordinate in p_WG.tolist())
    return x, y, z, int(gripper)


def gripper_pose(p_WG: np.ndarray, gripper: int) -> RigidTransform:
    """X_WG from the position ``[3]`` [m] and the index of the orientation, 0…17."""
    return RigidTransform(RotationMatrix(R_WG[gripper]), p_WG)


def grasp_position(p_WO: np.ndarray, gripper: int) -> np.ndarray:
    """Where the tool centre point ``[3]`` grasps a cube centred at ``p_WO [3]`` [m]."""
    retreat = 0.0 if gripper in VERTICAL else RETREAT
    return p_WO - retreat * R_WG[gripper][:, 2]


def via_position(p_W: np.ndarray) -> np.ndarray:
    """The point ``[3]`` at `VIA_HEIGHT` in the column of ``p_W [3]`` [m]."""
    return np.array([p_W[0], p_W[1], VIA_HEIGHT])


def standard_poses(gripper: int) -> Iterator[tuple[Layer, np.ndarray]]:
    """Layer and position ``[3]`` [m] of every pose of one orientation, middle columns first."""
    columns = POSITIONS[::2]
    columns = columns[np.argsort(np.linalg.norm(columns - columns.mean(0), axis=1), kind="stable")]
    for z in GRID_Z[::-1]:
        for p_W in columns:
            yield Layer.CELL, np.array([p_W[0], p_W[1], z])
    for p_W in columns:
        yield Layer.VIA, via_position(p_W)
    for p_W in columns:
        yield Layer.GRASP, grasp_position(np.array([p_W[0], p_W[1], REST_HEIGHT]), gripper)
