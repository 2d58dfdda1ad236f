"""A robot's motion as joint trajectories that others play: CSV, ROS, the arm's pre-computed form.

A program is what an arm does one after another: moves, and grips while it stands. It is timed anew
for a limit of speed, since the arm's own is lower than the joints' (below).

The Gen3 plays a pre-computed trajectory whole or refuses it whole. By the vendor's documents and
answers in public threads (issues of ros_kortex, after matlab_kortex) it wants time 0 first
and a point every millisecond; the first point where the arm is; angles in degrees; no joint
faster than 50 °/s; and positions, speeds and accelerations within its limits. Whether newer
firmware allows the joints' own 80 and 70 °/s is not known: the limit is a parameter, and the file
names it.
`precomputed` checks a file by the same rules.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from models.arrays import Array, finite_number, finite_vector
from models.errors import ModelError
from models.motion.moves import Grip, Move
from models.motion.timing import ACCELERATION_LIMIT, SCALE, time_path
from models.scenes.gripper import MAX_OPENING

JOINT_NAMES = tuple(f"joint_{number}" for number in range(1, 8))
"""The vendor's, in ROS as in `models/description`."""
STEP = 1e-3
"""Between two points of a pre-computed trajectory [s]."""
COARSE = 10
"""Of so many of these points one is in the CSV and ROS files: they are interpolated."""
SPEED_LIMIT = 50.0
"""Of every joint in a pre-computed trajectory [deg/s]."""
JOINT_SPEEDS = np.array([79.64, 79.64, 79.64, 79.64, 69.91, 69.91, 69.91])
"""Of the joints themselves [deg/s]: Gen3 user guide."""

_BELOW = 0.99  # of the limit that a motion is timed for: what is between TOPP-RA's looks


@dataclass(frozen=True)
class Motion:
    """A program, sampled every `STEP`.

    Attributes:
        q: joint angles ``[n, 7]`` [rad].
        velocity: ``[n, 7]`` [rad/s].
        acceleration: ``[n, 7]`` [rad/s²].
        opening: commanded distance of the pads ``[n]`` [m].
        grips: when another opening is commanded, and which: (s, m).
        speed_limit: that it was timed for [deg/s].
    """

    q: Array
    velocity: Array
    acceleration: Array
    opening: Array
    grips: tuple[tuple[float, float], ...]
    speed_limit: float

    @property
    def time(self) -> Array:
        """Since the start ``[n]`` [s]."""
        return np.arange(len(self.q), dtype=np.float64) * STEP


def time_program(
    start: ArrayLike,
    opening: float,
    program: Sequence[Move | Grip],
    speed_limit: float = SPEED_LIMIT,
) -> Motion:
    """Time a program anew, from rest to rest.

    Args:
        start: joint angles ``[7]`` [rad] where the arm stands.
        opening: commanded distance of the pads before [m].
        program: moves, each from where the one before ends, and grips; one to the opening that is
            commanded already is a pause.
        speed_limit: of every joint [deg/s]; those that are slower themselves keep their own.

    Raises:
        ModelError: if a number is none, or a move does not begin where the arm is, or is no path.
    """
    q = finite_vector(start, len(JOINT_NAMES), "start")
    opening = finite_number(opening, "opening", valid="metres")
    if finite_number(speed_limit, "speed_limit", valid="deg/s above 0") <= 0.0:
        raise ModelError(f"speed_limit: {speed_limit}; valid: deg/s above 0")
    rates = _BELOW * np.radians(np.minimum(JOINT_SPEEDS, speed_limit))
    parts: list[tuple[float, Callable[[Array], Array], float]] = []
    grips = []
    now = 0.0
    for number, part in enumerate(program):
        if isinstance(part, Move):
            if np.abs(part.waypoints[0] - q).max() > 1e-6:
                raise ModelError(f"program[{number}]: begins elsewhere than the part before ends")
            path = time_path(
                part.waypoints,
                rates,
                SCALE * ACCELERATION_LIMIT,
                cuts=part.cuts,
                scale=1.0,
            )
            q, seconds = part.waypoints[-1], path.end_time()
            parts.append((now, path.vector_values, opening))
        else:
            if part.width != opening:
                grips.append((now, part.width))
            seconds, opening = part.seconds, part.width
            parts.append((now, _standing(q), opening))
        now += seconds
    parts.append((now, _standing(q), opening))
    return _sampled(parts, tuple(grips), speed_limit)


