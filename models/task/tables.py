"""The state and action tables, one readable row an index, by the numbers of the thesis.

These texts are part of task data and of result files; `models.task.words` says the same to a
person.
"""

from collections.abc import Iterator

import numpy as np

from models.task.spaces import (
    GRIPPER_ANGLES,
    LOST,
    N_ACTIONS,
    N_STATES,
    ORIENTATION_ANGLES,
    POSITIONS,
    Action,
    State,
)

STATE_COLUMNS = (
    *("index", "x", "y", "z", "alpha", "beta", "gamma"),
    *("is_grasp", "gripper", "roll", "pitch", "yaw"),
)
ACTION_COLUMNS = ("index", "kind", "target", "description")


def state_rows() -> Iterator[tuple[str, ...]]:
    """Rows of `STATE_COLUMNS` for every state, *lost* last.

    Metres, and the degrees of Tables 4.1 and 4.2 as printed; ``z`` is the cell's. Gripper
    columns are empty for a free cube; *lost* has only an index.
    """
    positions, orientations, grippers = (
        [_numbers(row) for row in table]
        for table in (POSITIONS, ORIENTATION_ANGLES, GRIPPER_ANGLES)
    )
    for index in range(N_STATES):
        state = State.from_index(index)
        pose = positions[state.position] + orientations[state.orientation]
        if state.gripper is None:
            hand: tuple[str, ...] = ("0", "", "", "", "")
        else:
            hand = ("1", str(state.gripper), *grippers[state.gripper])
        yield (str(index), *pose, *hand)
    yield (str(LOST), *[""] * (len(STATE_COLUMNS) - 1))


def action_rows() -> Iterator[tuple[str, ...]]:
    """Rows of `ACTION_COLUMNS` for every action; a drop's target is empty."""
    for index in range(N_ACTIONS):
        action = Action.from_index(index)
        target = "" if action.target is None else str(action.target)
        yield (str(index), action.kind.name.lower(), target, str(action))


def describe_state(index: int) -> str:
    """Say a state by its numbers, such as ``free at (0.5, 0), turned (0, 0, 90)°``; *lost* as such.

    The angles are Table 4.1's α, β, γ.

    Raises:
        ModelError: if the index is out of range.
    """
    if index == LOST:
        return "lost"
    state = State.from_index(index)
    x, y, z = POSITIONS[state.position]
    turned = ", ".join(f"{angle:g}" for angle in ORIENTATION_ANGLES[state.orientation])
    if state.gripper is None:
        return f"free at ({x:g}, {y:g}), turned ({turned})°"
    return f"held at ({x:g}, {y:g}, {z:g}) by {state.gripper}, turned ({turned})°"


def _numbers(values: np.ndarray) -> tuple[str, ...]:
    return tuple(f"{value:g}" for value in values)
