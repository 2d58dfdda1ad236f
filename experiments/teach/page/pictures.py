"""Small pictures of states: the nine columns of the table, the cube by its colours, the hand.

Drawn as vectors, in the direction in which the 3D view looks at first: a few hundred letters each,
so that a page can have dozens.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from diagrams.state_view import cube_pose
from models.task.spaces import CUBE_EDGE, GRID_X, GRID_Y, LOST, R_WG, TABLE_TOP, State
from models.task.words import describe_state

FACES = ("#d9261f", "#33a640", "#f7d126", "#f2801a", "#2961d1", "#8040a6")
"""Colours of the cube's faces +x, +y, +z, −x, −y, −z, as `models/description/cube.sdf` has them."""
LOOKS = np.array([-0.6, 0.6, -0.55])
"""Which way the pictures look."""
WIDTH, HEIGHT = 132, 96
_SCALE = 300.0  # points a metre
_CENTRE = np.array([0.55, 0.0, 0.555])
_AHEAD = LOOKS / np.linalg.norm(LOOKS)
_RIGHT = np.cross(_AHEAD, [0.0, 0.0, 1.0])
_RIGHT /= np.linalg.norm(_RIGHT)
_UP = np.cross(_RIGHT, _AHEAD)
_PALM, _REACH = 0.055, 0.010
"""Of the fingers: how far behind the cube's centre they begin, and beyond it end [m]."""

Array = NDArray[np.float64]


@lru_cache(maxsize=512)
def picture(state: int) -> str:
    """A state as an SVG element, with its words as the title.

    Raises:
        ModelError: if there is no such state.
    """
    said = describe_state(state)
    parts = [_table()]
    if state != LOST:
        X_WO = cube_pose(state)
        R, p = X_WO.rotation().matrix(), X_WO.translation()
        hand = State.from_index(state).gripper
        parts.append(_shadow(p))
        fingers = [] if hand is None else _fingers(p, R, R_WG[hand])
        parts += [drawn for depth, drawn in fingers if depth > 0]
        parts.append(_cube(R, p))
        parts += [drawn for depth, drawn in fingers if depth <= 0]
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{said}" '
        f'class="state-picture"><title>{said}</title>{"".join(parts)}</svg>'
    )


def _project(p_W: Array) -> Array:
    """Where points ``[..., 3]`` [m] are on the picture ``[..., 2]``."""
    d = (p_W - _CENTRE) * _SCALE
    return np.stack([WIDTH / 2 + d @ _RIGHT, HEIGHT / 2 - d @ _UP], axis=-1)


def _polygon(p_W: Array, style: str) -> str:
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in _project(p_W))
    return f'<polygon points="{points}" {style}/>'


def _line(a: Array, b: Array, style: str) -> str:
    (x1, y1), (x2, y2) = _project(np.array([a, b]))
    return f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" {style}/>'


@lru_cache(maxsize=1)
def _table() -> str:
    """The nine columns."""
    dx, dy = (GRID_X[1] - GRID_X[0]) / 2, (GRID_Y[1] - GRID_Y[0]) / 2
    tiles = [
        np.array([[x + a * dx, y + b * dy, TABLE_TOP] for a, b in _AROUND])
        for x in GRID_X
        for y in GRID_Y
    ]
    style = 'fill="#efe4cd" stroke="#c4b08a" stroke-width="0.8"'
    return "".join(_polygon(tile, style) for tile in tiles)


_AROUND = ((-1, -1), (1, -1), (1, 1), (-1, 1))


def _shadow(p: Array) -> str:
    """Where the cube is above the table, and a line up to it."""
    half = CUBE_EDGE / 2
    square = np.array([[p[0] + a * half, p[1] + b * half, TABLE_TOP] for a, b in _AROUND])
    foot = np.array([p[0], p[1], TABLE_TOP])
    return _polygon(square, 'fill="#00000026"') + _line(
        foot, p, 'stroke="#0006" stroke-width="0.8" stroke-dasharray="2 2"'
    )


def _cube(R: Array, p: Array) -> str:
    """The three faces that are seen."""
    drawn = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal = sign * R[:, axis]
            if normal @ _AHEAD < -1e-6:
                u, v = R[:, (axis + 1) % 3], R[:, (axis + 2) % 3]
                half = CUBE_EDGE / 2
                corners = np.array([p + half * (normal + a * u + b * v) for a, b in _AROUND])
                colour = FACES[axis + (3 if sign < 0 else 0)]
                style = f'fill="{colour}" stroke="#fffb" stroke-width="0.9" stroke-linejoin="round"'
                drawn.append(_polygon(corners, style))
    return "".join(drawn)


def _fingers(p: Array, R: Array, R_WG: Array) -> list[tuple[float, str]]:
    """Palm and fingers, each with whether it is behind the cube (above 0) or before it."""
    closing, approach = R_WG[:, 1], R_WG[:, 2]
    half = CUBE_EDGE / 2 * float(np.abs(R.T @ closing).sum()) + 0.004
    style = 'stroke="#333a44" stroke-width="4" stroke-linecap="round"'
    palm = p - _PALM * approach
    wrist = palm - 0.035 * approach
    drawn = [
        (
            -float(approach @ _AHEAD),
            _line(palm - half * closing, palm + half * closing, style)
            + _line(palm, wrist, style.replace('"4"', '"7"')),
        )
    ]
    for sign in (1.0, -1.0):
        side = sign * half * closing
        drawn.append(
            (
                sign * float(closing @ _AHEAD),
                _line(palm + side, p + side + _REACH * approach, style),
            )
        )
    return drawn
