"""From measured poses to the index of a state (thesis 5.8.1).

Cube and gripper orientations go to the nearest of their table by geodesic angle. A held cube is
in the cell nearest to the tool centre point. A free cube is in the column nearest to its own
centre, and *lost* outside the grid or below the table top.

Limits of the grid: half a cell beyond the outer centres, x in [0.475, 0.625] m and y in
[−0.15, 0.15] m, the limits included. There is none for a held cube: it is in the hand, and the
distance to its cell shows a gripper between cells.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.errors import ModelError
from models.rotations import geodesic_angle, require_rotation
from models.task.spaces import (
    GRID_X,
    GRID_Y,
    GRID_Z,
    LOST,
    R_WG,
    R_WO,
    REST_HEIGHT,
    TABLE_TOP,
    Array,
    Indices,
    encode_states,
)

X_LIMITS = (GRID_X[0] - 0.025, GRID_X[-1] + 0.025)
Y_LIMITS = (GRID_Y[0] - 0.05, GRID_Y[-1] + 0.05)
"""Where a free cube's centre is on the grid, metres."""


TABLE_X, TABLE_Y = (0.35, 0.75), (-0.2, 0.2)
"""Where a cube's centre is on the table, metres; beyond, it falls."""
LYING = 0.01
"""Largest height of a cube's centre above or below that of one at rest that counts as lying [m]."""


class Identification(NamedTuple):
    """What was identified, and how far the measured poses are from it; arrays of one shape.

    Attributes:
        state: state index, `LOST` if the cube is free and off the grid or the table.
        orientation_angle: from the table's cube orientation to the measured one, radians.
        gripper_angle: the same of the gripper; NaN for a free cube.
        distance: metres, from the cell's centre to the tool centre point; for a free cube,
            horizontally from the column's centre to the cube's.
    """

    state: Indices
    orientation_angle: Array
    gripper_angle: Array
    distance: Array


def identify(
    R_WO: ArrayLike,
    p_WO: ArrayLike,
    R_WG: ArrayLike,
    p_WG: ArrayLike,
    held: ArrayLike,
) -> Identification:
    """State of the environment from measured poses; leading dimensions broadcast.

    Args:
        R_WO: cube orientation ``[..., 3, 3]``.
        p_WO: cube centre ``[..., 3]`` in metres.
        R_WG: gripper orientation ``[..., 3, 3]``.
        p_WG: tool centre point ``[..., 3]`` in metres.
        held: whether the gripper holds the cube ``[...]``.

    Raises:
        ModelError: if a shape is another, a matrix is not a rotation, or a value is not finite.
    """
    held = np.asarray(held, dtype=bool)
    p_WO, p_WG = _points("p_WO", p_WO), _points("p_WG", p_WG)
    orientation, orientation_angle = nearest_orientation(R_WO)
    gripper, gripper_angle = nearest_gripper(R_WG)

    p_W = np.where(held[..., None], p_WG, p_WO)
    ix, iy, iz = (
        _nearest(grid, p_W[..., axis]) for axis, grid in enumerate((GRID_X, GRID_Y, GRID_Z))
    )
    iz = np.where(held, iz, 0)
    offset = p_W - np.stack([GRID_X[ix], GRID_Y[iy], GRID_Z[iz]], axis=-1)
    distance = np.where(
        held, np.linalg.norm(offset, axis=-1), np.linalg.norm(offset[..., :2], axis=-1)
    )

    state = encode_states((ix * 3 + iy) * 2 + iz, orientation, np.where(held, gripper, -1))
    state = np.where(~held & off_table(p_WO), LOST, state)
    gripper_angle = np.where(held, gripper_angle, np.nan)
    return Identification(*np.broadcast_arrays(state, orientation_angle, gripper_angle, distance))


def nearest_column(p_WO: ArrayLike) -> Indices:
    """Lower cell of the nearest column to a cube that lies on the table, on the grid or beside it.

    Args:
        p_WO: cube centre ``[..., 3]`` in metres.

    Returns:
        Position ``[...]``; −1 for a cube that does not lie on the table.

    Raises:
        ModelError: if the shape is another or a value is not finite.
    """
    x, y, z = np.moveaxis(_points("p_WO", p_WO), -1, 0)
    there = (
        (np.clip(x, *TABLE_X) == x)
        & (np.clip(y, *TABLE_Y) == y)
        & (np.abs(z - REST_HEIGHT) <= LYING)
    )
    return np.where(there, (_nearest(GRID_X, x) * 3 + _nearest(GRID_Y, y)) * 2, -1)


