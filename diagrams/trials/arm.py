"""One Bernoulli experiment with the whole arm, as the robot would really do it (thesis 5.8.2).

Where a trial with the floating gripper leaves the arm out, this one is the station itself: the
arm stands in the nominal state, the action is planned and executed, and the state identifier
says what came of it. Slower, and no part of the transition model: it is what the model is held
against.
"""

import time
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from diagrams.action_executor import ActionExecutor
from diagrams.contact import set_cube_mass, set_friction
from diagrams.policy_controller import SETTLE
from diagrams.station import Station
from diagrams.trials.initial_state import Noise, NotHeldError, begin, held_pose
from diagrams.trials.record import Outcome, Pair, TrialConfig, TrialRecord
from models.maps.gripper_poses import gripper_pose
from models.motion.planner import ActionPlanner
from models.rotations import matrix_to_rotation_vector, rotation_z
from models.scenes import gripper
from models.scenes.planning_scene import HOME
from models.task.discretise import nearest_orientation
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

    def __init__(self, planner: ActionPlanner, time_step: float) -> None:
        """Assemble the diagram.

        Args:
            planner: plans the actions.
            time_step: of the discrete solver [s].
        """
        builder = DiagramBuilder()
        self.planner = planner
        self.station = builder.AddNamedSystem("station", Station(time_step=time_step))
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
        rig: built with the configuration's time step.
        config: noise, and how long to hold before the action.
        pair: what is tried; feasible by the rig's map.
        seed: of the noise.
    """
    started = time.process_time()
    state = State.from_index(pair.state)
    record = begin(
        lambda noise: _course(rig, config, pair, state, noise),
        config,
        np.random.default_rng(seed),
    )
    return TrialRecord(cpu_s=time.process_time() - started, **record)


def _course(
    rig: ArmRig, config: TrialConfig, pair: Pair, state: State, noise: Noise
) -> dict[str, Any]:
    simulator = Simulator(rig.diagram)
    root = simulator.get_mutable_context()
    station, plant = rig.station, rig.station.plant
    set_friction(plant, station.scene_graph, root, noise["friction"])
    set_cube_mass(plant, plant.GetMyMutableContextFromRoot(root), noise["mass"])
    q, width, X_WO = _initial(rig.planner, state, noise)
    station.initialize(root, X_WO=X_WO, q=q, width=width)
    executor = rig.executor.GetMyMutableContextFromRoot(root)
    rig.executor.start_at(executor, q, 0.0 if state.is_grasp else width)
    request = rig.diagram.GetInputPort("request")
    request.FixValue(root, [0, -1])
    simulator.Initialize()
    simulator.AdvanceTo(2 * config.settle_s)
    outputs = station.GetMyContextFromRoot(root)
    if state.is_grasp and not _is_held(station.GetOutputPort("task.state").Eval(outputs)):
        raise NotHeldError

    request.FixValue(root, [1, pair.action])
    while True:
        simulator.AdvanceTo(root.get_time() + LOOK_PERIOD)
        execution = rig.executor.execution(executor)
        if execution.failure:
            return {"outcome": Outcome.FAULT, "fault": f"no plan: {execution.failure}"}
        if execution.sequence and execution.finished:
            break
        if root.get_time() > TIME_LIMIT:
            return {"outcome": Outcome.FAULT, "fault": "the action did not end"}
    simulator.AdvanceTo(root.get_time() + SETTLE)

    after = int(station.GetOutputPort("task.state").Eval(outputs)[0])
    X_WO_after = station.GetOutputPort("object.pose").Eval(outputs)
    R_WO_after = X_WO_after.rotation().matrix()
    displacement = X_WO_after.translation() - _intended(state, Action.from_index(pair.action))
    turn = matrix_to_rotation_vector(R_WO_after @ R_WO[state.orientation].T)
    return {
        "outcome": Outcome.HELD if _is_held(after) else Outcome.FREE,
        "next_state": after,
        "turn": tuple(turn.tolist()),
        "displacement": tuple(displacement.tolist()),
        "snap_angle": float(nearest_orientation(R_WO_after)[1]),
        "drift": float(np.hypot(displacement[0], displacement[1])),
        "lift_height": float(X_WO_after.translation()[2] - REST_HEIGHT),
        "pad_force": float(station.GetOutputPort("gripper.force_measured").Eval(outputs)[0]),
        "opening": float(station.GetOutputPort("gripper.position_measured").Eval(outputs)[0]),
    }


def _initial(
    planner: ActionPlanner, state: State, noise: Noise
) -> tuple[np.ndarray, float, RigidTransform]:
    """Joint angles, opening and pose of the cube with which a trial begins."""
    if state.gripper is None:
        p_WO = POSITIONS[state.position] + np.array([noise["x"], noise["y"], 0.0])
        p_WO[2] = REST_HEIGHT
        R = rotation_z(noise["yaw"]) @ R_WO[state.orientation]
        return HOME, gripper.MAX_OPENING, RigidTransform(RotationMatrix(R), p_WO)
    q = planner.posture(state.position, state.gripper)
    if q is None:
        raise RuntimeError("the arm does not reach the state to begin with")
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
