"""A plan's own time, which waits for an arm that cannot follow."""

from dataclasses import dataclass

SLOWS, STOPS = 0.010, 0.025
"""How far the arm is behind its plan where the plan's time begins to slow down, and where it stands
[rad].

An arm whose torque suffices stays within the first at its limits of acceleration with 0.5 kg in the
hand.
"""
PERIOD = 0.01
"""Between two looks at the arm [s]."""


@dataclass(frozen=True)
class Clock:
    """How much of a plan's time has passed.

    It passes as the simulation's does while the arm follows. Where one joint is held up, all wait:
    the arm stays on its path.

    Attributes:
        now: the simulation's time at which it was last set [s].
        shows: the plan's time at that moment [s].
        rate: how fast it passes since; from 0 to 1.
    """

    now: float = 0.0
    shows: float = 0.0
    rate: float = 1.0

    def read(self, now: float) -> float:
        """The plan's time at the simulation's time ``now`` [s]."""
        return self.shows + self.rate * (now - self.now)

    def led(self, now: float, behind: float, changes: tuple[float, float]) -> "Clock":
        """Set anew after a look at the arm; itself if its rate stays.

        Args:
            now: the simulation's time [s].
            behind: how far the arm is behind its plan [rad].
            changes: by how much the rate may change, downwards and upwards [1/s].
        """
        down, up = changes
        rate = (STOPS - behind) / (STOPS - SLOWS)
        rate = max(rate, self.rate + down * PERIOD)
        rate = min(max(min(rate, self.rate + up * PERIOD), 0.0), 1.0)
        return self if rate == self.rate else Clock(now, self.read(now), rate)
