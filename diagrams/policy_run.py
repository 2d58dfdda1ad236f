"""A policy played in full physics: station, executor and policy controller, simulated."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput

from diagrams.action_executor import ActionExecutor
from diagrams.contact import Solver
from diagrams.decisions import Decision
from diagrams.falls.scene import FallScene
from diagrams.falls.station import StationSimulator
from diagrams.faults import SimulatorFault, first_line
from diagrams.monitor import Loads, Monitor
from diagrams.policy_controller import Episode, PolicyController, Verdict
from diagrams.scenarios import Disturbance, DisturbedStation, Draws, Scenario
from diagrams.state_identifier import REST_SPAN, carried_state, is_held, lying_state
from diagrams.station import FRAME, Station
from models.errors import ModelError
from models.motion.moves import Grip, Move
from models.motion.planner import ActionPlanner
from models.rotations import rotation_z
from models.scenes import gripper
from models.scenes.parsing import CUBE
from models.task.spaces import LOST, N_FREE, POSITIONS, R_WO, REST_HEIGHT, decode_states

PLACE_SD = 0.003
"""Of the cube's place on the table at the start [m], in x and y."""
YAW_SD = 0.05
"""Of its yaw [rad]."""
LOOK_PERIOD = 0.2
"""Simulated time between two looks at an episode from outside [s]."""
TIME_LIMIT = 300.0
"""Simulated time after which an episode is cut off [s]."""
WATCHED = (
    *("object.pose", "arm.position_measured"),
    *("gripper.position_measured", "gripper.force_measured"),
)
"""The station's ports that the executor watches on its way."""


def start_pose(state: int, rng: np.random.Generator, disturbance: float = 0.0) -> RigidTransform:
    """X_WO of a free cube in a state, off the cell's centre and orientation as a person puts it.

    Args:
        state: index of a free state.
        rng: draws the offset.
        disturbance: further standard deviation of the place, in x and y [m].

    Raises:
        ModelError: if the state is not free.
    """
    if not 0 <= state < N_FREE:
        raise ModelError(f"state {state} is not free; valid: 0…{N_FREE - 1}")
    position, orientation, _ = decode_states(state)
    offset = rng.normal(0.0, np.hypot(PLACE_SD, disturbance), 2)
    R = rotation_z(rng.normal(0.0, YAW_SD)) @ R_WO[int(orientation)]
    p = np.array([*(POSITIONS[int(position)][:2] + offset), REST_HEIGHT])
    return RigidTransform(RotationMatrix(R), p)


@dataclass(frozen=True)
class Played:
    """One episode in physics.

    Attributes:
        start: index of the state the cube was placed in.
        episode: what the controller did.
        seconds: simulated time, with the last moment, in which it is judged.
        postures: the plant's positions at the start and after each action, ``[n, n_q]``.
        loads: what the robot did at most, compared with its limits.
        fault: the simulator's message if it failed, which judges nothing, and below it the
            traceback (`SimulatorFault.text`); else empty.
        plans: how each action was carried out, one more than `episode` has steps if it was cut off
            in an action; nothing where there was no way.
        success: whether the cube truly rests where the goal is, lying there or in the hand as the
            goal has it, by what the simulator knows, whatever the controller's verdict.
        frames: the plant's positions, a picture each `FRAME` seconds, ``[n, n_q]``.
        disturbance: what came of a scenario's disturbances; None without one.
    """

    start: int
    episode: Episode
    seconds: float
    postures: np.ndarray
    loads: Loads
    fault: str = ""
    plans: tuple[tuple[Move | Grip, ...], ...] = ()
    success: bool = False
    frames: np.ndarray = field(default_factory=lambda: np.empty((0, 0)), repr=False)
    disturbance: Disturbance | None = None

    @property
    def reason(self) -> str:
        """Why it failed, in one line; empty unless the simulator did."""
        return first_line(self.fault)

    @property
    def false_success(self) -> bool:
        """Whether the controller took it for a success, and it was none."""
        return not self.fault and self.episode.verdict == Verdict.GOAL and not self.success


