"""Timing of joint paths: as fast as velocity and acceleration limits allow (TOPP-RA).

The path is followed along its straight segments. Where a corner may be cut, it is rounded by a
Bézier curve of degree 5 inside the triangle that the cut spans, with continuous second
derivatives, and passed without a stop; at any other corner the motion rests.

Segments too short for TOPP-RA's numerics, and others on which it fails, go from rest to rest by a
cubic in time: up to half as long again, never beyond a limit.
"""

import logging
from collections.abc import Iterator
from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydrake.multibody.optimization import Toppra
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RevoluteJoint, SpatialInertia
from pydrake.trajectories import (
    BezierCurve,
    CompositeTrajectory,
    PathParameterizedTrajectory,
    PiecewisePolynomial,
    Trajectory,
)

from models.arrays import Array, finite_array, finite_number, finite_vector
from models.errors import ModelError
from models.scenes.limits import JointLimits, arm_limits

ACCELERATION_LIMIT = 3.0
"""Joint accelerations [rad/s²]: ours, below the vendor's 5.2 for joints 1 to 4 and 10.0 for 5 to 7
(Gen3 user guide: 297.94 and 572.95 °/s²), for the sake of what the hand holds."""
SCALE = 0.8
"""Share of the limits that motions use."""
SHORTEST = 0.01
"""Duration of a motion that goes nowhere [s]; a trajectory needs one."""

_CELLS = (16, 13, 8)  # grid cells a piece of path, in turn: TOPP-RA's numerics fail on a few
_SAMPLES = 16  # looks at the limits, a cell
_NO_CUT = 1e-5  # cuts below count as none [rad]
_SHORT = 2.0 * _NO_CUT  # segments that TOPP-RA is not asked about [rad]
_BRIEFEST = 1e-3  # time that a short segment takes at least [s]
_SLOWEST = 1e-12  # a rate below would take longer than a float's seconds tell [rad/s, rad/s²]
_SPAN = 0.01  # by how much a short segment advances the path's parameter, its length lost on it
# Control points of a rounded corner: shares of the cut, before it if negative. Two by two equal
# differences at the ends: no second derivative there, as on the straight segments.
_BEZIER = np.array([-1.0, -0.6, -0.2, 0.2, 0.6, 1.0])


class _Rates(NamedTuple):
    """Limits of the joints' velocities [rad/s] and accelerations [rad/s²], ``[n]`` each."""

    velocity: Array
    acceleration: Array


def time_path(
    waypoints: ArrayLike,
    velocity_limit: ArrayLike,
    acceleration_limit: ArrayLike = ACCELERATION_LIMIT,
    *,
    cuts: ArrayLike | None = None,
    scale: float = SCALE,
    limits: JointLimits | None = None,
) -> Trajectory:
    """Time a path from rest to rest.

    Args:
        waypoints: ``[m, n]`` [rad] for n joints, m ≥ 2; however near to one another.
        velocity_limit: ``[n]``, or one for all [rad/s].
        acceleration_limit: ``[n]``, or one for all [rad/s²].
        cuts: how far before and after each waypoint the motion may leave the segments, as
            length in joint space ``[m]`` [rad], at most half of either segment; the first and
            the last do not count. None rests at every waypoint.
        scale: share of both limits to use, in (0, 1].
        limits: where the joints may be; None takes the Gen3's for 7 joints, the Gen3 Lite's for
            6, and none for any other arm. A path that starts beyond may come back.

    Returns:
        Joint angles ``[n, 1]`` [rad] over time [s] from 0.

    Raises:
        ModelError: if a shape, cut, limit or scale is wrong, or a waypoint beyond a joint limit.
    """
    path, corners = _checked_path(waypoints, cuts, limits)
    if not 0.0 < finite_number(scale, "scale", valid="above 0, at most 1") <= 1.0:
        raise ModelError(f"scale: {scale}; valid: above 0, at most 1")
    rates = _Rates(
        scale * _rate(velocity_limit, "velocity_limit", path.shape[1]),
        scale * _rate(acceleration_limit, "acceleration_limit", path.shape[1]),
    )

    moves = np.append(np.abs(np.diff(path, axis=0)).max(axis=1) > 0.0, True)
    path, corners = path[moves], corners[moves]
    if len(path) < 2:
        return PiecewisePolynomial.ZeroOrderHold([0.0, SHORTEST], np.tile(path.T, 2))
    lengths = np.linalg.norm(np.diff(path, axis=0), axis=1)
    corners = _usable(corners, lengths)
    pieces: list[BezierCurve] = []
    progress = None
    for first, last in pairwise(np.flatnonzero(corners == 0.0).tolist()):
        now = pieces[-1].end_time() if pieces else 0.0
        run = slice(first, last + 1)
        for added, part in _timed(path[run], corners[run], lengths[first:last], now, rates):
            pieces += added
            if progress is None:
                progress = part
            else:
                part.shiftRight(progress.end_time() - part.start_time())
                progress.ConcatenateInTime(part)
    return PathParameterizedTrajectory(CompositeTrajectory(pieces), progress)


def _checked_path(
    waypoints: ArrayLike, cuts: ArrayLike | None, limits: JointLimits | None
) -> tuple[Array, Array]:
    waypoints = finite_array(waypoints, (), "waypoints")
    if waypoints.ndim != 2 or len(waypoints) < 2 or not waypoints.shape[1]:
        raise ModelError(
            f"waypoints: shape {list(waypoints.shape)}; valid: [m, n] angles with m ≥ 2"
        )
    limits = limits or arm_limits(waypoints.shape[1])
    if limits is not None:
        limits.require_path(waypoints)
    if cuts is None:
        return waypoints, np.zeros(len(waypoints))
    cuts = finite_array(cuts, (), "cuts")
    if cuts.shape != waypoints.shape[:1] or not (cuts >= 0.0).all():
        raise ModelError(f"cuts: shape {list(cuts.shape)}; valid: one ≥ 0 for each waypoint")
    return waypoints, cuts


