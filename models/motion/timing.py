"""Timing of joint paths: as fast as velocity and acceleration limits allow (TOPP-RA).

The path is followed along its straight segments. Where a corner may be cut, it is rounded by a
Bézier curve of degree 5 inside the triangle that the cut spans, with continuous second
derivatives, and passed without a stop; at any other corner the motion rests.
"""

from functools import cache
from itertools import pairwise

import numpy as np
from pydrake.multibody.optimization import Toppra
from pydrake.multibody.plant import MultibodyPlant
from pydrake.trajectories import (
    BezierCurve,
    CompositeTrajectory,
    PathParameterizedTrajectory,
    PiecewisePolynomial,
    Trajectory,
)

from models.errors import ModelError
from models.scenes.parsing import add_models

ACCELERATION_LIMIT = 3.0
"""Joint accelerations [rad/s²]: ours, for want of a figure from the vendor."""
SCALE = 0.8
"""Share of the limits that motions use."""
SHORTEST = 0.01
"""Duration of a motion that goes nowhere [s]; a trajectory needs one."""

_CELLS = (16, 13, 8)  # grid cells a piece of path, in turn: TOPP-RA's numerics fail on a few
_SAMPLES = 16  # looks at the limits, a cell
_NO_CUT = 1e-5  # cuts below count as none [rad]
# Control points of a rounded corner: shares of the cut, before it if negative. Two by two equal
# differences at the ends: no second derivative there, as on the straight segments.
_BEZIER = np.array([-1.0, -0.6, -0.2, 0.2, 0.6, 1.0])


def time_path(
    waypoints: np.ndarray,
    velocity_limit: np.ndarray,
    acceleration_limit: np.ndarray | float = ACCELERATION_LIMIT,
    *,
    cuts: np.ndarray | None = None,
    scale: float = SCALE,
) -> Trajectory:
    """Time a path from rest to rest.

    Args:
        waypoints: ``[n, 7]`` [rad], n ≥ 2.
        velocity_limit: ``[7]`` [rad/s].
        acceleration_limit: ``[7]`` or one for all [rad/s²].
        cuts: how far before and after each waypoint the motion may leave the segments, as
            length in joint space ``[n]`` [rad], at most half of either segment; the first and
            the last do not count. None rests at every waypoint.
        scale: share of both limits to use, in (0, 1].

    Returns:
        Joint angles ``[7, 1]`` [rad] over time [s] from 0.

    Raises:
        ModelError: if a shape, cut, limit or scale is wrong.
    """
    waypoints = np.asarray(waypoints, dtype=float)
    if waypoints.ndim != 2 or len(waypoints) < 2 or not np.isfinite(waypoints).all():
        raise ModelError(
            f"waypoints: shape {list(waypoints.shape)}; valid: [n, 7] finite angles with n ≥ 2"
        )
    cuts = np.zeros(len(waypoints)) if cuts is None else np.asarray(cuts, dtype=float)
    if cuts.shape != waypoints.shape[:1] or not (cuts >= 0.0).all():
        raise ModelError(f"cuts: shape {list(cuts.shape)}; valid: one ≥ 0 for each waypoint")
    if not 0.0 < scale <= 1.0:
        raise ModelError(f"scale: {scale}; valid: above 0, at most 1")
    limits = np.broadcast_arrays(velocity_limit, acceleration_limit, waypoints[0])[:2]
    if not all((limit > 0.0).all() for limit in limits):
        raise ModelError("velocity_limit, acceleration_limit: valid: above 0")
    velocity, acceleration = (scale * limit for limit in limits)

    moves = np.append(np.abs(np.diff(waypoints, axis=0)).max(axis=1) > 0.0, True)
    waypoints, cuts = waypoints[moves], cuts[moves]
    if len(waypoints) < 2:
        return PiecewisePolynomial.ZeroOrderHold([0.0, SHORTEST], np.tile(waypoints.T, 2))
    pieces, rests = _round_corners(waypoints, cuts)
    progress = None
    for first, last in pairwise(rests):
        part = _fastest(pieces[first:last], velocity, acceleration)
        if progress is None:
            progress = part
        else:
            part.shiftRight(progress.end_time() - part.start_time())
            progress.ConcatenateInTime(part)
    return PathParameterizedTrajectory(CompositeTrajectory(pieces), progress)


def _round_corners(waypoints: np.ndarray, cuts: np.ndarray) -> tuple[list[BezierCurve], list[int]]:
    """The path over its length, and the numbers of pieces before which the motion rests."""
    steps = np.diff(waypoints, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    directions = steps / lengths[:, None]
    cuts = np.where(cuts > _NO_CUT, cuts, 0.0)
    cuts[[0, -1]] = 0.0
    if (cuts[:-1] + cuts[1:] > lengths * (1.0 + 1e-9)).any():
        raise ModelError("cuts: two overlap; valid: at most half of either segment")
    pieces: list[BezierCurve] = []
    rests, now = [0], 0.0

    def add(length: float, points: np.ndarray) -> None:
        nonlocal now
        pieces.append(BezierCurve(now, now + length, points.T))
        now += length

    for i, (length, u) in enumerate(zip(lengths, directions, strict=True)):
        straight = length - cuts[i] - cuts[i + 1]
        if straight > 1e-9:
            ends = waypoints[i] + cuts[i] * u, waypoints[i + 1] - cuts[i + 1] * u
            add(straight, np.array(ends))
        if cuts[i + 1] > 0.0:
            along = np.where((_BEZIER < 0.0)[:, None], u, directions[i + 1])
            points = waypoints[i + 1] + cuts[i + 1] * _BEZIER[:, None] * along
            add(2.0 * cuts[i + 1], points)
        else:
            rests.append(len(pieces))
    return pieces, rests


def _fastest(
    pieces: list[BezierCurve], velocity: np.ndarray, acceleration: np.ndarray
) -> PiecewisePolynomial:
    """Path length over time, from rest to rest, along pieces that join smoothly."""
    path = CompositeTrajectory(pieces)
    for cells in _CELLS:
        grids = [np.linspace(piece.start_time(), piece.end_time(), cells + 1) for piece in pieces]
        toppra = Toppra(path, _arm_plant(), np.unique(np.concatenate(grids)))
        toppra.AddJointVelocityLimit(-velocity, velocity)
        toppra.AddJointAccelerationLimit(-acceleration, acceleration)
        progress = toppra.SolvePathParameterization()
        if progress is not None:
            break
    else:
        raise ModelError("waypoints: TOPP-RA found no timing within the limits")
    # The limits hold on the grid; between its points a corner may exceed them by a little.
    motion = PathParameterizedTrajectory(path, progress)
    breaks = np.array(progress.get_segment_times())
    shares = np.arange(_SAMPLES) / (_SAMPLES - 1)
    times = (breaks[:-1, None] + shares * np.diff(breaks)[:, None]).ravel()
    excess = [
        np.abs(motion.MakeDerivative(order).vector_values(times)) / limit[:, None]
        for order, limit in ((1, velocity), (2, acceleration))
    ]
    progress.ScaleTime(max(1.0, excess[0].max(), np.sqrt(excess[1].max())))
    return progress


@cache
def _arm_plant() -> MultibodyPlant:
    """What TOPP-RA asks for; joint limits alone make no use of it but its size."""
    plant = MultibodyPlant(time_step=0.0)
    add_models(plant, "gen3.urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base_link"))
    plant.Finalize()
    return plant
