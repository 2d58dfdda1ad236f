"""Groups of states with a name: clusters (Table 5.4), comfort (5.10.1), preferences (5.12)."""

import numpy as np
from numpy.typing import NDArray

from models.task.spaces import (
    GOAL_ORIENTATION,
    GOAL_POSITION,
    LOST,
    N_STATES,
    ORIENTATION_ANGLES,
    POSITIONS,
    R_WG,
    Indices,
    decode_states,
)

ALONG = 0.9
"""Cosine beyond which the approach axis points along a world axis (Table 5.4)."""

GRIPPER_DOWN = R_WG[:, 2, 2] < -ALONG
GRIPPER_FRONT = R_WG[:, 0, 2] > ALONG
GRIPPER_RIGHT = R_WG[:, 1, 2] < -ALONG
GRIPPER_LEFT = R_WG[:, 1, 2] > ALONG
"""Which gripper orientations point so, bool ``[18]``; the tilted and oblique ones nowhere."""


def clusters() -> dict[str, Indices]:
    """The 20 clusters of Table 5.4, name → sorted state indices; *lost* is in none.

    Angles are those of Table 4.1: α about x, β about y, γ about z. Gripper clusters hold states
    in which the cube is held; all others free and held ones alike.
    """
    position, orientation, gripper = decode_states(np.arange(N_STATES))
    held = gripper >= 0
    alpha, beta, gamma = ORIENTATION_ANGLES[orientation].T
    x, y, z = POSITIONS[position].T
    members = {
        "not_grasped": ~held,
        "grasped": held,
        "gripper_down": held & GRIPPER_DOWN[gripper],
        "gripper_front": held & GRIPPER_FRONT[gripper],
        "gripper_right": held & GRIPPER_RIGHT[gripper],
        "gripper_left": held & GRIPPER_LEFT[gripper],
        "object_z_vertical": np.isin(alpha, [0, 180]) & (beta == 0),
        "object_x_vertical": (alpha == 0) & np.isin(beta, [90, 270]),
        "object_y_vertical": np.isin(alpha, [90, 270]) & (beta == 0),
        "object_z_0": gamma % 180 == 0,
        "object_z_45": gamma % 180 == 45,
        "object_z_90": gamma % 180 == 90,
        "object_z_135": gamma % 180 == 135,
        "back_limit": x == 0.5,
        "front_limit": x == 0.6,
        "right_limit": y == -0.1,
        "left_limit": y == 0.1,
        "under_limit": z == 0.55,
        "upper_limit": z == 0.6,
        "center": (x == 0.55) & (y == 0.0),
    }
    return {name: np.flatnonzero(member) for name, member in members.items()}


def uncomfortable_poses() -> NDArray[np.bool_]:
    """Less comfortable gripper poses (5.10.1), bool ``[18, 18]`` by position and gripper.

    Pointing left at y = −0.1 m, or right at y = 0.1 m, in the sense of Table 5.4: the two level
    orientations along y, not the tilted or oblique ones.
    """
    y = POSITIONS[:, None, 1]
    return ((y == -0.1) & GRIPPER_LEFT) | ((y == 0.1) & GRIPPER_RIGHT)


def uncomfortable_states() -> Indices:
    """Sorted indices of the states that hold the cube in an uncomfortable pose."""
    position, _, gripper = decode_states(np.arange(N_STATES))
    return np.flatnonzero((gripper >= 0) & uncomfortable_poses()[position, gripper])


def state_preferences(state: NDArray, next_state: NDArray) -> dict[str, Indices]:
    """States to seek and to avoid (5.12): sorted indices ``preferred`` and ``avoided``.

    Preferred: the cube unturned, orientation (0°, 0°, 0°), at (0.5, 0, z) m, free or held.

    Avoided: uncomfortable poses, and states from which no transition leads to the unturned
    orientation. The latter is read as: *held* states, not themselves unturned, none of whose
    feasible actions has an unturned cube among its outcomes: this grasp must be let go. In one
    action, since in several every state gets there; of held states, since a grasp turns nothing
    and the clause would condemn every free state but the unturned ones. A held state without any
    transition is avoided too. *Lost* is in neither list: its value is given.

    Args:
        state: state of each transition entry ``[n]``.
        next_state: its successor ``[n]``.
    """
    position, orientation, gripper = decode_states(np.arange(N_STATES))
    unturned = orientation == GOAL_ORIENTATION
    at_goal = position // 2 == GOAL_POSITION // 2

    state, next_state = np.asarray(state), np.asarray(next_state)
    inside = (state != LOST) & (next_state != LOST)
    state, next_state = state[inside], next_state[inside]
    can_be_unturned = np.zeros(N_STATES, dtype=bool)
    can_be_unturned[state[unturned[next_state]]] = True

    avoided = (gripper >= 0) & ~unturned & ~can_be_unturned
    avoided[uncomfortable_states()] = True
    return {
        "preferred": np.flatnonzero(unturned & at_goal),
        "avoided": np.flatnonzero(avoided),
    }
