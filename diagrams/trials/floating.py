"""One Bernoulli experiment with a floating gripper: any of the four actions (thesis 4.1.3, 5.9).

What happens between pads, cube and table does not need the arm, so a gantry carries the
gripper. A trial draws a noisy initial state, executes one action, lets things settle, and
records the outcome with every number behind the verdict.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from diagrams.state_identifier import is_held
from diagrams.trials.initial_state import Noise, NotHeldError, begin, held_pose
from diagrams.trials.record import Outcome, Pair, TrialConfig, TrialRecord
from diagrams.trials.rig import SPEED, TURN_SPEED, TrialRig, TrialScene
from models.maps.gripper_poses import grasp_position
from models.rotations import matrix_to_rotation_vector, rotation_vector_to_matrix
from models.scenes import gripper
from models.task.discretise import identify
from models.task.spaces import (
    CUBE_EDGE,
    GRID_Z,
    POSITIONS,
    R_WG,
    R_WO,
    REST_HEIGHT,
    Action,
    Kind,
    State,
)

WITHDRAWAL = 0.1
"""How far the open gripper rises after a release [m]."""
REST_SPEED = 1e-3
"""Of a cube that counts as at rest [m/s]."""


def run_trial(
    rig: TrialRig,
    config: TrialConfig,
    pair: Pair,
    seed: int | np.random.SeedSequence,
    *,
    turned: float = 0.0,
) -> TrialRecord:
    """Run one trial; the record depends on configuration, pair, seed and turn alone.

    Args:
        rig: built with the configuration's time step.
        config: course and noise.
        pair: what is tried.
        seed: of the noise.
        turned: how far a held cube is turned about the closing axis, noise apart [rad].
    """
    started = time.process_time()
    state, action = State.from_index(pair.state), Action.from_index(pair.action)
    hand = action.target if action.kind == Kind.GRASP else state.gripper
    assert hand is not None
    turn_W = None
    if action.kind == Kind.ROTATE and action.target is not None:
        turn_W = matrix_to_rotation_vector(R_WG[action.target] @ R_WG[hand].T)

    def attempt(noise: Noise) -> dict[str, Any]:
        noise["turn_about_closing"] += turned
        tilt = rotation_vector_to_matrix([noise["gripper_roll"], noise["gripper_pitch"], 0.0])
        scene = TrialScene(
            rig, R_WG[hand] @ tilt, turn_W, friction=noise["friction"], mass=noise["mass"]
        )
        return _COURSES[action.kind](scene, config, state, action, noise)

    record = begin(attempt, config, np.random.default_rng(seed))
    return TrialRecord(cpu_s=time.process_time() - started, **record)


def _grasp(
    scene: TrialScene, config: TrialConfig, state: State, action: Action, noise: Noise
) -> dict[str, Any]:
    """Close on a cube at rest, lift it to the held layer."""
    assert action.target is not None
    offset = np.array([noise["x"], noise["y"], 0.0])
    p_nominal = _at_rest(POSITIONS[state.position])
    R_before = rotation_vector_to_matrix([0.0, 0.0, noise["yaw"]]) @ R_WO[state.orientation]
    p_WG = grasp_position(p_nominal, action.target) + offset
    scene.start(p_WG, gripper.MAX_OPENING, RigidTransform(RotationMatrix(R_before), p_nominal))
    scene.command(p_WG, 0.0)
    scene.advance(config.close_s)
    grip, X_GO = _grip(scene), scene.X_GO
    p_WG[2] = GRID_Z[0]
    scene.command(p_WG, 0.0)
    scene.advance((GRID_Z[0] - REST_HEIGHT) / SPEED + config.settle_s)
    return {**_verdict(scene, state, p_nominal), **_in_hand(scene, X_GO), **grip}


def _carry(
    scene: TrialScene, config: TrialConfig, state: State, action: Action, noise: Noise
) -> dict[str, Any]:
    """Hold the cube as a grasp leaves it, and bring the hand to its target."""
    p_WG = POSITIONS[state.position]
    X_GO, grip = _hold(scene, config, state, noise)
    if action.kind == Kind.TRANSLATE and action.target is not None:
        goal = POSITIONS[action.target]
        seconds = float(np.abs(goal - p_WG).max()) / SPEED
    else:
        goal, seconds = p_WG, scene.turn_angle / TURN_SPEED
    scene.command(goal, 0.0, turned=True)
    scene.advance(seconds + config.settle_s)
    if not _holds(scene):
        _wait_for_rest(scene, config)
    return {**_verdict(scene, state, goal), **_in_hand(scene, X_GO), **grip}


def _drop(
    scene: TrialScene, config: TrialConfig, state: State, action: Action, noise: Noise
) -> dict[str, Any]:
    """Hold the cube as a grasp leaves it, open, withdraw, wait for rest."""
    p_WG = POSITIONS[state.position]
    X_GO, grip = _hold(scene, config, state, noise)
    moved = _in_hand(scene, X_GO)
    scene.command(p_WG, gripper.MAX_OPENING)
    scene.advance(config.release_s)
    scene.command(p_WG + np.array([0.0, 0.0, WITHDRAWAL]), gripper.MAX_OPENING)
    scene.advance(WITHDRAWAL / SPEED)
    _wait_for_rest(scene, config)
    return {**_verdict(scene, state, p_WG), **moved, **grip}


_COURSES: dict[Kind, Callable[..., dict[str, Any]]] = {
    Kind.GRASP: _grasp,
    Kind.TRANSLATE: _carry,
    Kind.ROTATE: _carry,
    Kind.DROP: _drop,
}


def _hold(
    scene: TrialScene, config: TrialConfig, state: State, noise: Noise
) -> tuple[RigidTransform, dict[str, float]]:
    """Begin with the cube in the closed hand; X_GO as begun, and the grip.

    Raises:
        NotHeldError: if the hand does not hold it.
    """
    assert state.gripper is not None
    p_WG = POSITIONS[state.position]
    X_GO = held_pose(state.orientation, state.gripper, noise)
    closing_extent = CUBE_EDGE * float(np.abs(X_GO.rotation().matrix()[1]).sum())
    X_WG = RigidTransform(scene.X_WG.rotation(), p_WG)
    scene.start(p_WG, closing_extent + 5e-4, X_WG @ X_GO)
    scene.support(True)
    scene.command(p_WG, 0.0)
    scene.advance(config.settle_s)
    scene.support(False)
    scene.advance(config.settle_s)
    if not _holds(scene):
        raise NotHeldError
    return X_GO, _grip(scene)


def _wait_for_rest(scene: TrialScene, config: TrialConfig) -> None:
    deadline = scene.time + config.rest_limit_s
    while scene.cube_speed > REST_SPEED and scene.time < deadline:
        scene.advance(config.settle_s)


def _at_rest(p_W: np.ndarray) -> np.ndarray:
    return np.array([p_W[0], p_W[1], REST_HEIGHT])


def _grip(scene: TrialScene) -> dict[str, float]:
    return {"opening": scene.opening, "pad_force": scene.pad_force}


def _holds(scene: TrialScene) -> bool:
    return is_held(scene.X_GO.translation(), scene.opening, scene.pad_force)


def _verdict(scene: TrialScene, state: State, p_nominal: np.ndarray) -> dict[str, Any]:
    """What became of the cube, and how its pose differs from the nominal one now."""
    X_WO, X_WG, held = scene.X_WO, scene.X_WG, _holds(scene)
    R_WO_after = X_WO.rotation().matrix()
    displacement = X_WO.translation() - p_nominal
    found = identify(
        R_WO_after, X_WO.translation(), X_WG.rotation().matrix(), X_WG.translation(), held
    )
    return {
        "outcome": Outcome.HELD if held else Outcome.FREE,
        "next_state": int(found.state),
        "turn": _floats(matrix_to_rotation_vector(R_WO_after @ R_WO[state.orientation].T)),
        "displacement": _floats(displacement),
        "snap_angle": float(found.orientation_angle),
        "drift": float(np.hypot(displacement[0], displacement[1])),
        "lift_height": float(X_WO.translation()[2] - REST_HEIGHT),
        "clearance": scene.clearance,
        "speed": scene.cube_speed,
    }


def _floats(vector: np.ndarray) -> tuple[float, ...]:
    return tuple(float(v) for v in vector)


def _in_hand(scene: TrialScene, X_GO_before: RigidTransform) -> dict[str, float]:
    """Motion of the cube in the gripper since it was at ``X_GO_before``."""
    X_GO = scene.X_GO
    change = X_GO_before.inverse() @ X_GO
    return {
        "slip": float(np.linalg.norm(X_GO.translation() - X_GO_before.translation())),
        "in_hand_rotation": float(change.rotation().ToAngleAxis().angle()),
    }
