"""State–action pairs as a boolean table: which make sense, and a check of those handed in."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.errors import ModelError
from models.task.spaces import (
    N_ACTIONS,
    N_STATES,
    Kind,
    decode_actions,
    decode_states,
)


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


def require_pairs(feasible: ArrayLike) -> NDArray[np.bool_]:
    """Give a table of feasible pairs back as ``[N_STATES, N_ACTIONS]``; a row of *lost* is cut.

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
    return table[:N_STATES]
