"""State features: the ten of the thesis (6.3) and rotation-matrix ones for a network.

Both are float32 with one row a state and a row of zeros for *lost*, whose value is given, not
learnt: among the thesis' features that row is also the unturned free cube's in the first column.
A free cube rests on the table, but its height is its cell's, as in the states.
"""

import numpy as np
from numpy.typing import NDArray

from models.task.spaces import (
    GRIPPER_ANGLES,
    N_STATES,
    ORIENTATION_ANGLES,
    POSITIONS,
    R_WG,
    R_WO,
    Array,
    decode_states,
)

THESIS_NAMES = ("x", "y", "z", "alpha", "beta", "gamma", "is_grasp", "roll", "pitch", "yaw")
ROTATION_NAMES = (
    *("x", "y", "z"),
    *(f"R_WO_{row}{column}" for row in "xyz" for column in "xyz"),
    "is_grasp",
    *(f"R_WG_{row}{column}" for row in "xyz" for column in "xyz"),
    *(f"R_GO_{row}{column}" for row in "xyz" for column in "xyz"),
)


def thesis_features() -> NDArray[np.float32]:
    """The ten features of 6.3, `THESIS_NAMES`, each in [0, 1]; ``[N_STATES + 1, 10]``.

    Positions run from 0 to 1 over the grid. Angles are those of Tables 4.1 and 4.2, taken
    modulo 360° and divided by 360°. The gripper's are zero for a free cube, a triple no gripper
    orientation has.
    """
    position, orientation, gripper = decode_states(np.arange(N_STATES))
    held = gripper >= 0
    hand = np.where(held[:, None], _turns(GRIPPER_ANGLES)[gripper], 0.0)
    columns = [_unit_positions()[position], _turns(ORIENTATION_ANGLES)[orientation]]
    return _with_lost([*columns, held[:, None], hand])


def rotation_features() -> NDArray[np.float32]:
    """Features that place near what is near: `ROTATION_NAMES`; ``[N_STATES + 1, 31]``.

    Position as in `thesis_features`; R_WO, R_WG and the cube in the gripper R_GO = R_WGᵀ·R_WO
    row by row; ``is_grasp``. R_WG and R_GO are zero for a free cube.
    """
    position, orientation, gripper = decode_states(np.arange(N_STATES))
    held = gripper >= 0
    cube, hand = R_WO[orientation], R_WG[gripper] * held[:, None, None]
    cube_in_hand = np.swapaxes(hand, -1, -2) @ cube
    return _with_lost(
        [
            _unit_positions()[position],
            cube.reshape(-1, 9),
            held[:, None],
            hand.reshape(-1, 9),
            cube_in_hand.reshape(-1, 9),
        ]
    )


def _unit_positions() -> Array:
    low, high = POSITIONS.min(axis=0), POSITIONS.max(axis=0)
    return (POSITIONS - low) / (high - low)


def _turns(degrees: Array) -> Array:
    return degrees % 360.0 / 360.0


def _with_lost(columns: list[NDArray]) -> NDArray[np.float32]:
    features = np.concatenate(columns, axis=1)
    return np.pad(features, ((0, 1), (0, 0))).astype(np.float32)