def off_table(p_WO: ArrayLike) -> NDArray[np.bool_]:
    """Whether a free cube centred at ``p_WO [..., 3]`` is lost: off the grid, or fallen.

    A cube on the table has its centre at least half an edge above `TABLE_TOP`.

    Raises:
        ModelError: if the shape is another or a value is not finite.
    """
    x, y, z = np.moveaxis(_points("p_WO", p_WO), -1, 0)
    return (
        (x < X_LIMITS[0])
        | (x > X_LIMITS[1])
        | (y < Y_LIMITS[0])
        | (y > Y_LIMITS[1])
        | (z < TABLE_TOP)
    )


def nearest_orientation(R: ArrayLike) -> tuple[Indices, Array]:
    """Nearest of the 48 cube orientations to ``R [..., 3, 3]``, and the angle to it in radians.

    Raises:
        ModelError: if a matrix is not a rotation.
    """
    return _nearest_rotation(require_rotation(R, "R_WO"), R_WO)


def name_margin(R: ArrayLike, p_WO: ArrayLike) -> tuple[Array, Array]:
    """How far a free cube is from where it would be called by another state.

    Args:
        R: cube orientation ``[..., 3, 3]``.
        p_WO: cube centre ``[..., 3]`` in metres.

    Returns:
        Horizontally, to the nearest edge of its column's cell, in metres, below 0 off the grid; and
        the least angle by which another orientation of the table can become the nearest, in
        radians ``[...]``.

    Raises:
        ModelError: if a shape is another, a matrix is not a rotation, or a value is not finite.
    """
    x, y, _ = np.moveaxis(_points("p_WO", p_WO), -1, 0)
    edges = [
        np.abs(grid[_nearest(grid, value)] - value) - (grid[1] - grid[0]) / 2
        for grid, value in ((GRID_X, x), (GRID_Y, y))
    ]
    angles = geodesic_angle(require_rotation(R, "R_WO")[..., None, :, :], R_WO)
    nearest = np.partition(angles, 1, axis=-1)
    return -np.maximum(*edges), (nearest[..., 1] - nearest[..., 0]) / 2


def nearest_gripper(R: ArrayLike) -> tuple[Indices, Array]:
    """Nearest of the 18 gripper orientations to ``R [..., 3, 3]``, and the angle to it in radians.

    Raises:
        ModelError: if a matrix is not a rotation.
    """
    return _nearest_rotation(require_rotation(R, "R_WG"), R_WG)


def all_nearest_orientations(R: ArrayLike, tolerance: float) -> NDArray[np.bool_]:
    """Which of the 48 cube orientations are as near as the nearest one, within a tolerance.

    Args:
        R: cube orientations ``[..., 3, 3]``.
        tolerance: radians.

    Returns:
        bool ``[..., 48]``, at least one true.

    Raises:
        ModelError: if a matrix is not a rotation.
    """
    angle = geodesic_angle(require_rotation(R, "R_WO")[..., None, :, :], R_WO)
    return angle <= angle.min(axis=-1, keepdims=True) + tolerance


def _nearest_rotation(R: Array, table: Array) -> tuple[Indices, Array]:
    # The trace falls as the angle grows, and is one matrix product for the whole table.
    flat = table.reshape(len(table), 9)
    index = np.argmax(R.reshape(*R.shape[:-2], 9) @ flat.T, axis=-1)
    return index, geodesic_angle(table[index], R)


def _nearest(grid: Array, value: Array) -> Indices:
    return np.argmin(np.abs(value[..., None] - grid), axis=-1)


def _points(name: str, value: ArrayLike) -> Array:
    p = np.asarray(value, dtype=np.float64)
    if p.ndim == 0 or p.shape[-1] != 3:
        raise ModelError(f"{name} has shape {list(p.shape)}; wanted [..., 3]")
    if not np.isfinite(p).all():
        raise ModelError(f"{name} holds a value that is not finite; wanted metres")
    return p
