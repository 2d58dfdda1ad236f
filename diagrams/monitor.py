"""How hard an episode drives the robot: what its joints did at most, and how deep contacts were."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import GeometryId, QueryObject
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    EventStatus,
    LeafSystem,
    OutputPort,
    State,
)
from pydrake.systems.primitives import LogVectorOutput

from diagrams.arm_controller import ACCELERATION_LIMIT, JOINTS
from diagrams.state_identifier import LEAST_FORCE
from diagrams.station import Station
from models.scenes.parsing import ARM, CUBE

PERIOD = 0.02
"""Between two looks at the contacts [s]."""
SPAN = 0.01
"""That accelerations are means over [s]."""
SHAKEN = 0.1
"""For so long after a force from outside the arm need not be where it is told to be [s]."""
_FINGERS = {"left_inner_finger", "right_inner_finger"}
_HELD = f"held {CUBE}"


@dataclass(frozen=True)
class Loads:
    """What the robot did at most.

    Attributes:
        speed: largest share of the joints' speed limits ``[7]``.
        acceleration: of their acceleration limits, as a mean over `SPAN` ``[7]``.
        torque: of their torque limits, what carries the arm's weight included ``[7]``.
        tracking_error: largest distance from the command ``[7]`` [rad].
        limited_samples: how many commands were beyond a limit, and not followed as they were.
        penetration: by pair of bodies, how deep they were in one another [m].
    """

    speed: np.ndarray
    acceleration: np.ndarray
    torque: np.ndarray
    tracking_error: np.ndarray
    limited_samples: int
    penetration: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class _Depths:
    by_pair: Mapping[tuple[str, str], float]

    def __deepcopy__(self, memo: dict) -> "_Depths":
        """Itself: nothing in it changes, and Drake copies states at every update."""
        return self


class ContactMonitor(LeafSystem):
    """Keeps how deep the bodies of each pair were in one another at most.

    ::

                                 ┌────────────────┐
                 query_object ───┤ ContactMonitor │
       gripper.force_measured ───┤                │
                                 └────────────────┘

    A cube between fingers that both touch it and press counts as another body, the *held cube*. One
    that is let go touches them a little longer, and lands. Soft bodies that press on each other, as
    pads on the cube, are in one another as well.
    """

    def __init__(self, plant: MultibodyPlant) -> None:
        """Watch the shapes of ``plant``."""
        super().__init__()
        self._plant = plant
        self._names: dict[GeometryId, str] = {}
        self._query = self.DeclareAbstractInputPort(
            "query_object", AbstractValue.Make(QueryObject())
        )
        self._force = self.DeclareVectorInputPort("gripper.force_measured", 1)
        self._memory = self.DeclareAbstractState(Value(_Depths({})))
        self.DeclarePeriodicUnrestrictedUpdateEvent(PERIOD, 0.0, self._update)

    def depths(self, context: Context) -> dict[str, float]:
        """By pair of bodies [m], from this system's context."""
        by_pair = context.get_abstract_state(self._memory).get_value().by_pair
        return {" and ".join(bodies): depth for bodies, depth in by_pair.items()}

    def _update(self, context: Context, state: State) -> EventStatus:
        known = context.get_abstract_state(self._memory).get_value().by_pair
        deeper = {
            pair: depth
            for pair, depth in self._look(context).items()
            if depth > known.get(pair, 0.0)
        }
        if not deeper:
            return EventStatus.DidNothing()
        after = _Depths({**known, **deeper})
        state.get_mutable_abstract_state(self._memory).set_value(after)
        return EventStatus.Succeeded()

    def _look(self, context: Context) -> dict[tuple[str, str], float]:
        """How deep each pair of bodies is in one another, the deepest of their shapes [m]."""
        query = self._query.Eval(context)
        found: dict[tuple[str, str], float] = {}
        for pair in query.ComputePointPairPenetration():
            one, other = self._name(query, pair.id_A), self._name(query, pair.id_B)
            bodies = (one, other) if one < other else (other, one)
            found[bodies] = max(pair.depth, found.get(bodies, 0.0))
        touching = {body for bodies in found if CUBE in bodies for body in bodies}
        if not (touching >= _FINGERS and self._force.Eval(context)[0] >= LEAST_FORCE):
            return found
        held = {CUBE: _HELD}
        return {
            (held.get(one, one), held.get(other, other)): depth
            for (one, other), depth in found.items()
        }

    def _name(self, query: QueryObject, shape: GeometryId) -> str:
        """Of the body that a shape is of."""
        if shape not in self._names:
            frame = query.inspector().GetFrameId(shape)
            self._names[shape] = self._plant.GetBodyFromFrameId(frame).name()
        return self._names[shape]


class Monitor:
    """Logs a station's arm at every step, by Drake's own loggers, and its contacts."""

    def __init__(self, builder: DiagramBuilder, station: Station, command: OutputPort) -> None:
        """Attach to ``station``, whose arm obeys ``command``; both are in ``builder``."""
        plant = station.plant
        self._station, self._period = station, plant.time_step()
        self._speed, self._torque = _limits(plant)
        ports = {
            name: station.GetOutputPort(f"arm.{name}_measured")
            for name in ("position", "velocity", "torque")
        }
        self._logs = {
            name: LogVectorOutput(port, builder, publish_period=self._period)
            for name, port in {**ports, "command": command}.items()
        }
        self._contacts = builder.AddNamedSystem("contact_monitor", ContactMonitor(plant))
        for name in ("query_object", "gripper.force_measured"):
            builder.Connect(station.GetOutputPort(name), self._contacts.GetInputPort(name))

    def read(self, root: Context, forces: Sequence[tuple[float, float]] = ()) -> Loads:
        """What came about in a simulation of ``root``'s diagram so far.

        Args:
            root: context of the diagram.
            forces: from when to when something pushed or pulled from outside [s].
        """
        logs = {name: sink.FindLog(root) for name, sink in self._logs.items()}
        # A simulator that fails may leave the last sample to some of them only.
        count = min(each.num_samples() for each in logs.values())
        log = {name: each.data()[:, :count] for name, each in logs.items()}
        times = logs["position"].sample_times()[:count]
        quiet = np.ones(times.size, dtype=bool)
        for begin, end in forces:
            quiet &= (times < begin) | (times > end + SHAKEN)
        apart = max(1, round(SPAN / self._period))
        velocity = log["velocity"]
        change = (velocity[:, apart:] - velocity[:, :-apart]) / (apart * self._period)
        samples = self._station.GetOutputPort("arm.limited_samples")
        return Loads(
            speed=_largest(velocity) / self._speed,
            acceleration=_largest(change) / ACCELERATION_LIMIT,
            torque=_largest(log["torque"]) / self._torque,
            tracking_error=_largest((log["position"] - log["command"])[:, quiet]),
            limited_samples=int(samples.Eval(self._station.GetMyContextFromRoot(root))[0]),
            penetration=self._contacts.depths(self._contacts.GetMyContextFromRoot(root)),
        )


def _limits(plant: MultibodyPlant) -> tuple[np.ndarray, np.ndarray]:
    """Of the arm's speed [rad/s] and torque [N m], ``[7]`` each."""
    arm = plant.GetModelInstanceByName(ARM)
    speed = [plant.GetJointByName(name, arm).velocity_upper_limits()[0] for name in JOINTS]
    torque = [plant.GetJointActuatorByName(name, arm).effort_limit() for name in JOINTS]
    return np.array(speed), np.array(torque)


def _largest(values: np.ndarray) -> np.ndarray:
    """Largest size of each row; 0 of an empty one."""
    return np.abs(values).max(axis=1, initial=0.0)
