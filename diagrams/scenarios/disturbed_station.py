"""The station with a scenario's disturbances between its ports and the plant."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort
from pydrake.systems.primitives import DiscreteTimeDelay

from diagrams.contact import set_cube_mass, set_friction
from diagrams.scenarios.draws import Draws
from diagrams.scenarios.memory import Done
from diagrams.scenarios.pose_noise import PoseNoise
from diagrams.scenarios.scene_changes import SECOND, change_scene
from diagrams.scenarios.schema import Scenario
from diagrams.scenarios.unseen_hand import UnseenHand
from diagrams.state_identifier import StateIdentifier
from diagrams.station import TIME_STEP, Station
from models.scenes import gripper
from models.scenes.planning_scene import HOME

COMMANDS = {"arm.position_command": len(HOME), "gripper.position_command": 1}
"""Input ports of the station, with their sizes."""


@dataclass(frozen=True)
class Disturbance:
    """What came of an episode's disturbances.

    Attributes:
        acted: whether all that should happen did, so that the episode counts.
        done: what an unseen hand did.
    """

    acted: bool
    done: tuple[Done, ...] = ()

    @property
    def forces(self) -> list[tuple[float, float]]:
        """From when to when a force acted [s]."""
        return [(done.began, done.ended) for done in self.done]


class DisturbedStation(Diagram):
    """A `Station` in which things go otherwise, with the same ports of the same names.

    ::

         commands ──► delay ──► ┌─────────┐ ──► noise ──► object.pose, task.state
                                │ Station │
       UnseenHand ──forces────► └─────────┘ ──► all other outputs

    Where commands are delayed, two outputs more tell those that arrive:
    ``arm.position_command_arriving`` and that of the gripper. What is not in the scenario is not in
    the diagram either. Whatever differs from episode to episode lies in the context: `initialize`
    puts it there.

    Attributes:
        station: the station itself.
        plant: of the station.
        hand: the unseen hand, if the scenario has it do something, or somebody looks on who may
            have it do something; else None.
    """

    def __init__(self, scenario: Scenario, *, meshcat: Meshcat | None = None) -> None:
        """Build the station for a scenario; see `Station` for ``meshcat``."""
        super().__init__()
        self._scenario = scenario
        builder = DiagramBuilder()
        self.station = builder.AddNamedSystem(
            "station",
            Station(
                meshcat=meshcat,
                prepare=partial(change_scene, scenario),
                movable_base=scenario.base is not None,
            ),
        )
        station, self.plant = self.station, self.station.plant
        outputs = {
            (port := station.get_output_port(i)).get_name(): port
            for i in range(station.num_output_ports())
        }
        self._delays = {
            name: builder.AddNamedSystem(
                f"delay of {name}",
                DiscreteTimeDelay(TIME_STEP, round((scenario.delay or 0.0) / TIME_STEP), size),
            )
            for name, size in COMMANDS.items()
            if scenario.delay
        }
        for name in COMMANDS:
            port = station.GetInputPort(name)
            if name in self._delays:
                builder.Connect(self._delays[name].get_output_port(), port)
                outputs[f"{name}_arriving"] = self._delays[name].get_output_port()
                port = self._delays[name].get_input_port()
            builder.ExportInput(port, name)
        led = scenario.leads() or meshcat is not None
        self.hand = self._add_hand(builder, outputs) if led else None
        self._noise = None
        if scenario.noise is not None:
            self._noise = builder.AddNamedSystem("noise", PoseNoise(scenario.noise))
            builder.Connect(outputs["object.pose"], self._noise.get_input_port())
            outputs["object.pose"] = self._noise.get_output_port()
            # What is called a state is what is measured, not what is true.
            identifier = builder.AddNamedSystem("state_identifier", StateIdentifier())
            for i in range(identifier.num_input_ports()):
                port = identifier.get_input_port(i)
                builder.Connect(outputs[port.get_name()], port)
            outputs["task.state"] = identifier.get_output_port()
        for name, output in outputs.items():
            builder.ExportOutput(output, name)
        builder.BuildInto(self)

    def initialize(
        self,
        root: Context,
        draws: Draws,
        *,
        X_WO: RigidTransform,
        q: np.ndarray = HOME,
        width: float = gripper.MAX_OPENING,
        goals: Sequence[np.ndarray] = (),
    ) -> None:
        """Put the scene at rest as `Station.initialize` does, and everything that was drawn in it.

        Args:
            root: context of the whole diagram.
            draws: what is otherwise than usual.
            X_WO: the cube's pose.
            q: the arm's joint angles ``[7]`` [rad].
            width: opening of the fingers [m].
            goals: places ``[3]`` [m] that no distractor may lie at.

        Raises:
            ModelError: if a value is none, or there is no place for a distractor.
        """
        context = self.plant.GetMyMutableContextFromRoot(root)
        if draws.X_BB is not None:
            self.station.mount.move_base(context, draws.X_BB)
        self.station.initialize(root, X_WO=X_WO, q=q, width=width)
        for name, value in zip(COMMANDS, (q, np.array([width])), strict=True):
            if name in self._delays:
                own = self._delays[name].GetMyMutableContextFromRoot(root)
                buffer = own.get_mutable_discrete_state_vector()
                buffer.SetFromVector(np.tile(value, buffer.size() // len(value)))
        if draws.friction is not None:
            set_friction(self.plant, self.station.scene_graph, root, draws.friction)
        if draws.mass is not None:
            set_cube_mass(self.plant, context, draws.mass)
        if draws.distractor is not None:
            second = self.plant.GetBodyByName(SECOND)
            self.plant.SetFreeBodyPose(
                context, second, draws.second_cube(X_WO.translation(), goals)
            )
        if self._noise is not None:
            self._noise.prepare(root, draws)
        if self.hand is not None:
            self.hand.prepare(root, draws)

    def disturbance(self, root: Context) -> Disturbance:
        """What came of the disturbances so far; what is always there has always acted."""
        if self.hand is None:
            return Disturbance(True)
        memory = self.hand.memory(root)
        acted = not memory.leads and all(done.acted for done in memory.done)
        return Disturbance(acted, memory.done)

    def _add_hand(self, builder: DiagramBuilder, outputs: dict[str, OutputPort]) -> UnseenHand:
        """Add an unseen hand that acts on the station's plant."""
        hand = builder.AddNamedSystem("unseen_hand", UnseenHand(self.plant))
        for name in ("object.pose", "tcp.pose", "state"):
            builder.Connect(outputs[name], hand.GetInputPort(name))
        builder.Connect(
            hand.GetOutputPort("spatial_forces"), self.station.GetInputPort("spatial_forces")
        )
        return hand
