"""What every action would lead to if the cube were rigid in the hand: estimates from geometry.

They complete the transition model where nothing was measured (thesis 5.9). Each action ends as
it is meant to:

* grasp: the cube is held in its column's lower cell, its orientation kept;
* translate: the cube is held in the target cell, its orientation kept;
* rotate: the cube turns with the gripper, R_WO' = R_WG'·R_WGᵀ·R_WO, and its orientation is the
  nearest of the 48, or each of those equally near with the same probability;
* drop: the cube, already face down, is free in the same column, its orientation kept.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from models.task.discretise import all_nearest_orientations
from models.task.pairs import feasible_pairs
from models.task.spaces import (
    R_WG,
    R_WO,
    Indices,
    Kind,
    encode_states,
)

TIE = 1e-3
"""Radians within which two orientations are equally near.

Turning from one gripper orientation to another leaves either an exact tie of two or a
difference of at least 3.7°; the rounded yaws of Table 4.2 (125° for 125.264°) break no tie. Any
tolerance from 1e-8 to 0.06 gives the same outcomes.
"""


class EstimatedTransitions(NamedTuple):
    """Sparse entries of the estimate, parallel arrays sorted by state, action, next state.

    Attributes:
        state: int32 ``[n]``.
        action: int32 ``[n]``.
        next_state: int32 ``[n]``.
        probability: float64 ``[n]``; sums to 1 over each (state, action).
    """

    state: NDArray[np.int32]
    action: NDArray[np.int32]
    next_state: NDArray[np.int32]
    probability: NDArray[np.float64]


def estimated_transitions(feasible: NDArray[np.bool_]) -> EstimatedTransitions:
    """Estimated outcomes of all `feasible_pairs`.

    Args:
        feasible: which pairs the robot can do, as `feasible_pairs` takes it.

    Raises:
        ModelError: if ``feasible`` has another shape or is not boolean.
    """
    state, action, position, orientation, gripper, kind, target = feasible_pairs(feasible)

    rotates, drops = kind == Kind.ROTATE, kind == Kind.DROP
    next_position = np.where(kind == Kind.TRANSLATE, target, position)
    next_position = np.where(drops, position - position % 2, next_position)
    next_gripper = np.where((kind == Kind.GRASP) | rotates, target, gripper)
    next_gripper = np.where(drops, -1, next_gripper)

    n_outcomes, outcomes = rotated_orientations()
    # Every other action keeps the orientation: one outcome.
    count = np.where(rotates, n_outcomes[gripper, next_gripper, orientation], 1)
    pair = np.repeat(np.arange(state.size), count)
    nth = np.arange(pair.size) - np.repeat(np.cumsum(count) - count, count)
    next_orientation = np.where(
        rotates[pair],
        outcomes[gripper[pair], next_gripper[pair], orientation[pair], nth],
        orientation[pair],
    )
    next_state = encode_states(next_position[pair], next_orientation, next_gripper[pair])
    return EstimatedTransitions(
        state[pair].astype(np.int32),
        action[pair].astype(np.int32),
        next_state.astype(np.int32),
        1.0 / count[pair],
    )


@cache
def rotated_orientations() -> tuple[Indices, Indices]:
    """Cube orientations after turning the gripper, the cube rigid in it.

    Returns:
        The number of equally near orientations ``[18, 18, 48]`` by gripper before, gripper
        after and orientation before; and they themselves in ascending order, −1 beyond their
        number, ``[18, 18, 48, most]``.
    """
    # R_WO' = R_WG'·R_WGᵀ·R_WO, by gripper before and after, and orientation.
    turn = R_WG[None] @ np.swapaxes(R_WG, -1, -2)[:, None]
    near = all_nearest_orientations(turn[:, :, None] @ R_WO, TIE)
    number = near.sum(axis=-1)
    most = int(number.max())
    # A stable sort of "not near" brings the near ones to the front, in ascending order.
    first = np.argsort(~near, axis=-1, kind="stable")[..., :most]
    return number, np.where(np.arange(most) < number[..., None], first, -1)
