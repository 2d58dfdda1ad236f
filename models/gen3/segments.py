"""Distances of segments, the axes of capsules, as compiled code."""

import numpy as np

from models.compiled import compiled
from models.gen3.chain import Array

_BISECTIONS = 24


@compiled(error_model="numpy")
def to_segment(a: Array, b: Array, c: Array, d: Array, limit: float) -> float:
    """Squared distance of segments ab and cd [m²]; larger, but above ``limit``², if far apart."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = d[0] - c[0], d[1] - c[1], d[2] - c[2]
    wx, wy, wz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    uu, vv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
    # Between the middles, against both halves and the limit.
    mx, my, mz = wx + 0.5 * (vx - ux), wy + 0.5 * (vy - uy), wz + 0.5 * (vz - uz)
    between = mx * mx + my * my + mz * mz
    reach = limit + 0.5 * (np.sqrt(uu) + np.sqrt(vv))
    if between > reach * reach:
        return np.inf
    uv = ux * vx + uy * vy + uz * vz
    uw, vw = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
    # The nearest points a + s·u and c + t·v: free minimum, then clamped one after the other.
    det = uu * vv - uv * uv
    s = min(max((uw * vv - uv * vw) / det, 0.0), 1.0) if det > 1e-12 * uu * vv else 0.0
    t = (s * uv - vw) / vv if vv > 0.0 else -1.0  # a ball's axis is a point
    if t < 0.0 or t > 1.0:
        t = min(max(t, 0.0), 1.0)
        s = min(max((t * uv + uw) / uu, 0.0), 1.0) if uu > 0.0 else 0.0
    x, y, z = wx + t * vx - s * ux, wy + t * vy - s * uy, wz + t * vz - s * uz
    return x * x + y * y + z * z


@compiled(error_model="numpy")
def to_box(
    a: Array, b: Array, centre: Array, turn: Array, extent: Array, limit: float, ends: Array
) -> float:
    """Squared distance of segment ab and a box [m²]; larger, but above ``limit``², if far apart.

    It is convex along the segment: bisection on the sign of its slope.

    Args:
        a: one end of the segment ``[3]`` [m].
        b: the other ``[3]`` [m].
        centre: of the box ``[3]`` [m].
        turn: its rotation ``[3, 3]``.
        extent: half its edges ``[3]`` [m].
        limit: larger distances need not be known [m].
        ends: where the segment's ends in the box's frame are written ``[2, 3]``.
    """
    for k in range(3):
        x = y = 0.0
        for j in range(3):
            x += turn[j, k] * (a[j] - centre[j])
            y += turn[j, k] * (b[j] - centre[j])
        if not (min(x, y) <= extent[k] + limit and max(x, y) >= -extent[k] - limit):
            return np.inf
        ends[0, k], ends[1, k] = x, y
    left, right = 0.0, 1.0
    squared = np.inf
    for _ in range(_BISECTIONS):
        t = 0.5 * (left + right)
        value, slope = 0.0, 0.0
        for k in range(3):
            x = ends[0, k] + t * (ends[1, k] - ends[0, k])
            outside = x - extent[k] if x > extent[k] else min(x + extent[k], 0.0)
            value += outside * outside
            slope += outside * (ends[1, k] - ends[0, k])
        squared = min(squared, value)
        if value == 0.0 or slope == 0.0:
            break
        if slope > 0.0:
            right = t
        else:
            left = t
    return squared
