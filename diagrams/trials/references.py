"""Where gantry and gripper are to be at any time: commands followed at limited speed.

Either as discrete state that is updated with every step of a discrete plant, or as functions of
time for a plant that Drake integrates with error control. Every event ends one of the
integrator's steps, which would be ten times as long without; functions of time have none.
"""

from collections.abc import Sequence

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import Context, DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from diagrams.gripper_controller import KNUCKLE_SPEED, GripperController
from diagrams.reference_ramp import ReferenceRamp
from models.scenes import gripper

SPEED = 0.1
"""Of the slides [m/s]."""
TURN_SPEED = 1.5
"""Of the turret [rad/s], somewhat faster than the arm's wrist."""
GANTRY_SPEED = np.array([SPEED, SPEED, SPEED, TURN_SPEED])


class SteppedReferences:
    """References of a discrete plant, discrete state themselves.

    ::

       gantry ── ReferenceRamp ──────┐
                                     ├── plant
       opening ── GripperController ─┘
    """

    def __init__(
        self,
        builder: DiagramBuilder,
        plant: MultibodyPlant,
        gantry: ModelInstanceIndex,
        hand: ModelInstanceIndex,
    ) -> None:
        """Wire them to the plant."""
        self._gripper = GripperController.add_to_builder(builder, plant, hand)
        self._ramp = builder.AddNamedSystem(
            "gantry_ramp", ReferenceRamp(4, speed=GANTRY_SPEED, period=plant.time_step())
        )
        builder.Connect(self._ramp.get_output_port(), plant.get_desired_state_input_port(gantry))

    def start(self, root: Context, gantry: Sequence[float], width: float) -> None:
        """Begin at a position of the gantry ``[4]`` and an opening [m], at rest."""
        self._ramp.set_reference(
            self._ramp.GetMyMutableContextFromRoot(root), np.asarray(gantry, dtype=float)
        )
        self._gripper.set_opening(root, width)

    def command(self, root: Context, gantry: Sequence[float], width: float) -> None:
        """Go there from wherever they are."""
        ramp = self._ramp.GetMyMutableContextFromRoot(root)
        self._ramp.get_input_port().FixValue(ramp, gantry)
        hand = self._gripper.GetMyMutableContextFromRoot(root)
        self._gripper.GetInputPort("position_command").FixValue(hand, [width])

    def knuckle(self, root: Context) -> float:
        """Where the knuckles are to be now [rad]."""
        hand = self._gripper.GetMyContextFromRoot(root)
        return float(self._gripper.GetOutputPort("desired_state").Eval(hand)[0])


class TimedReferences:
    """References of a plant with continuous state: piecewise linear functions of time.

    The functions belong to the diagram, not to a context: one simulation at a time.

    ::

       gantry ──── TrajectorySource ─┐
                                     ├── plant
       knuckles ── TrajectorySource ─┘
    """

    def __init__(
        self,
        builder: DiagramBuilder,
        plant: MultibodyPlant,
        gantry: ModelInstanceIndex,
        hand: ModelInstanceIndex,
    ) -> None:
        """Wire them to the plant."""
        self._speeds = (GANTRY_SPEED, np.full(2, KNUCKLE_SPEED))
        self._sources = []
        for name, instance, speed in zip(
            ("gantry", "knuckles"), (gantry, hand), self._speeds, strict=True
        ):
            still = _way(0.0, np.zeros(speed.size), np.zeros(speed.size), speed)
            source = builder.AddNamedSystem(name, TrajectorySource(still, 1))
            builder.Connect(source.get_output_port(), plant.get_desired_state_input_port(instance))
            self._sources.append(source)

    def start(self, root: Context, gantry: Sequence[float], width: float) -> None:
        """Begin at a position of the gantry ``[4]`` and an opening [m], at rest."""
        there = self._positions(gantry, width)
        self._go(root, there, there)

    def command(self, root: Context, gantry: Sequence[float], width: float) -> None:
        """Go there from wherever they are."""
        self._go(root, self._here(root), self._positions(gantry, width))

    def knuckle(self, root: Context) -> float:
        """Where the knuckles are to be now [rad]."""
        return float(self._here(root)[1][0])

    def _here(self, root: Context) -> list[np.ndarray]:
        return [
            source.get_output_port().Eval(source.GetMyContextFromRoot(root))[: speed.size]
            for source, speed in zip(self._sources, self._speeds, strict=True)
        ]

    @staticmethod
    def _positions(gantry: Sequence[float], width: float) -> list[np.ndarray]:
        return [np.asarray(gantry, dtype=float), np.full(2, gripper.knuckle_angle(width))]

    def _go(self, root: Context, here: list[np.ndarray], there: list[np.ndarray]) -> None:
        time = root.get_time()
        for source, *way in zip(self._sources, here, there, self._speeds, strict=True):
            source.UpdateTrajectory(_way(time, *way))
        root.SetTime(time)  # What was computed from the former functions is out of date.


def _way(
    time: float, start: np.ndarray, goal: np.ndarray, speed: np.ndarray
) -> PiecewisePolynomial:
    """From start to goal, each component at its own speed and then at rest, from a time on [s]."""
    distance = np.abs(goal - start)
    arrivals = np.unique(distance / speed)
    breaks = np.concatenate([[0.0], arrivals[arrivals > 1e-9]])
    if breaks.size == 1:
        breaks = np.array([0.0, 1.0])
    way = np.minimum(distance[:, None], speed[:, None] * breaks) * np.sign(goal - start)[:, None]
    return PiecewisePolynomial.FirstOrderHold(time + breaks, start[:, None] + way)
