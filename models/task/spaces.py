"""State and action spaces of the grasping task (thesis 4.1, Tables 4.1 and 4.2).

World frame W: z up, x away from the robot, y to its left, metres and radians. O is the cube's
frame at its centre, G the gripper's at the tool centre point: G_z approach, G_y closing axis.

A state is a cell, one of 48 cube orientations, and one of 18 gripper orientations if the cube
is held. Indices, in a fixed order::

    free   xy * 48 + orientation                              0 … 431
    held   432 + (position * 18 + gripper) * 48 + orientation  432 … 15,983
    LOST   15,984, the cube has left the grid or the table: absorbing, not a `State`

with ``xy = ix * 3 + iy`` (9 columns) and ``position = xy * 2 + iz`` (18 cells). A free cube
rests on the table and belongs to the lower layer, so its cell is ``xy * 2``.

Actions: 0–17 grasp with that gripper orientation, 18–35 translate to that cell, 36–53 rotate
to that gripper orientation, 54 drop.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.errors import ModelError
from models.rotations import xyz_euler_to_matrix, zyx_euler_to_matrix

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# --- The grid (4.1.1), metres -----------------------------------------------------------------
GRID_X = np.array([0.5, 0.55, 0.6])
GRID_Y = np.array([-0.1, 0.0, 0.1])
GRID_Z = np.array([0.55, 0.6])
CUBE_EDGE = 0.04
TABLE_TOP = 0.5
REST_HEIGHT = TABLE_TOP + CUBE_EDGE / 2
"""Height of the centre of a cube that rests on the table."""
POSITIONS = np.stack(np.meshgrid(GRID_X, GRID_Y, GRID_Z, indexing="ij"), axis=-1).reshape(-1, 3)
"""Cell centres p_W ``[18, 3]``."""

# --- Cube orientations (Table 4.1) ------------------------------------------------------------
N_YAWS = 8
ORIENTATION_ANGLES = np.array(
    [
        (alpha, beta, 45.0 * yaw)
        for alpha, beta in [(0, 0), (90, 0), (0, 270), (180, 0), (270, 0), (0, 90)]
        for yaw in range(N_YAWS)
    ]
)
"""Table 4.1 ``[48, 3]``: (α, β, γ) about x, y, z in degrees."""
R_WO = zyx_euler_to_matrix(np.radians(ORIENTATION_ANGLES[:, ::-1]))
"""The 48 cube orientations Rz(γ)·Ry(β)·Rx(α) ``[48, 3, 3]``, each with a face down."""

# --- Gripper orientations (Table 4.2) ---------------------------------------------------------
GRIPPER_ANGLES = np.array(
    [
        (0, 90, 0),
        (-90, 0, 90),
        (-90, 45, 90),
        (90, 0, -90),
        (90, 45, -90),
        (0, 135, 0),
        (-135, 0, 90),
        # A level closing axis would want ±(90 + arctan √½) = ±125.26°; the table rounds.
        (-135, 45, 125),
        (135, 0, -90),
        (135, 45, -125),
        *((0, 180, 45 * i) for i in range(8)),
    ],
    dtype=np.float64,
)
"""Table 4.2 ``[18, 3]``: roll, pitch, yaw (X-Y-Z Euler) in degrees, as printed."""
R_WG = xyz_euler_to_matrix(np.radians(GRIPPER_ANGLES))
"""The 18 gripper orientations ``[18, 3, 3]``; column 1 is the closing axis, 2 the approach."""
HORIZONTAL, TILTED, VERTICAL = range(5), range(5, 10), range(10, 18)
"""Kinds of gripper orientation: approach level, 30° or 45° downwards, straight down."""
GRIPPER_NAMES = (
    *(f"horizontal, {way}" for way in ("front", "left", "front left", "right", "front right")),
    *(f"tilted, {way}" for way in ("front", "left", "front left", "right", "front right")),
    *(f"vertical, turned {45 * i}°" for i in range(8)),
)

# --- Counts -----------------------------------------------------------------------------------
N_XY, N_POSITIONS, N_ORIENTATIONS, N_GRIPPERS = 9, 18, 48, 18
N_FREE = N_XY * N_ORIENTATIONS
N_HELD = N_POSITIONS * N_GRIPPERS * N_ORIENTATIONS
N_STATES = N_FREE + N_HELD
"""15,984, the count of the thesis, *lost* left out."""
LOST = N_STATES
"""Index of *lost*; arrays over all states, it included, have `N_STATES` + 1 rows."""
N_TARGETS = 18
"""Targets of each kind of action but the drop: as many grippers as cells."""
N_ACTIONS = 3 * N_TARGETS + 1
GOAL_POSITION, GOAL_ORIENTATION = 2, 0
"""The goal (5.10): a free cube in the cell (0.5, 0, 0.55) m, unturned."""
GOAL_STATE = (GOAL_POSITION // 2) * N_ORIENTATIONS + GOAL_ORIENTATION


class StateArrays(NamedTuple):
    """Components of states, arrays of one shape; all −1 for *lost*.

    Attributes:
        position: cell 0…17.
        orientation: cube orientation 0…47.
        gripper: gripper orientation 0…17, −1 if the cube is free.
    """

    position: Indices
    orientation: Indices
    gripper: Indices


class ActionArrays(NamedTuple):
    """Components of actions, arrays of one shape.

    Attributes:
        kind: a `Kind`.
        target: gripper orientation or cell 0…17, −1 for a drop.
    """

    kind: Indices
    target: Indices


class Kind(IntEnum):
    """The four kinds of action, in index order."""

    GRASP = 0
    TRANSLATE = 1
    ROTATE = 2
    DROP = 3


def encode_states(position: ArrayLike, orientation: ArrayLike, gripper: ArrayLike) -> Indices:
    """State indices; the arguments broadcast, ``gripper`` is −1 for a free cube.

    Raises:
        ModelError: if a component is out of range or a free cube is in the upper layer.
    """
    position, orientation, gripper = np.broadcast_arrays(
        _within("position", position, 0, N_POSITIONS),
        _within("orientation", orientation, 0, N_ORIENTATIONS),
        _within("gripper", gripper, -1, N_GRIPPERS),
    )
    free = gripper < 0
    if np.any(free & (position % 2 == 1)):
        raise ModelError(
            "a free cube in the layer z = 0.6 is not a state; "
            "give an even position, or a gripper orientation 0…17"
        )
    held = N_FREE + (position * N_GRIPPERS + gripper) * N_ORIENTATIONS + orientation
    return np.where(free, (position // 2) * N_ORIENTATIONS + orientation, held)


def decode_states(index: ArrayLike) -> StateArrays:
    """Components of states given by index, the inverse of `encode_states`; *lost* is all −1.

    Raises:
        ModelError: if an index is out of range.
    """
    index = _within("state index", index, 0, N_STATES + 1)
    free, lost = index < N_FREE, index == LOST
    cell, orientation = np.divmod(np.where(free, index, index - N_FREE), N_ORIENTATIONS)
    position = np.where(free, 2 * cell, cell // N_GRIPPERS)
    gripper = np.where(free, -1, cell % N_GRIPPERS)
    return StateArrays(*(np.where(lost, -1, part) for part in (position, orientation, gripper)))


def encode_actions(kind: ArrayLike, target: ArrayLike) -> Indices:
    """Action indices; the arguments broadcast, ``target`` is ignored for a drop.

    Raises:
        ModelError: if a component is out of range.
    """
    kind = _within("action kind", kind, 0, len(Kind))
    target = _within("action target", np.where(kind == Kind.DROP, 0, target), 0, N_TARGETS)
    return kind * N_TARGETS + target


def decode_actions(index: ArrayLike) -> ActionArrays:
    """Components of actions given by index, the inverse of `encode_actions`.

    Raises:
        ModelError: if an index is out of range.
    """
    index = _within("action index", index, 0, N_ACTIONS)
    kind, target = np.divmod(index, N_TARGETS)
    return ActionArrays(kind, np.where(kind == Kind.DROP, -1, target))


@dataclass(frozen=True)
class State:
    """One state by its parts.

    Attributes:
        position: cell 0…17.
        orientation: cube orientation 0…47.
        gripper: gripper orientation 0…17, None if the cube is free.

    Raises:
        ModelError: if a component is out of range or a free cube is in the upper layer.
    """

    position: int
    orientation: int
    gripper: int | None = None

    def __post_init__(self) -> None:
        """Refuse what has no index."""
        _ = self.index

    @property
    def is_grasp(self) -> bool:
        """Whether the gripper holds the cube."""
        return self.gripper is not None

    @property
    def index(self) -> int:
        """The state's index, 0…15,983."""
        gripper = -1 if self.gripper is None else self.gripper
        return int(encode_states(self.position, self.orientation, gripper))

    @classmethod
    def from_index(cls, index: int) -> "State":
        """The state of an index.

        Raises:
            ModelError: if the index is not 0…15,983 (*lost* has no parts).
        """
        _within("state index", index, 0, N_STATES)
        position, orientation, gripper = (int(part) for part in decode_states(index))
        return cls(position, orientation, gripper if gripper >= 0 else None)


