"""State–action pairs: as one integer each, and as a boolean table of those that make sense.

A pair's *key* is ``state · N_ACTIONS + action``; keys sort as pairs do. `irl.pairs` has the same
for any task: neither package may import the other.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.errors import ModelError
from models.task.spaces import (
    N_ACTIONS,
    N_STATES,
    Indices,
    Kind,
    decode_actions,
    decode_states,
)


def pair_key(state: ArrayLike, action: ArrayLike) -> NDArray[np.int64]:
    """Key of each pair, int64; shapes broadcast."""
    return np.asarray(state, dtype=np.int64) * N_ACTIONS + np.asarray(action, dtype=np.int64)


def split_key(key: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """State and action of each key, int64."""
    state, action = np.divmod(np.asarray(key, dtype=np.int64), N_ACTIONS)
    return state, action


def nominal_pairs() -> NDArray[np.bool_]:
    """Pairs that make sense before any robot is asked; bool ``[N_STATES, N_ACTIONS]``.

    Grasps of a free cube; translations, rotations and the drop of a held one, except those to
    where it already is.
    """
    position, _, gripper = (part[:, None] for part in decode_states(np.arange(N_STATES)))
    kind, target = decode_actions(np.arange(N_ACTIONS))
    held = gripper >= 0
    stays = ((kind == Kind.TRANSLATE) & (target == position)) | (
        (kind == Kind.ROTATE) & (target == gripper)
    )
    return np.where(kind == Kind.GRASP, ~held, held & ~stays)


class PairArrays(NamedTuple):
    """Pairs and their components, arrays of one shape, as `StateArrays` and `ActionArrays` say."""

    state: Indices
    action: Indices
    position: Indices
    orientation: Indices
    gripper: Indices
    kind: Indices
    target: Indices


def feasible_pairs(feasible: ArrayLike) -> PairArrays:
    """Every pair that the robot can do and that `nominal_pairs` allows.

    Args:
        feasible: which pairs the robot can do, bool ``[N_STATES, N_ACTIONS]``, or with one row
            more for *lost*, which is not looked at.

    Returns:
        Arrays ``[n]``, sorted by state, then action.

    Raises:
        ModelError: if ``feasible`` has another shape or is not boolean.
    """
    table = np.asarray(feasible)
    if table.dtype != np.bool_ or table.shape not in (
        (N_STATES, N_ACTIONS),
        (N_STATES + 1, N_ACTIONS),
    ):
        raise ModelError(
            f"feasible is {table.dtype} {list(table.shape)}; "
            f"wanted bool [{N_STATES}, {N_ACTIONS}], or with one row more for lost"
        )
    state, action = np.nonzero(table[:N_STATES] & nominal_pairs())
    return PairArrays(state, action, *decode_states(state), *decode_actions(action))
