"""The cases of the hold test: every swing at every share of the limits, with every cube."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from diagrams.faults import SimulatorFault
from diagrams.gripper_controller import FORCE_RANGE
from experiments.hold.held import Held
from experiments.hold.rig import Load, hold
from experiments.hold.swings import Motion, motion, swings

GRAVITY = 9.81
"""What a cube weighs, by its mass [m/s²]."""
FAULT = "fault"
"""In place of a verdict, where the simulator failed."""


@dataclass(frozen=True)
class Case:
    """One cube held through one swing.

    Attributes:
        swing: key of `experiments.hold.swings.swings`.
        share: of the joints' acceleration limits, in (0, 1].
        load: cube, friction and force.
    """

    swing: str
    share: float
    load: Load

    @property
    def motion(self) -> Motion:
        """The arm's."""
        return motion(swings()[self.swing], self.share)

    def ratio(self, acceleration: float) -> float:
        """Friction that the two pads can give, 2 µ F, over what the cube may ask for, m (g + a)."""
        load = self.load
        return 2.0 * load.friction * load.force / (load.mass * (GRAVITY + acceleration))


def regular(
    keys: Sequence[str],
    shares: Sequence[float],
    masses: Sequence[float],
    frictions: Sequence[float],
    force: float,
) -> list[Case]:
    """Every swing with every share, mass and friction, held with the same force."""
    every = product(keys, shares, masses, frictions)
    return [Case(key, share, Load(mass, mu, force)) for key, share, mass, mu in every]


def heavy(keys: Sequence[str], masses: Sequence[float], friction: float) -> list[Case]:
    """Cubes beyond what the arm may carry, held as weakly as the gripper can, at the limits."""
    return regular(keys, (1.0,), masses, (friction,), FORCE_RANGE[0])


def row(case: Case, time_step: float) -> dict[str, Any]:
    """What ``result.json`` says of a case: how it went, and with half the time step."""
    swung = case.motion
    return {
        **{"swing": case.swing, "share": case.share},
        "mass_kg": case.load.mass,
        "friction": case.load.friction,
        "force_n": case.load.force,
        "acceleration_m_s2": swung.largest,
        "ratio": case.ratio(swung.largest),
        **columns(_run(swung, case.load, time_step)),
        **columns(_run(swung, case.load, time_step / 2), "halved_"),
    }


def _run(swung: Motion, load: Load, time_step: float) -> Held | None:
    try:
        return hold(swung, load, time_step)
    except SimulatorFault:
        return None


def columns(held: Held | None, prefix: str = "") -> dict[str, Any]:
    """What a row says of one run, under names that begin with ``prefix``; of None, a fault."""
    least, mean, largest = held.force if held else (None,) * 3
    found = {
        "verdict": held.verdict if held else FAULT,
        "slip_mm": 1e3 * held.slip if held else None,
        "turn_deg": float(np.degrees(held.turn)) if held else None,
        "chatter": held.chatter if held else None,
        "force_min_n": least,
        "force_mean_n": mean,
        "force_max_n": largest,
    }
    return {prefix + name: value for name, value in found.items()}
