"""Commands as an arm can follow them: speed and acceleration limited, all else unchanged."""

import numpy as np
from numpy.typing import ArrayLike

from models.arrays import Array, finite_array, finite_number, finite_vector
from models.compiled import compiled
from models.errors import ModelError
from models.scenes.limits import LARGEST, ROUNDING, JointLimits

_TOLERANCE = 1e-6  # share of the limits by which rounding may exceed them
_TURN = 2.0 * np.pi
_CRUISE = 0.98
"""Share of the speed limit at which a limited reference goes: joints that follow it swing by 1.3 %
of their limit around its speed."""
CATCHES_UP = 33.0
"""Per radian that a joint is behind, by how much its reference goes slower than the limit [1/s].

Stiffness over damping of the joints' control, of the quicker ones: a joint that was held up and
comes free goes so much faster than its reference until it has caught up."""
LEAD = 0.012
"""From a joint to its reference at most [rad].

This much asks for all the torque there is."""
HELD_UP = 0.010
"""A joint that is further behind is held up [rad].

At the arm's limits of acceleration, with 0.5 kg in the hand, one whose torque suffices is behind by
0.008."""


class Limiter:
    """One joint each, sample by sample: from a command to the reference that may be followed.

    A stream of commands within the limits is passed on as it is, to the bit, but where the joint is
    held up. Of any other, the reference goes towards the command as fast as the limits allow, more
    slowly where the joint is behind, and brakes in time to land on it: without overshoot, unless
    the command itself turns back within the braking distance. Two samples in one direction count
    as a motion to catch up with, a jump of one sample as a place.

    The reference waits for a joint that does not follow: it is never further than `LEAD` from where
    that is. What had held the joint and lets go then finds no way to catch up with.

    A command beyond a joint's range leads to its end. On an endless joint a jump of more than half
    a turn is another winding of an angle, not a motion: the reference takes the short way.

    What it remembers is a vector, so that a system can keep it in its context ``[4 n + 1]``:
    reference [rad], its speed [rad/s], the command in the reference's winding [rad], its speed
    [rad/s], and how many samples have been limited.
    """

    def __init__(
        self, limits: JointLimits, velocity: ArrayLike, acceleration: ArrayLike, period: float
    ) -> None:
        """Limit n joints.

        Args:
            limits: where the joints may be.
            velocity: ``[n]`` [rad/s].
            acceleration: ``[n]`` [rad/s²].
            period: from one sample to the next [s].

        Raises:
            ModelError: if a limit or the period is not above 0.
        """
        self.n_joints = len(limits.names)
        self._names = limits.names
        self._period = finite_number(period, "period", above=0.0, valid="seconds above 0")
        speed = self._above_zero(velocity, "velocity")
        change = self._above_zero(acceleration, "acceleration") * self._period
        ends = limits.lower - ROUNDING, limits.upper + ROUNDING
        self._limits = np.column_stack([*ends, speed, change])

    def _above_zero(self, value: ArrayLike, name: str) -> Array:
        value = finite_array(value, (self.n_joints,), name)
        if value.ndim != 1 or not (value > 0.0).all():
            raise ModelError(f"{name}: {value.tolist()}; valid: {self.n_joints} above 0")
        return value

    def at_rest(self, q: Array) -> Array:
        """What is remembered at rest on a command of ``q [n]`` [rad], nothing limited yet.

        Raises:
            ModelError: if ``q`` is not so many finite angles.
        """
        q = finite_vector(q, self.n_joints, "q")
        rest = np.zeros(self.n_joints)
        return np.concatenate([q, rest, q, rest, [0.0]])

    def follow(self, command: Array, before: Array, measured: Array) -> Array:
        """What is remembered after a sample.

        Args:
            command: ``[n]`` [rad].
            before: what was remembered ``[4 n + 1]``.
            measured: where the joints are ``[n]`` [rad].

        Raises:
            ModelError: if an angle is not finite, or beyond 1e6 rad.
        """
        after = _follow(command, before, measured, self._limits, self._period)
        if after[-1] < 0.0:
            for name, angle in zip(self._names, command.tolist(), strict=True):
                if not abs(angle) <= LARGEST:
                    raise ModelError(f"{name} {angle:g}; valid: angles within ±{LARGEST:g} rad")
        return after


@compiled()
def _follow(command: Array, before: Array, measured: Array, limits: Array, period: float) -> Array:
    """`Limiter.follow`, compiled; it counts −1 where a command is no angle.

    Args:
        command: ``[n]`` [rad].
        before: what is remembered ``[4 n + 1]``.
        measured: ``[n]`` [rad].
        limits: lower end and upper [rad], speed [rad/s], change of speed in a sample [rad/s]
            ``[n, 4]``.
        period: [s].
    """
    n = len(command)
    after = before.copy()
    counts = False
    for i in range(n):
        if not abs(command[i]) <= LARGEST:
            after[4 * n] = -1.0
            return after
        lower, upper, fastest, change = limits[i]
        reference, speed = before[i], before[n + i]
        last, moved = before[2 * n + i], before[3 * n + i]
        turned = command[i]
        if upper == np.inf:
            turned -= _TURN * np.floor((turned - last) / _TURN + 0.5)
        target = min(max(turned, lower), upper)
        # As fast as the command moves, and has moved before; a jump is no motion.
        moves = (target - last) / period
        moving = 0.0
        if moves * moved > 0.0:
            moving = np.copysign(min(abs(moves), abs(moved), fastest), moves)

        wanted = (target - reference) / period
        most = change * (1.0 + _TOLERANCE)
        follows = reference == last and abs(moves - moved) <= most
        # What is caught up with must not be passed at once.
        fits = follows or abs(wanted - moving) <= most
        lag = min(abs(reference - measured[i]), LEAD)
        behind = CATCHES_UP * lag
        allowed = fastest * (1.0 + _TOLERANCE) - (behind if lag > HELD_UP else 0.0)
        if fits and abs(wanted) <= allowed and abs(wanted - speed) <= most:
            after[i], after[n + i] = target, wanted
            counts |= target != turned
        else:
            toward = moving + _approach(target - moving * period - reference, change, period)
            cruise = max(_CRUISE * fastest - behind, 0.0)
            toward = min(max(toward, -cruise), cruise)
            speed = min(max(toward, speed - change), speed + change)
            after[i], after[n + i] = reference + speed * period, speed
            counts = True
        waits = min(max(after[i], measured[i] - LEAD), measured[i] + LEAD)
        if waits != after[i]:
            # A joint that is thrown is not to be followed at its speed, but held back.
            goes = (waits - reference) / period
            after[i], after[n + i] = waits, min(max(goes, -fastest), fastest)
            counts = True
        after[2 * n + i], after[3 * n + i] = target, moves
    after[4 * n] += counts
    return after


@compiled()
def _approach(distance: float, change: float, period: float) -> float:
    """Speed [rad/s] from which changes of speed, one a sample, stop after ``distance`` [rad].

    With m more whole changes to go, (m + f) of them cover (m + 1) (m / 2 + f) times as much as one
    does in a sample.
    """
    ones = abs(distance) / (change * period)
    whole = np.floor((np.sqrt(1.0 + 8.0 * ones) - 1.0) / 2.0)
    return np.copysign(change * (whole / 2.0 + ones / (whole + 1.0)), distance)
