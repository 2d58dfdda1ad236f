"""States, actions and clusters in a person's words, for pictures, messages and questions.

Ways are the robot's, as those of Table 5.4: *front* is away from its base (+x), *back* towards
it, *left* its left hand (+y). A recording is seen from in front of the robot, on its right: there
front is near and to the right of the picture, back far and to the left, the robot's left far and
to the right, and its right near and to the left.

* The cube by the colours of its faces (`models/description/cube.sdf`): the one that is up, and
  the one that looks to the front. Turned by 45° none does: then the one to the front left.
* The hand by its slope (level, tilted, from above) and the way its fingers point. From above it
  points no way: there the angle is how far it is turned clockwise, seen from above, from where
  its camera is in front.
* A place by its column of the grid and its layer.

Different states have different words, and so have actions. `models.task.tables` describes the
same by the numbers of Tables 4.1 and 4.2: those texts are part of task data and of result files.
"""

import numpy as np
from numpy.typing import NDArray

from models.errors import ModelError
from models.task.spaces import (
    GRID_X,
    GRID_Y,
    GRID_Z,
    LOST,
    N_GRIPPERS,
    N_ORIENTATIONS,
    N_POSITIONS,
    POSITIONS,
    R_WG,
    R_WO,
    Action,
    Kind,
    State,
)

FACES = ("red", "green", "yellow", "orange", "blue", "violet")
"""Colours of the cube's faces +x, +y, +z, −x, −y, −z."""
WAYS = ("front", "front left", "left", "back left", "back", "back right", "right", "front right")
"""Ways on the level, from +x by 45° anticlockwise as seen from above."""
CLUSTERS = {
    "not_grasped": "the cube is on the table",
    "grasped": "the hand holds the cube",
    "gripper_down": "held from above",
    "gripper_front": "held by a level hand that points to the front",
    "gripper_right": "held by a level hand that points to the right",
    "gripper_left": "held by a level hand that points to the left",
    "object_z_vertical": "yellow or violet face up",
    "object_x_vertical": "red or orange face up",
    "object_y_vertical": "green or blue face up",
    "object_z_0": "cube turned by 0° or 180° on the level",
    "object_z_45": "cube turned by 45° or 225° on the level",
    "object_z_90": "cube turned by 90° or 270° on the level",
    "object_z_135": "cube turned by 135° or 315° on the level",
    "back_limit": "back edge of the grid",
    "front_limit": "front edge of the grid",
    "right_limit": "right edge of the grid",
    "left_limit": "left edge of the grid",
    "under_limit": "lower layer",
    "upper_limit": "upper layer",
    "center": "centre of the grid",
}
"""Words for each cluster of `models.task.clusters`. On the level the cube turns anticlockwise as
seen from above, γ of Table 4.1."""


def describe_state(index: int) -> str:
    """Say a state, such as ``on the table, back; yellow face up, red to the front``.

    Args:
        index: state 0…15,984, the last of which is ``lost``.

    Raises:
        ModelError: if the index is out of range.
    """
    if index == LOST:
        return "lost"
    state = State.from_index(index)
    cube = describe_orientation(state.orientation)
    if state.gripper is None:
        return f"on the table, {_column(POSITIONS[state.position])}; {cube}"
    place, hand = describe_position(state.position), describe_gripper(state.gripper)
    return f"held, {place}; {hand}; {cube}"


def describe_action(index: int) -> str:
    """Say an action, such as ``turn: hand tilted, front right``, or ``drop``.

    Args:
        index: action 0…54.

    Raises:
        ModelError: if the index is out of range.
    """
    action = Action.from_index(index)
    if action.target is None:
        return "drop"
    if action.kind == Kind.TRANSLATE:
        return f"carry: {describe_position(action.target)}"
    verb = "grasp" if action.kind == Kind.GRASP else "turn"
    return f"{verb}: {describe_gripper(action.target)}"


def describe_orientation(orientation: int) -> str:
    """Say a cube orientation 0…47, such as ``red face up, blue to the front left``.

    Raises:
        ModelError: if it is out of range.
    """
    _require("orientation", orientation, N_ORIENTATIONS)
    normals = np.concatenate([R_WO[orientation].T, -R_WO[orientation].T])
    level = np.abs(normals[:, 2]) < 0.5
    for way in (0, 1):
        for face in np.flatnonzero(level):
            if _way(normals[face]) == way:
                return f"{FACES[normals[:, 2].argmax()]} face up, {FACES[face]} to the {WAYS[way]}"
    raise AssertionError(f"orientation {orientation} has no face to the front or front left")


def describe_gripper(gripper: int) -> str:
    """Say a gripper orientation 0…17, such as ``hand tilted, front right``.

    Raises:
        ModelError: if it is out of range.
    """
    _require("gripper", gripper, N_GRIPPERS)
    approach, camera = R_WG[gripper][:, 2], -R_WG[gripper][:, 0]
    if approach[2] < -0.9:
        return f"hand from above, turned {45 * (-_way(camera) % len(WAYS))}°"
    slope = "tilted" if approach[2] < -0.1 else "level"
    return f"hand {slope}, {WAYS[_way(approach)]}"


def describe_position(position: int) -> str:
    """Say a cell 0…17, such as ``back right, upper layer``.

    Raises:
        ModelError: if it is out of range.
    """
    _require("position", position, N_POSITIONS)
    p_W = POSITIONS[position]
    return f"{_column(p_W)}, {'lower' if p_W[2] == GRID_Z[0] else 'upper'} layer"


def describe_cluster(name: str) -> str:
    """Say what the states of a cluster have in common, such as ``yellow or violet face up``.

    Raises:
        ModelError: if there is no such cluster.
    """
    if name not in CLUSTERS:
        raise ModelError(f"there is no cluster {name!r}; valid: {', '.join(CLUSTERS)}")
    return CLUSTERS[name]


def _column(p_W: NDArray[np.float64]) -> str:
    x = ("back", "", "front")[int(np.argmin(np.abs(GRID_X - p_W[0])))]
    y = ("right", "", "left")[int(np.argmin(np.abs(GRID_Y - p_W[1])))]
    return f"{x} {y}".strip() or "centre"


def _way(v_W: NDArray[np.float64]) -> int:
    """Index in `WAYS` nearest to the level part of a vector."""
    return round(float(np.arctan2(v_W[1], v_W[0])) / (np.pi / 4)) % len(WAYS)


def _require(name: str, index: int, count: int) -> None:
    if not 0 <= index < count:
        raise ModelError(f"{name} {index} is out of range 0…{count - 1}")