def _standing(q: Array) -> Callable[[Array], Array]:
    return lambda times: np.tile(q[:, None], len(times))


def _sampled(
    parts: list[tuple[float, Callable[[Array], Array], float]],
    grips: tuple[tuple[float, float], ...],
    speed_limit: float,
) -> Motion:
    """Values of parts, each from its time on, the last at its own; rates by differences of them."""
    end = parts[-1][0]
    times = STEP * np.arange(int(np.ceil(end / STEP - 1e-9)) + 1)
    q, opening = np.empty((len(times), len(JOINT_NAMES))), np.empty(len(times))
    for (first, values, width), (following, *_) in pairwise([*parts, (np.inf, None, None)]):
        own = (times >= first - 1e-12) & (times < following - 1e-12)
        q[own] = values(np.clip(times[own] - first, 0.0, None)).T  # type: ignore[misc]
        opening[own] = width
    padded = np.vstack([q[:1], q, q[-1:]])  # at rest before and after
    velocity = (padded[2:] - padded[:-2]) / (2.0 * STEP)
    acceleration = (padded[2:] - 2.0 * padded[1:-1] + padded[:-2]) / STEP**2
    return Motion(q, velocity, acceleration, opening, grips, speed_limit)


def to_csv(motion: Motion) -> str:
    """The motion every 10 ms as a table: time, angles, speeds, and the opening commanded."""
    heads = ["time_s", *(f"{name}_rad" for name in JOINT_NAMES)]
    heads += [*(f"{name}_rad_s" for name in JOINT_NAMES), "gripper_opening_m"]
    lines = [",".join(heads)]
    for i in _coarse(motion):
        values = [motion.time[i], *motion.q[i], *motion.velocity[i], motion.opening[i]]
        lines.append(",".join(f"{value:.9g}" for value in values))
    return "\n".join(lines) + "\n"


def to_ros(motion: Motion) -> str:
    """The motion every 10 ms as a ROS 2 message ``trajectory_msgs/msg/JointTrajectory`` in YAML."""
    lines = ["header:", "  stamp: {sec: 0, nanosec: 0}", "  frame_id: ''"]
    lines += [f"joint_names: [{', '.join(JOINT_NAMES)}]", "points:"]

    def listed(values: Array) -> str:
        return f"[{', '.join(f'{value:.9f}' for value in values)}]"

    for i in _coarse(motion):
        seconds, nanoseconds = divmod(int(i) * round(1e9 * STEP), 10**9)
        lines += [
            f"- positions: {listed(motion.q[i])}",
            f"  velocities: {listed(motion.velocity[i])}",
            f"  accelerations: {listed(motion.acceleration[i])}",
            "  effort: []",
            f"  time_from_start: {{sec: {seconds}, nanosec: {nanoseconds}}}",
        ]
    return "\n".join(lines) + "\n"


def grips_to_csv(motion: Motion) -> str:
    """When the gripper is told to open or close; `closed` is the vendor's command, 0 to 1."""
    lines = ["time_s,opening_m,closed"]
    for seconds, width in motion.grips:
        lines.append(f"{seconds:.3f},{width:.6f},{1.0 - width / MAX_OPENING:.6f}")
    return "\n".join(lines) + "\n"


def _coarse(motion: Motion) -> Iterator[Any]:
    """Indices of the points that are written, the last one included."""
    last = len(motion.q) - 1
    yield from range(0, last, COARSE)
    yield last
