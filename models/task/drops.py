"""Where a cube that is let go comes to rest.

It turns about its lowest corner onto the nearest face, or onto one of two that are nearly as near.
From the upper layer, 8 cm above the table, it mostly tumbles on, over an edge of that face.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from models.rotations import rotation_vector_to_matrix, rotation_y, rotation_z
from models.task.spaces import CUBE_EDGE, REST_HEIGHT, Array, Indices

TOSS_UP = np.radians(6.0)
"""Two faces that are nearer to one another than this to being down may both come down [rad]."""
TUMBLES = 0.7
"""Share of the cubes let go in the upper layer that tumble on, by trials (RESULTS.md)."""
_CORNERS = (
    0.5 * CUBE_EDGE * np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3, indexing="ij"), -1).reshape(-1, 3)
)
_UP = np.array([0.0, 0.0, 1.0])
_QUARTERS = 0.5 * np.pi * np.arange(4)


class Rests(NamedTuple):
    """Where cubes may come to rest; arrays with one row an outcome.

    Attributes:
        origin: which cube it is, ascending ``[m]``.
        probability: those of a cube sum to 1 ``[m]``.
        R_WO: its orientation then ``[m, 3, 3]``.
        p_WO: its centre ``[m, 3]`` [m].
    """

    origin: Indices
    probability: Array
    R_WO: Array
    p_WO: Array


def rests(R_WO: Array, p_WO: Array, far: NDArray[np.bool_]) -> Rests:
    """Where cubes come to rest that are let go.

    Args:
        R_WO: their orientations ``[n, 3, 3]``.
        p_WO: their centres ``[n, 3]`` [m].
        far: whether they fall from the upper layer ``[n]``.
    """
    landed = _landed(R_WO, p_WO)
    return _tumbled(landed, far[landed.origin])


def _landed(R: Array, p: Array) -> Rests:
    """On the nearest face, or on the next one if that is nearly as near."""
    up = R[:, 2]  # the vertical in the cube's frame
    order = np.argsort(-np.abs(up), axis=-1, kind="stable")
    tilts = np.arccos(np.clip(np.take_along_axis(np.abs(up), order, -1)[:, :2], 0.0, 1.0))
    lead = tilts[:, 1] - tilts[:, 0]
    chance = 0.5 + 0.5 * np.minimum(lead / TOSS_UP, 1.0)
    tossed = lead < TOSS_UP
    origin = np.repeat(np.arange(len(up)), 1 + tossed)
    second = np.r_[False, origin[1:] == origin[:-1]]
    normal = np.zeros((origin.size, 3))
    face = order[origin, second.astype(int)]
    rows = np.arange(origin.size)
    normal[rows, face] = np.where(up[origin, face] < 0.0, -1.0, 1.0)

    R, p = R[origin], p[origin]
    turn = _shortest_turn(np.einsum("nij,nj->ni", R, normal), _UP)
    corners = _CORNERS @ np.swapaxes(R, -1, -2)
    lowest = corners[..., 2] < corners[..., 2].min(axis=-1, keepdims=True) + 1e-3
    foot = (corners * lowest[..., None]).sum(axis=1) / lowest.sum(axis=1)[:, None]
    p = p + foot - np.einsum("nij,nj->ni", turn, foot)
    p[:, 2] = REST_HEIGHT
    return Rests(origin, np.where(second, 1.0 - chance[origin], chance[origin]), turn @ R, p)


def _tumbled(landed: Rests, far: NDArray[np.bool_]) -> Rests:
    """Some of them over each edge of the face that they landed on."""
    if not far.any():
        return landed
    origin, probability, R, p = (
        landed.origin[far],
        landed.probability[far],
        landed.R_WO[far],
        landed.p_WO[far],
    )
    # Of an axis of the cube that is level; the others of the face are quarter turns away.
    level = np.abs(R[:, 2]).argmin(axis=-1)
    x, y = R[np.arange(len(R)), :2, level].T
    stays = np.where(far, 1.0 - TUMBLES, 1.0) * landed.probability
    parts = [landed._replace(probability=stays)]
    for quarter in _QUARTERS:
        to = rotation_z(np.arctan2(y, x) + quarter)  # its x is where the cube goes
        over = to @ rotation_y(0.5 * np.pi) @ np.swapaxes(to, -1, -2)
        share = TUMBLES / _QUARTERS.size * probability
        parts.append(Rests(origin, share, over @ R, p + CUBE_EDGE * to[..., 0]))
    order = np.argsort(np.concatenate([part.origin for part in parts]), kind="stable")
    return Rests(
        np.concatenate([part.origin for part in parts])[order],
        np.concatenate([part.probability for part in parts])[order],
        np.concatenate([part.R_WO for part in parts])[order],
        np.concatenate([part.p_WO for part in parts])[order],
    )


def _shortest_turn(v: Array, onto: Array) -> Array:
    """Rotations ``[n, 3, 3]`` that turn unit vectors ``v [n, 3]`` onto one other."""
    axis = np.cross(v, onto)
    sine = np.linalg.norm(axis, axis=-1)
    angle = np.arctan2(sine, v @ onto)
    return rotation_vector_to_matrix((angle / np.maximum(sine, 1e-12))[:, None] * axis)