def _rate(limit: ArrayLike, name: str, n_joints: int) -> Array:
    limit = finite_array(limit, (), name)
    rate = finite_vector(np.full(n_joints, limit) if limit.ndim == 0 else limit, n_joints, name)
    if not (rate >= _SLOWEST).all():
        raise ModelError(f"{name}: {rate.min():g}; valid: above 0, {_SLOWEST:g} or more")
    return rate


def _usable(cuts: Array, lengths: Array) -> Array:
    """Cuts ``[m]`` that a corner is rounded by: 0 at the ends, beside short segments, if tiny."""
    cuts = np.where(cuts > _NO_CUT, cuts, 0.0)
    cuts[[0, -1]] = 0.0
    if (cuts[:-1] + cuts[1:] > lengths * (1.0 + 1e-9)).any():
        raise ModelError("cuts: two overlap; valid: at most half of either segment")
    short = np.append(lengths < _SHORT, False)
    cuts[short | np.roll(short, 1)] = 0.0
    return cuts


def _timed(
    waypoints: Array, cuts: Array, lengths: Array, now: float, rates: _Rates
) -> Iterator[tuple[list[BezierCurve], PiecewisePolynomial]]:
    """Pieces of path from ``now`` on, and their parameter over time, from one rest to the next.

    Where TOPP-RA fails on rounded corners the motion rests at each.
    """
    if lengths.min() >= _SHORT:
        pieces = _round_corners(waypoints, cuts, lengths, now)
        progress = _fastest(pieces, rates)
        if progress is not None:
            yield pieces, progress
            return
    for ends in pairwise(waypoints):
        piece = BezierCurve(now, now + _SPAN, np.array(ends).T)
        now += _SPAN
        yield [piece], _cubic(piece, np.abs(ends[1] - ends[0]), rates)


def _round_corners(waypoints: Array, cuts: Array, lengths: Array, now: float) -> list[BezierCurve]:
    """The path over its length, from ``now`` on."""
    directions = np.diff(waypoints, axis=0) / lengths[:, None]
    pieces: list[BezierCurve] = []

    def add(length: float, points: Array) -> None:
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
    return pieces


def _cubic(piece: BezierCurve, step: Array, rates: _Rates) -> PiecewisePolynomial:
    """The parameter of a straight piece over time, from rest to rest, by a cubic.

    Over a time T a cubic that advances by d is at most 1.5 d / T fast, and accelerates by at
    most 6 d / T².
    """
    seconds = max(
        _BRIEFEST,
        1.5 * float((step / rates.velocity).max()),
        float(np.sqrt((6.0 * step / rates.acceleration).max())),
    )
    ends = np.array([[piece.start_time(), piece.end_time()]])
    return PiecewisePolynomial.CubicHermite([0.0, seconds], ends, np.zeros((1, 2)))


def _fastest(pieces: list[BezierCurve], rates: _Rates) -> PiecewisePolynomial | None:
    """Path length over time along pieces that join smoothly; None if TOPP-RA fails."""
    path = CompositeTrajectory(pieces)
    for cells in _CELLS:
        grids = [np.linspace(piece.start_time(), piece.end_time(), cells + 1) for piece in pieces]
        toppra = Toppra(path, _any_arm(path.rows()), np.unique(np.concatenate(grids)))
        toppra.AddJointVelocityLimit(-rates.velocity, rates.velocity)
        toppra.AddJointAccelerationLimit(-rates.acceleration, rates.acceleration)
        progress = _solved(toppra)
        if progress is not None:
            break
    else:
        return None
    # The limits hold on the grid; between its points a corner may exceed them by a little.
    motion = PathParameterizedTrajectory(path, progress)
    breaks = np.array(progress.get_segment_times())
    shares = np.arange(_SAMPLES) / (_SAMPLES - 1)
    times = (breaks[:-1, None] + shares * np.diff(breaks)[:, None]).ravel()
    excess = [
        np.abs(motion.MakeDerivative(order).vector_values(times)) / limit[:, None]
        for order, limit in enumerate(rates, start=1)
    ]
    progress.ScaleTime(max(1.0, excess[0].max(), np.sqrt(excess[1].max())))
    return progress


def _solved(toppra: Toppra) -> PiecewisePolynomial | None:
    """TOPP-RA's answer; None where it fails, which is handled here and needs no word of Drake's."""
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        return toppra.SolvePathParameterization()
    except SystemExit as error:
        # An assertion on breaks in time that are one, as where limits differ by many powers of ten.
        if not str(error).startswith("Failure at "):
            raise
        return None
    finally:
        logger.setLevel(level)


@cache
def _any_arm(n_joints: int) -> MultibodyPlant:
    """What TOPP-RA asks for; joint limits alone make no use of it but its size."""
    plant = MultibodyPlant(time_step=0.0)
    for i in range(n_joints):
        body = plant.AddRigidBody(f"link_{i}", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        frames = plant.world_frame(), body.body_frame()
        plant.AddJoint(RevoluteJoint(f"joint_{i}", *frames, [0.0, 0.0, 1.0]))
    plant.Finalize()
    return plant
