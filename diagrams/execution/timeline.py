"""A plan laid out in time: what to command at any moment, and how to brake on the way."""

from bisect import bisect_right
from collections.abc import Sequence

import numpy as np
from pydrake.trajectories import PathParameterizedTrajectory, PiecewisePolynomial, Trajectory

from diagrams.execution.phases import Watch, phases
from models.arrays import finite_number, finite_vector
from models.motion.moves import Grip, Move
from models.motion.timing import time_path
from models.scenes.planning_scene import HOME

BRAKING = 0.9 * np.array([5.2] * 4 + [10.0] * 3)
"""How hard the joints brake [rad/s²]: nearly as hard as the vendor allows."""
_STEP = 0.002  # of the braking's integration [s]


class Timeline:
    """What to command at any moment since a start: a plan, part by part."""

    def __init__(
        self, q: np.ndarray, width: float, plan: Sequence[Move | Grip], velocity_limit: np.ndarray
    ) -> None:
        """Start at ``q [7]`` [rad] with the pads ``width`` [m] apart, then follow ``plan``.

        Raises:
            ModelError: if ``q`` is not so many finite angles, ``width`` not a finite number, or a
                move of the plan is no path (`time_path`).
        """
        q = np.array(finite_vector(q, len(HOME), "q"))
        width = float(finite_number(width, "width", valid="metres"))
        self.plan = tuple(plan)
        """What it follows."""
        self._phases = phases(plan)
        self._starts, self._width = [0.0], [width]
        self._arm: list[Trajectory | np.ndarray] = [q]
        now = 0.0
        for part in plan:
            if isinstance(part, Move):
                path = time_path(part.waypoints, velocity_limit, cuts=part.cuts)
                self._add(now, path, width)
                seconds, q = path.end_time(), part.waypoints[-1]
            else:
                seconds, width = part.seconds, part.width
                self._add(now, q, width)
            now += seconds
        self._add(now, q, width)
        self.duration = now

    def _add(self, start: float, arm: Trajectory | np.ndarray, width: float) -> None:
        self._starts.append(start)
        self._arm.append(arm if isinstance(arm, Trajectory) else np.array(arm))
        self._width.append(float(width))

    def arm(self, t: float) -> np.ndarray:
        """Joint angles ``[7]`` [rad], ``t`` seconds after the start."""
        index = self._part(t)
        arm = self._arm[index]
        if isinstance(arm, np.ndarray):
            return arm
        return arm.value(t - self._starts[index]).ravel()

    def width(self, t: float) -> float:
        """Commanded opening [m], ``t`` seconds after the start."""
        return self._width[self._part(t)]

    def starts(self, part: int) -> float:
        """When a part of the plan starts, by its place in it [s]."""
        return self._starts[1 + part]

    def watch(self, t: float) -> Watch:
        """What is watched ``t`` seconds after the start; nothing before it and after the end."""
        number = self._part(t) - 1
        return self._phases[number].watch if 0 <= number < len(self._phases) else Watch.NOTHING

    def changes(self, t: float, rate: float) -> tuple[float, float]:
        """By how much the rate at which it passes may change, downwards and upwards [1/s].

        Args:
            t: how much of it has passed [s].
            rate: at which it passes now.
        """
        index = self._part(t)
        arm = self._arm[index]
        if isinstance(arm, np.ndarray):
            return -np.inf, np.inf
        down, up = _changes(arm, t - self._starts[index], rate)
        return min(down, 0.0), max(up, 0.0)

    def braked(self, t: float, rate: float = 1.0) -> "Timeline":
        """From what is commanded after ``t`` seconds of it to rest, the fingers as they are.

        ``rate`` is how fast it passed until then.
        """
        index = self._part(t)
        arm, width = self._arm[index], self._width[index]
        rest = Timeline(self.arm(t), width, (), np.ones(len(HOME)))
        rest.plan = self.plan
        if isinstance(arm, Trajectory):
            path = braking(arm, t - self._starts[index], rate)
            rest._arm[0] = path
            rest._starts[1] = rest.duration = path.end_time()
            rest._arm[1] = path.value(path.end_time()).ravel()
        return rest

    def yielded(self, t: float, q: np.ndarray) -> "Timeline":
        """At rest at ``q [7]`` [rad], the fingers as they are ``t`` seconds after the start."""
        rest = Timeline(q, self.width(t), (), np.ones(len(HOME)))
        rest.plan = self.plan
        return rest

    def _part(self, t: float) -> int:
        return max(0, bisect_right(self._starts, t) - 1)


def braking(motion: Trajectory, at: float, rate: float = 1.0) -> Trajectory:
    """From a motion to rest on its own path, as fast as `BRAKING` allows, without a jump in speed.

    The motion's own time passes ever more slowly: at a rate r of it, which changes by r', a joint
    that would have velocity v and acceleration a has r v and r² a + r' v.

    Args:
        motion: joint angles ``[7]`` [rad] over time.
        at: when to begin to brake [s].
        rate: at which the motion's time passes then.

    Returns:
        Joint angles ``[7]`` [rad] from the beginning of the braking, at 0 s, to its end.
    """
    end = motion.end_time()
    times, places, rates = [0.0], [at], [rate]
    while rates[-1] > 0.0 and places[-1] < end:
        place, rate = places[-1], rates[-1]
        # The motion's acceleration may jump within a step.
        slows = max(_changes(motion, x, rate)[0] for x in (place, min(place + _STEP * rate, end)))
        slows = float(np.clip(slows, -rate / _STEP, 0.0))
        times.append(times[-1] + _STEP)
        places.append(min(place + _STEP * (rate + 0.5 * _STEP * slows), end))
        rates.append(rate + _STEP * slows)
    rates[-1] = 0.0
    if len(times) == 1:
        times, places, rates = [0.0, _STEP], [at, at], [0.0, 0.0]
    progress = PiecewisePolynomial.CubicHermite(times, [places], [rates])
    return PathParameterizedTrajectory(motion, progress)


def _changes(motion: Trajectory, place: float, rate: float) -> tuple[float, float]:
    """Least and largest change of a rate [1/s] for which no joint speeds up or brakes too hard."""
    v, a = (motion.EvalDerivative(place, order).ravel() for order in (1, 2))
    moves = np.abs(v) > 1e-9
    speed, own = np.abs(v[moves]), np.sign(v[moves]) * rate**2 * a[moves]
    down = (-BRAKING[moves] - own) / speed
    up = (BRAKING[moves] - own) / speed
    return float(down.max(initial=-np.inf)), float(up.min(initial=np.inf))
