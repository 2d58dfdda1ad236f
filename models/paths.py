"""Collision-free joint paths of straight segments, and their timing.

A path is a list of waypoints ``[n, 7]`` [rad]; between two of them the joints move in
proportion. Endless joints take the shorter way round, so each waypoint is wound towards the
one before.
"""

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
from pydrake.polynomial import Polynomial
from pydrake.trajectories import PiecewisePolynomial

from models.errors import ModelError
from models.kinematics import MARGIN, PlanningScene

LEVERS = np.array([1.07, 1.07, 0.65, 0.65, 0.33, 0.33, 0.09])
"""Farthest that a point of arm, open hand or held cube can be from each joint's axis [m]."""
RESOLUTION = 0.03
"""Bound on how far any point of the robot moves between two checks [m].

The bound adds all levers at full stretch; true motions are about a third of it. A step over
the edge of a body needs a chord that cuts it between two checks that both keep the margin.
"""
ACCELERATION_LIMIT = 3.0
"""Joint accelerations [rad/s²]: ours, for want of a figure from the vendor."""
SCALE = 0.8
"""Share of the limits that motions use."""
SHORTEST = 0.01
"""Duration of a segment that goes nowhere [s]; a trajectory needs one."""

# τ³(10 − 15 τ + 6 τ²): rest to rest, continuous in acceleration. Its largest slopes:
_QUINTIC = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
_PEAK_VELOCITY, _PEAK_ACCELERATION = 15.0 / 8.0, 10.0 / np.sqrt(3.0)


def segment_is_free(
    scene: PlanningScene, q_from: np.ndarray, q_to: np.ndarray, margin: float = MARGIN
) -> bool:
    """Whether the straight segment keeps ``margin`` [m] everywhere but at ``q_from``.

    The start is where the robot already is. Checks go from coarse to fine, since a segment
    that collides mostly does so for a good part of its length.

    Args:
        scene: what to keep clear of.
        q_from: ``[7]`` [rad].
        q_to: ``[7]`` [rad]; wound towards ``q_from`` first.
        margin: smallest allowed distance [m].
    """
    step = scene.wind(q_to, q_from) - q_from
    count = max(1, int(np.ceil(LEVERS @ np.abs(step) / RESOLUTION)))
    return all(scene.is_free(q_from + step * (i / count), margin) for i in coarse_to_fine(count))


def coarse_to_fine(count: int) -> list[int]:
    """1 … ``count`` in an order that halves the gaps between the numbers so far."""
    order: list[int] = []
    stride = 1
    while 2 * stride <= count:
        stride *= 2
    while stride:
        # Odd multiples of the stride are new; the even ones came before.
        order += range(stride, count + 1, 2 * stride)
        stride //= 2
    return order


def plan_path(
    scene: PlanningScene,
    q_from: np.ndarray,
    q_to: np.ndarray,
    vias: Iterable[Sequence[np.ndarray]] = (),
    margin: float = MARGIN,
) -> np.ndarray | None:
    """Find a free path of straight segments: the direct one, else the first through vias.

    Args:
        scene: what to keep clear of.
        q_from: ``[7]`` [rad].
        q_to: ``[7]`` [rad]; endless joints may end other turns away.
        vias: lists of configurations ``[7]`` [rad] to go through, tried in order.
        margin: smallest allowed distance [m].

    Returns:
        Waypoints ``[n, 7]`` [rad] from ``q_from`` to ``q_to``, None if no list serves.
    """
    for between in [(), *vias]:
        path = wind_path(scene, [q_from, *between, q_to])
        if all(segment_is_free(scene, a, b, margin) for a, b in pairwise(path)):
            return path
    return None


def wind_path(scene: PlanningScene, waypoints: Sequence[np.ndarray]) -> np.ndarray:
    """Waypoints ``[n, 7]`` [rad], each wound towards the one before."""
    path = [np.asarray(waypoints[0], dtype=float)]
    for q in waypoints[1:]:
        path.append(scene.wind(q, path[-1]))
    return np.array(path)


def timed(
    waypoints: np.ndarray,
    velocity_limit: np.ndarray,
    acceleration_limit: np.ndarray | float = ACCELERATION_LIMIT,
    scale: float = SCALE,
) -> PiecewisePolynomial:
    """Time a path; the motion rests at every waypoint and stays on the straight segments.

    Args:
        waypoints: ``[n, 7]`` [rad], n ≥ 2.
        velocity_limit: ``[7]`` [rad/s].
        acceleration_limit: ``[7]`` or one for all [rad/s²].
        scale: share of both limits to use, in (0, 1].

    Returns:
        Joint angles ``[7, 1]`` [rad] over time [s] from 0.

    Raises:
        ModelError: if a shape, limit or scale is wrong.
    """
    waypoints = np.asarray(waypoints, dtype=float)
    if waypoints.ndim != 2 or len(waypoints) < 2 or not np.isfinite(waypoints).all():
        raise ModelError(
            f"waypoints: shape {list(waypoints.shape)}; valid: [n, 7] finite angles with n ≥ 2"
        )
    if not 0.0 < scale <= 1.0:
        raise ModelError(f"scale: {scale}; valid: above 0, at most 1")
    limits = np.broadcast_arrays(velocity_limit, acceleration_limit, waypoints[0])[:2]
    if not all((limit > 0.0).all() for limit in limits):
        raise ModelError("velocity_limit, acceleration_limit: valid: above 0")
    velocity, acceleration = (scale * limit for limit in limits)

    breaks, segments = [0.0], []
    for start, step in zip(waypoints[:-1], np.diff(waypoints, axis=0), strict=True):
        duration = max(
            SHORTEST,
            np.max(_PEAK_VELOCITY * np.abs(step) / velocity),
            np.max(np.sqrt(_PEAK_ACCELERATION * np.abs(step) / acceleration)),
        )
        in_time = _QUINTIC / duration ** np.arange(6)
        coefficients = step[:, None] * in_time
        coefficients[:, 0] += start
        segments.append(np.array([[Polynomial(row)] for row in coefficients]))
        breaks.append(breaks[-1] + duration)
    return PiecewisePolynomial(segments, breaks)