class PolicyRun:
    """The whole diagram, built once; `play` runs any number of episodes.

    ::

       ┌──────────────────────────────────────────────────────────────┐
       │  PolicyController ──request──► ActionExecutor ──commands──►   │
       │        ▲    ▲                      │       ▲        Station   │
       │        │    └──────execution───────┘       │           │      │
       │        └──────────task.state, poses────────┴───────────┘      │
       └──────────────────────────────────────────────────────────────┘
    """

    def __init__(
        self,
        decision: Decision,
        planner: ActionPlanner,
        *,
        goal_states: np.ndarray,
        max_actions: int = 20,
        meshcat: Meshcat | None = None,
        scenario: Scenario | None = None,
        solver: Solver = "cenic",
    ) -> None:
        """Assemble the diagram.

        Args:
            decision: chooses the actions (see `PolicyController`).
            planner: plans them.
            goal_states: where episodes end well.
            max_actions: after which an episode ends.
            meshcat: where to publish it, no faster than real time; None does not.
            scenario: in which things go otherwise: the station is a `DisturbedStation`.
            solver: what simulates a cube that falls; with a second cube on the table always the
                discrete solver.
        """
        self._meshcat = meshcat
        # The scene of falls has one cube; two may meet.
        alone = scenario is None or scenario.distractor is None
        self._falls = FallScene(edge=True) if solver == "cenic" and alone else None
        self._goals = {int(state) for state in np.atleast_1d(goal_states)}
        builder = DiagramBuilder()
        self._disturbed: DisturbedStation | None = None
        if scenario is not None:
            self._disturbed = DisturbedStation(scenario, meshcat=meshcat)
        self.station = builder.AddNamedSystem(
            "station", self._disturbed or Station(meshcat=meshcat)
        )
        executor = builder.AddNamedSystem("action_executor", ActionExecutor(planner))
        self.executor = executor
        self.controller = builder.AddNamedSystem(
            "policy_controller",
            PolicyController(
                decision, goal_states=goal_states, lost_state=LOST, max_actions=max_actions
            ),
        )
        task_state = self.station.GetOutputPort("task.state")
        builder.Connect(task_state, self.controller.GetInputPort("task.state"))
        # What is decided on and what is planned from are called by one name.
        builder.Connect(
            self.controller.GetOutputPort("task.state"), executor.GetInputPort("task.state")
        )
        for name in ("object.pose", "tcp.pose"):
            builder.Connect(self.station.GetOutputPort(name), self.controller.GetInputPort(name))
        builder.Connect(
            self.controller.GetOutputPort("object.pose"), executor.GetInputPort("object.pose")
        )
        for name in WATCHED:
            measured = "object.pose_measured" if name == "object.pose" else name
            builder.Connect(self.station.GetOutputPort(name), executor.GetInputPort(measured))
        builder.Connect(self.controller.GetOutputPort("request"), executor.GetInputPort("request"))
        builder.Connect(
            executor.GetOutputPort("execution"), self.controller.GetInputPort("execution")
        )
        for name in ("arm.position_command", "gripper.position_command"):
            builder.Connect(executor.GetOutputPort(name), self.station.GetInputPort(name))
        # An arm follows the commands that have arrived.
        arriving = "arm.position_command_arriving"
        told = executor.GetOutputPort("arm.position_command")
        if self.station.HasOutputPort(arriving):
            told = self.station.GetOutputPort(arriving)
        self._monitor = Monitor(builder, self.station, told)
        self._frames = LogVectorOutput(
            self.station.GetOutputPort("state"), builder, publish_period=FRAME
        )
        self.diagram = builder.Build()

    def play(
        self,
        start: int,
        rng: np.random.Generator,
        *,
        disturbance: float = 0.0,
        draws: Draws | None = None,
        progress: Callable[[Context, Episode], None] | None = None,
    ) -> Played:
        """Place the cube in free state ``start`` and let the policy act until it ends.

        What comes of it depends on the arguments alone, to the bit.

        Args:
            start: index of a free state.
            rng: draws the cube's true pose in that state.
            disturbance: further standard deviation of the cube's place at the start [m].
            draws: what the run's scenario is in this episode; needed if there is a scenario.
            progress: called each `LOOK_PERIOD` with the diagram's context and the episode so far;
                what it raises ends the episode.

        Raises:
            ModelError: if the state is not free, or the scenario cannot be set up.
        """
        simulator = Simulator(self.diagram)
        root = simulator.get_mutable_context()
        self._initialize(root, start_pose(start, rng, disturbance), draws)
        controller_context = self.controller.GetMyContextFromRoot(root)
        if self._meshcat is not None:
            simulator.set_target_realtime_rate(1.0)
        simulation = StationSimulator(simulator, self.station.plant, self._falls)
        plant = self.station.plant
        plant_context = plant.GetMyContextFromRoot(root)
        postures = [plant.GetPositions(plant_context)]
        executor_context = self.executor.GetMyContextFromRoot(root)
        plans: list[tuple[Move | Grip, ...]] = []
        fault = ""
        try:
            while root.get_time() < TIME_LIMIT:
                # After planning, or a pause, it does not hurry to catch up.
                simulator.ResetStatistics()
                simulation.advance_to(root.get_time() + LOOK_PERIOD)
                episode = self.controller.episode(controller_context)
                # An action takes longer than a look, if only for the rest at its end.
                if self.executor.execution(executor_context).sequence > len(plans):
                    plans.append(self.executor.plan(executor_context))
                if len(episode.steps) >= len(postures):
                    postures.append(plant.GetPositions(plant_context))
                if progress is not None:
                    progress(root, episode)
                if episode.verdict != Verdict.RUNNING:
                    break
            episode = self.controller.episode(controller_context)
            if episode.verdict == Verdict.RUNNING:
                episode = replace(episode, verdict=Verdict.OUT_OF_TIME)
            success = self._ends_well(simulation, root)
        except SimulatorFault as error:
            fault, success = error.text, False
            episode = self.controller.episode(controller_context)
        came = self._disturbed.disturbance(root) if self._disturbed else None
        return Played(
            start,
            episode,
            root.get_time(),
            np.array(postures),
            self._monitor.read(root, came.forces if came else ()),
            fault,
            tuple(plans),
            success,
            self._frames.FindLog(root).data()[: plant.num_positions()].T,
            came,
        )

    def _initialize(self, root: Context, X_WO: RigidTransform, draws: Draws | None) -> None:
        """Put the scene at rest with the cube at X_WO, as it is drawn if there is a scenario."""
        if self._disturbed is None:
            self.station.initialize(root, X_WO=X_WO)
            return
        if draws is None:
            raise ModelError("draws: a scenario needs what it is in this episode; see draw")
        q = draws.start_posture(X_WO)
        goals = [POSITIONS[int(decode_states(goal).position)] for goal in self._goals]
        self._disturbed.initialize(root, draws, X_WO=X_WO, q=q, goals=goals)
        self.executor.start_at(
            self.executor.GetMyMutableContextFromRoot(root), q, gripper.MAX_OPENING
        )

    def _ends_well(self, simulation: StationSimulator, root: Context) -> bool:
        """Whether the cube truly rests where a goal is, lying there or in the hand."""
        X_before, X_WG_before = self._truth(root)
        simulation.advance_to(simulation.time + REST_SPAN)
        X_WO, X_WG = self._truth(root)
        if lying_state(X_WO, X_before) in self._goals:
            return True
        if not any(goal >= N_FREE for goal in self._goals):
            return False
        station = self.station.GetMyContextFromRoot(root)
        opening, force = (
            float(self.station.GetOutputPort(f"gripper.{name}_measured").Eval(station)[0])
            for name in ("position", "force")
        )
        held = is_held(X_WO.translation() - X_WG.translation(), opening, force)
        return held and carried_state(X_WO, X_WG, X_WG_before.inverse() @ X_before) in self._goals

    def _truth(self, root: Context) -> tuple[RigidTransform, RigidTransform]:
        """Where cube and tool centre point are, by what the simulator knows."""
        plant = self.station.plant
        context = plant.GetMyContextFromRoot(root)
        return tuple(plant.GetFrameByName(name).CalcPoseInWorld(context) for name in (CUBE, "tcp"))