@dataclass(frozen=True)
class Action:
    """One action by its parts.

    Attributes:
        kind: what is done.
        target: gripper orientation (grasp, rotate) or cell (translate) 0…17, None for a drop.

    Raises:
        ModelError: if the target does not suit the kind.
    """

    kind: Kind
    target: int | None = None

    def __post_init__(self) -> None:
        """Refuse what has no index."""
        if (self.target is None) != (self.kind == Kind.DROP):
            raise ModelError(
                f"action {Kind(self.kind).name.lower()} has target {self.target}; "
                "wanted 0…17, and none for a drop"
            )
        _ = self.index

    @property
    def index(self) -> int:
        """The action's index, 0…54."""
        return int(encode_actions(self.kind, 0 if self.target is None else self.target))

    @classmethod
    def from_index(cls, index: int) -> "Action":
        """The action of an index.

        Raises:
            ModelError: if the index is not 0…54.
        """
        kind, target = (int(part) for part in decode_actions(index))
        return cls(Kind(kind), target if target >= 0 else None)

    def __str__(self) -> str:
        """Say the action in words, such as ``rotate to 0 (horizontal, front)``."""
        if self.target is None:
            return "drop"
        if self.kind == Kind.TRANSLATE:
            x, y, z = POSITIONS[self.target]
            return f"translate to ({x:g}, {y:g}, {z:g}) m"
        verb = "grasp with" if self.kind == Kind.GRASP else "rotate to"
        return f"{verb} {self.target} ({GRIPPER_NAMES[self.target]})"


def _within(name: str, value: ArrayLike, low: int, high: int) -> Indices:
    array = np.asarray(value)
    if not np.issubdtype(array.dtype, np.integer):
        raise ModelError(f"{name} must be an integer, is {array.dtype}; valid: {low}…{high - 1}")
    outside = (array < low) | (array >= high)
    if outside.any():
        raise ModelError(f"{name} {array[outside].flat[0]} is out of range {low}…{high - 1}")
    return array.astype(np.int64)
