"""One Bernoulli experiment with a floating gripper: any of the four actions (thesis 4.1.3, 5.9).

What happens between pads, cube and table does not need the arm, so a gantry carries the
gripper. A trial draws a noisy initial state, executes one action, lets things settle, and
records the outcome with every number behind the verdict.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from diagrams.state_identifier import identify_state, is_held
from diagrams.trials.initial_state import Creeps, NotHeld, begin, held_pose
from diagrams.trials.record import Noise, Pair, TrialConfig, TrialRecord
from diagrams.trials.references import SPEED, TURN_SPEED
from diagrams.trials.rig import TrialRig
from diagrams.trials.scene import TrialScene
from diagrams.trials.verdict import judge_pose
from models.maps.gripper_poses import grasp_position
from models.rotations import matrix_to_rotation_vector, rotation_vector_to_matrix
from models.scenes import gripper
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
FINER = 10.0
"""By how much smaller the error is with which a trial begins anew."""
STILL = 3e-5
"""How far a cube that lies still in the hand moves in it, in the last `settle_s` [m]."""


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
        rig: built for the configuration.
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

    def attempt(noise: Noise) -> TrialRecord:
        accuracy = None
        while True:
            try:
                return course(noise, accuracy)
            except Creeps as creeps:
                accuracy = max(creeps.accuracy / FINER, config.creeping_accuracy)

    def course(noise: Noise, accuracy: float | None) -> TrialRecord:
        tilt = rotation_vector_to_matrix([noise.gripper_roll, noise.gripper_pitch, 0.0])
        material = {name: getattr(noise, name) for name in ("friction", "mass", "restitution")}
        scene = TrialScene(rig, R_WG[hand] @ tilt, turn_W, **material, accuracy=accuracy)
        turned_further = replace(noise, turn_about_closing=noise.turn_about_closing + turned)
        return _COURSES[action.kind](_Attempt(scene, config, state, action, turned_further))

    record = begin(attempt, config, np.random.default_rng(seed))
    return replace(record, cpu_s=time.process_time() - started)


@dataclass(frozen=True)
class _Attempt:
    """One trial under way: a scene, and what is to happen in it."""

    scene: TrialScene
    config: TrialConfig
    state: State
    action: Action
    noise: Noise


@dataclass(frozen=True)
class _Grip:
    """How the hand has the cube before it lifts or carries it.

    Attributes:
        X_GO: the cube in the gripper; in a held state, as it was put there.
        opening: of the pads [m].
        pad_force: of each [N].
    """

    X_GO: RigidTransform
    opening: float
    pad_force: float


@dataclass(frozen=True)
class _Slip:
    """Motion of the cube in the gripper since it was gripped: metres, and radians."""

    distance: float
    angle: float


def _grasp(trial: _Attempt) -> TrialRecord:
    """Close on a cube at rest, lift it to the held layer."""
    scene, noise, target = trial.scene, trial.noise, trial.action.target
    assert target is not None
    offset = np.array([noise.x, noise.y, 0.0])
    p_nominal = _at_rest(POSITIONS[trial.state.position])
    R_before = rotation_vector_to_matrix([0.0, 0.0, noise.yaw]) @ R_WO[trial.state.orientation]
    p_WG = grasp_position(p_nominal, target) + offset
    scene.start(p_WG, gripper.MAX_OPENING, RigidTransform(RotationMatrix(R_before), p_nominal))
    scene.command(p_WG, 0.0)
    scene.advance(trial.config.close_s)
    grip = _Grip(scene.X_GO, scene.opening, scene.pad_force)
    p_WG[2] = GRID_Z[0]
    scene.command(p_WG, 0.0)
    scene.advance((GRID_Z[0] - REST_HEIGHT) / SPEED + trial.config.settle_s)
    return _judge(trial, p_nominal, grip, _slip(scene, grip))


def _carry(trial: _Attempt) -> TrialRecord:
    """Hold the cube as a grasp leaves it, and bring the hand to its target."""
    scene, action = trial.scene, trial.action
    grip = _hold(trial)
    goal, seconds = POSITIONS[trial.state.position], scene.turn_angle / TURN_SPEED
    if action.kind == Kind.TRANSLATE and action.target is not None:
        start, goal = goal, POSITIONS[action.target]
        seconds = float(np.abs(goal - start).max()) / SPEED
    scene.command(goal, 0.0, turned=True)
    scene.advance(seconds + trial.config.settle_s)
    if not _holds(scene):
        _come_to_rest(trial)
    return _judge(trial, goal, grip, _slip(scene, grip))


def _drop(trial: _Attempt) -> TrialRecord:
    """Hold the cube as a grasp leaves it, open, withdraw, wait for rest."""
    scene, p_WG = trial.scene, POSITIONS[trial.state.position]
    grip = _hold(trial)
    slip = _slip(scene, grip)
    scene.command(p_WG, gripper.MAX_OPENING)
    if trial.noise.restitution is not None:
        scene.let_go()
        scene.land(opens=True, rise=WITHDRAWAL, limit=trial.config.rest_limit_s)
        return _judge(trial, p_WG, grip, slip)
    scene.advance(trial.config.release_s)
    scene.command(p_WG + np.array([0.0, 0.0, WITHDRAWAL]), gripper.MAX_OPENING)
    scene.advance(WITHDRAWAL / SPEED)
    _come_to_rest(trial)
    return _judge(trial, p_WG, grip, slip)


_COURSES: dict[Kind, Callable[[_Attempt], TrialRecord]] = {
    Kind.GRASP: _grasp,
    Kind.TRANSLATE: _carry,
    Kind.ROTATE: _carry,
    Kind.DROP: _drop,
}


def _hold(trial: _Attempt) -> _Grip:
    """Begin with the cube in the closed hand.

    Raises:
        NotHeld: if the hand does not hold it.
        Creeps: if it moves in the hand, and the error can be smaller.
    """
    scene, state = trial.scene, trial.state
    assert state.gripper is not None
    p_WG = POSITIONS[state.position]
    X_GO = held_pose(state.orientation, state.gripper, trial.noise)
    closing_extent = CUBE_EDGE * float(np.abs(X_GO.rotation().matrix()[1]).sum())
    X_WG = RigidTransform(scene.X_WG.rotation(), p_WG)
    scene.start(p_WG, closing_extent + 5e-4, X_WG @ X_GO)
    scene.support(True)
    scene.command(p_WG, 0.0)
    scene.advance(trial.config.settle_s)
    scene.support(False)
    before = scene.X_GO.translation()
    scene.advance(trial.config.settle_s)
    moved = float(np.linalg.norm(scene.X_GO.translation() - before))
    if not _holds(scene):
        raise NotHeld
    if moved > STILL and scene.accuracy > trial.config.creeping_accuracy:
        raise Creeps(scene.accuracy)
    scene.relax()
    return _Grip(X_GO, scene.opening, scene.pad_force)


def _come_to_rest(trial: _Attempt) -> None:
    """Wait for a cube that is not held, in the scene it is in if there is no other."""
    if trial.noise.restitution is not None:
        trial.scene.land(opens=False, rise=0.0, limit=trial.config.rest_limit_s)
        return
    scene, deadline = trial.scene, trial.scene.time + trial.config.rest_limit_s
    while scene.cube_speed > REST_SPEED and scene.time < deadline:
        scene.advance(trial.config.settle_s)


def _at_rest(p_W: np.ndarray) -> np.ndarray:
    return np.array([p_W[0], p_W[1], REST_HEIGHT])


def _holds(scene: TrialScene) -> bool:
    return is_held(scene.X_GO.translation(), scene.opening, scene.pad_force)


def _slip(scene: TrialScene, grip: _Grip) -> _Slip:
    X_GO = scene.X_GO
    distance = np.linalg.norm(X_GO.translation() - grip.X_GO.translation())
    change = grip.X_GO.inverse() @ X_GO
    return _Slip(float(distance), float(change.rotation().ToAngleAxis().angle()))


def _judge(trial: _Attempt, p_nominal: np.ndarray, grip: _Grip, slip: _Slip) -> TrialRecord:
    """What became of the cube by now, and every number behind it."""
    scene = trial.scene
    X_WO, held = scene.X_WO, _holds(scene)
    next_state = identify_state(X_WO, scene.X_WG, held)
    return replace(
        judge_pose(X_WO, trial.state, p_nominal, held=held, next_state=next_state),
        clearance=scene.clearance,
        slip=slip.distance,
        in_hand_rotation=slip.angle,
        pad_force=grip.pad_force,
        opening=grip.opening,
        speed=scene.cube_speed,
    )
