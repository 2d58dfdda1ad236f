"""One Bernoulli experiment with the whole arm, as the robot would really do it (thesis 5.8.2).

Where a trial with the floating gripper leaves the arm out, this one is the station itself: the
arm stands in the nominal state, the action is planned and executed, and the state identifier
says what came of it. Slower, and not a part of the transition model: it is what the model is
compared with.
"""

import time
from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from diagrams.action_executor import ActionExecutor, Execution
from diagrams.contact import RESTITUTION, set_cube_mass, set_friction
from diagrams.falls.scene import FallScene
from diagrams.falls.station import StationSimulator
from diagrams.faults import simulating
from diagrams.policy_controller import SETTLE
from diagrams.station import Station
from diagrams.trials.initial_state import NotHeld, begin, held_pose
from diagrams.trials.record import Noise, Outcome, Pair, TrialConfig, TrialRecord
from diagrams.trials.verdict import judge_pose
from models.maps.gripper_poses import gripper_pose
from models.motion.planner import ActionPlanner
from models.rotations import rotation_z
from models.scenes import gripper
from models.scenes.planning_scene import HOME
from models.task.spaces import (
    CUBE_EDGE,
    LOST,
    N_FREE,
    POSITIONS,
    R_WO,
    REST_HEIGHT,
    Action,
    Kind,
    State,
)

LOOK_PERIOD = 0.1
"""Simulated time between two looks at whether the action is over [s]."""
TIME_LIMIT = 120.0
"""Simulated time after which a trial counts as a fault [s]."""


class ArmRig:
    """Station and executor, built once; every trial has a fresh context.

    ::

       request ──► ActionExecutor ──commands──► Station ──task.state, object.pose──► executor
    """

    def __init__(self, planner: ActionPlanner, config: TrialConfig) -> None:
        """Assemble the diagram.

        Args:
            planner: plans the actions.
            config: of the trials it is for, which says whether cubes fall by CENIC.
        """
        builder = DiagramBuilder()
        self.planner = planner
        self.falls = (
            FallScene(edge=True, accuracy=config.landing_accuracy)
            if config.solver == "cenic"
            else None
        )
        self.station = builder.AddNamedSystem("station", Station())
        self.executor = builder.AddNamedSystem("action_executor", ActionExecutor(planner))
        for name in ("task.state", "object.pose"):
            builder.Connect(self.station.GetOutputPort(name), self.executor.GetInputPort(name))
        for name in ("arm.position_command", "gripper.position_command"):
            builder.Connect(self.executor.GetOutputPort(name), self.station.GetInputPort(name))
        builder.ExportInput(self.executor.GetInputPort("request"), "request")
        self.diagram = builder.Build()


def run_arm_trial(
    rig: ArmRig, config: TrialConfig, pair: Pair, seed: int | np.random.SeedSequence
) -> TrialRecord:
    """Run one trial; the record depends on configuration, pair and seed alone.

    Grasps do so up to rounding: the arm's inverse kinematics at a measured pose was seen to differ
    in the last bits from process to process, and the record's numbers by 1e-12, never its outcome.
    Of the noise, the gripper's tilt is left out: the arm's own errors take its place.

    Args:
        rig: built for the configuration.
        config: noise, and how long to hold before the action.
        pair: what is tried; feasible by the rig's map.
        seed: of the noise.
    """
    started = time.process_time()
    record = begin(
        lambda noise: _course(rig, config, pair, noise), config, np.random.default_rng(seed)
    )
    return replace(record, cpu_s=time.process_time() - started)


def _course(rig: ArmRig, config: TrialConfig, pair: Pair, noise: Noise) -> TrialRecord:
    """Stand in the state with the noise, execute the action, read what came of it.

    Raises:
        NotHeld: if the hand does not hold the cube that the state has in it.
        SimulatorFault: if Drake fails.
    """
    state = State.from_index(pair.state)
    begun = _initial(rig.planner, state, noise)
    if begun is None:
        return _fault("the arm does not reach the state to begin with")
    q, width, X_WO = begun
    simulator = Simulator(rig.diagram)
    root = simulator.get_mutable_context()
    station, plant = rig.station, rig.station.plant
    set_friction(plant, station.scene_graph, root, noise.friction)
    set_cube_mass(plant, plant.GetMyMutableContextFromRoot(root), noise.mass)
    station.initialize(root, X_WO=X_WO, q=q, width=width)
    executor = rig.executor.GetMyMutableContextFromRoot(root)
    rig.executor.start_at(executor, q, 0.0 if state.is_grasp else width)
    request = rig.diagram.GetInputPort("request")
    request.FixValue(root, [0, -1])
    with simulating():
        simulator.Initialize()
    restitution = RESTITUTION if noise.restitution is None else noise.restitution
    simulation = StationSimulator(simulator, plant, rig.falls, restitution)
    simulation.advance_to(2 * config.settle_s)
    outputs = station.GetMyContextFromRoot(root)

    def measured(port: str) -> float:
        return float(station.GetOutputPort(port).Eval(outputs)[0])

    if state.is_grasp and not _is_held(measured("task.state")):
        raise NotHeld

    request.FixValue(root, [1, pair.action])
    execution = Execution()
    while not (execution.sequence and execution.finished):
        if root.get_time() > TIME_LIMIT:
            return _fault("the action did not end")
        simulation.advance_to(root.get_time() + LOOK_PERIOD)
        execution = rig.executor.execution(executor)
        if execution.failure:
            return _fault(f"no plan: {execution.reason}")
    simulation.advance_to(root.get_time() + SETTLE)

    after = int(measured("task.state"))
    verdict = judge_pose(
        station.GetOutputPort("object.pose").Eval(outputs),
        state,
        _intended(state, Action.from_index(pair.action)),
        held=_is_held(after),
        next_state=after,
    )
    return replace(
        verdict,
        pad_force=measured("gripper.force_measured"),
        opening=measured("gripper.position_measured"),
    )


def _fault(reason: str) -> TrialRecord:
    """A trial that judges nothing, for another reason than a failure of the simulator."""
    return TrialRecord(Outcome.FAULT, fault=reason)


def _initial(
    planner: ActionPlanner, state: State, noise: Noise
) -> tuple[np.ndarray, float, RigidTransform] | None:
    """Joint angles, opening and pose of the cube that a trial begins with; None if out of reach."""
    if state.gripper is None:
        p_WO = POSITIONS[state.position] + np.array([noise.x, noise.y, 0.0])
        p_WO[2] = REST_HEIGHT
        R = rotation_z(noise.yaw) @ R_WO[state.orientation]
        return HOME, gripper.MAX_OPENING, RigidTransform(RotationMatrix(R), p_WO)
    q = planner.posture(state.position, state.gripper)
    if q is None:
        return None
    X_GO = held_pose(state.orientation, state.gripper, noise)
    extent = CUBE_EDGE * float(np.abs(X_GO.rotation().matrix()[1]).sum())
    return q, extent + 1e-4, gripper_pose(POSITIONS[state.position], state.gripper) @ X_GO


def _is_held(state: float | np.ndarray) -> bool:
    """Whether a state's index is of a cube in the hand."""
    return bool(N_FREE <= state < LOST)


def _intended(state: State, action: Action) -> np.ndarray:
    """Where the cube's centre would be if the action went as meant ``[3]`` [m]."""
    if action.kind == Kind.TRANSLATE and action.target is not None:
        return POSITIONS[action.target]
    if action.kind == Kind.GRASP:
        return np.array([*POSITIONS[state.position][:2], REST_HEIGHT])
    return POSITIONS[state.position]
