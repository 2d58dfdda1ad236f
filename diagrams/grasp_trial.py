"""One Bernoulli experiment with a floating gripper: grasp the cube, or drop it (thesis 4.1.3, 5.9).

What happens between pads, cube and table does not need the arm, so three slides carry the
gripper. A trial draws a noisy initial state, executes one action, lets things settle, and
records the outcome with every number behind the verdict.
"""

import time

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from diagrams.state_identifier import is_held
from diagrams.trial_record import Outcome, Pair, TrialConfig, TrialRecord
from diagrams.trial_rig import COLUMN, SPEED, TrialRig, TrialScene
from models import gripper
from models.gripper_poses import RETREAT, grasp_position
from models.rotations import (
    geodesic_angle,
    matrix_to_rotation_vector,
    rotation_vector_to_matrix,
)
from models.task.spaces import CUBE_EDGE, GRID_Z, R_WG, R_WO, REST_HEIGHT, Kind

FLUSH_LIMIT = np.radians(22.5)
"""Largest misalignment [rad] that closing fingers turn flush; beyond it edges jam."""
WITHDRAWAL = 0.1
"""How far the open gripper rises after a release [m]."""
REST_SPEED = 1e-3
"""Of a cube that counts as at rest [m/s]."""


def run_trial(
    rig: TrialRig, config: TrialConfig, pair: Pair, seed: int | np.random.SeedSequence
) -> TrialRecord:
    """Run one trial; the record depends on configuration, pair and seed alone.

    Args:
        rig: built with the configuration's time step.
        config: course and noise.
        pair: what is tried.
        seed: of the noise.
    """
    started = time.process_time()
    noise = draw_noise(config, np.random.default_rng(seed))
    tilt = rotation_vector_to_matrix([noise["gripper_roll"], noise["gripper_pitch"], 0.0])
    try:
        scene = TrialScene(
            rig,
            RotationMatrix(R_WG[pair.gripper] @ tilt),
            friction=noise["friction"],
            mass=noise["mass"],
        )
        course = _grasp if pair.kind == Kind.GRASP else _drop
        record = course(scene, config, pair, noise)
    except RuntimeError as error:  # Drake reports a failed solver step this way.
        record = {"outcome": Outcome.FAULT, "fault": str(error).splitlines()[0]}
    return TrialRecord(noise=noise, cpu_s=time.process_time() - started, **record)


def draw_noise(config: TrialConfig, rng: np.random.Generator) -> dict[str, float]:
    """Draw every random quantity of a trial, always all and in the same order."""
    return {
        "x": rng.normal(0.0, config.position_sd),
        "y": rng.normal(0.0, config.position_sd),
        "yaw": rng.normal(0.0, config.yaw_sd),
        "turn_about_closing": rng.normal(0.0, config.tilt_sd),
        "gripper_roll": rng.normal(0.0, config.tilt_sd),
        "gripper_pitch": rng.normal(0.0, config.tilt_sd),
        "friction": rng.uniform(*config.friction),
        "mass": rng.uniform(*config.mass),
    }


def held_pose(pair: Pair, noise: dict[str, float]) -> RigidTransform:
    """X_GO with which a held state begins: what a grasp would have left, and noise.

    Closing turns a nearly flush cube flush; one that is further off is held by its edges. A
    cube that shows the palm an edge was grasped with the fingers drawn back.
    """
    R_GO = R_WG[pair.gripper].T @ R_WO[pair.orientation]
    flush = R_GO @ turn_to_flush(R_GO)
    if geodesic_angle(R_GO, flush) < FLUSH_LIMIT:
        R_GO = flush
    R_GO = rotation_vector_to_matrix([0.0, noise["turn_about_closing"], 0.0]) @ R_GO
    depth = 0.5 * CUBE_EDGE * np.abs(R_GO[2]).sum()
    drawn_back = RETREAT if depth > 0.6 * CUBE_EDGE else 0.0
    # Within the pads' plane; across it the fingers centre the cube.
    return RigidTransform(RotationMatrix(R_GO), [noise["x"], 0.0, noise["y"] + drawn_back])


def turn_to_flush(R_GO: np.ndarray) -> np.ndarray:
    """Smallest turn, in the cube's frame, that lays a face's normal along the closing axis.

    Args:
        R_GO: the cube's orientation in the gripper ``[3, 3]``.

    Returns:
        ``turn [3, 3]``, such that ``R_GO @ turn`` is flush.
    """
    closing_O = R_GO[1]
    normal_O = np.zeros(3)
    nearest = int(np.abs(closing_O).argmax())
    normal_O[nearest] = np.sign(closing_O[nearest])
    axis = np.cross(closing_O, normal_O)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.eye(3)
    angle = np.arctan2(sine, float(closing_O @ normal_O))
    # R_GO · turn has the normal as its closing row: rotate the closing axis onto it.
    return rotation_vector_to_matrix(-angle * axis / sine)


def _grasp(scene: TrialScene, config: TrialConfig, pair: Pair, noise: dict[str, float]) -> dict:
    """Close on a cube at rest, lift it to the held layer."""
    offset = np.array([noise["x"], noise["y"], 0.0])
    p_nominal = np.array([*COLUMN, REST_HEIGHT])
    R_before = rotation_vector_to_matrix([0.0, 0.0, noise["yaw"]]) @ R_WO[pair.orientation]
    p_WG = grasp_position(p_nominal, pair.gripper) + offset
    scene.start(p_WG, gripper.MAX_OPENING, RigidTransform(RotationMatrix(R_before), p_nominal))
    scene.command(p_WG, 0.0)
    scene.advance(config.close_s)
    grip, X_GO = _grip(scene), scene.X_GO
    p_WG[2] = GRID_Z[0]
    scene.command(p_WG, 0.0)
    scene.advance((GRID_Z[0] - REST_HEIGHT) / SPEED + config.settle_s)
    held = is_held(scene.X_GO.translation(), scene.opening, scene.pad_force)
    return {
        "outcome": Outcome.HELD if held else Outcome.FREE,
        **_change(scene, pair, p_nominal),
        **_in_hand(scene, X_GO),
        **grip,
    }


def _drop(scene: TrialScene, config: TrialConfig, pair: Pair, noise: dict[str, float]) -> dict:
    """Hold the cube as a grasp leaves it, open, withdraw, wait for rest."""
    p_WG = np.array([*COLUMN, GRID_Z[pair.layer]])
    X_GO = held_pose(pair, noise)
    closing_extent = CUBE_EDGE * float(np.abs(X_GO.rotation().matrix()[1]).sum())
    scene.start(p_WG, closing_extent + 5e-4, RigidTransform(scene.R_WG, p_WG) @ X_GO)
    scene.support(True)
    scene.command(p_WG, 0.0)
    scene.advance(config.settle_s)
    scene.support(False)
    scene.advance(config.settle_s)
    before = {**_grip(scene), **_in_hand(scene, X_GO)}
    scene.command(p_WG, gripper.MAX_OPENING)
    scene.advance(config.release_s)
    scene.command(p_WG + np.array([0.0, 0.0, WITHDRAWAL]), gripper.MAX_OPENING)
    scene.advance(WITHDRAWAL / SPEED)
    deadline = scene.time + config.rest_limit_s
    while scene.cube_speed > REST_SPEED and scene.time < deadline:
        scene.advance(config.settle_s)
    return {"outcome": Outcome.FREE, **_change(scene, pair, p_WG), **before}


def _grip(scene: TrialScene) -> dict[str, float]:
    return {"opening": scene.opening, "pad_force": scene.pad_force}


def _change(scene: TrialScene, pair: Pair, p_nominal: np.ndarray) -> dict:
    """How the cube's pose differs from the nominal one now, and whether it still moves."""
    X_WO = scene.X_WO
    turn = X_WO.rotation().matrix() @ R_WO[pair.orientation].T
    return {
        "turn": tuple(float(v) for v in matrix_to_rotation_vector(turn)),
        "displacement": tuple(float(v) for v in X_WO.translation() - p_nominal),
        "lift_height": float(X_WO.translation()[2] - REST_HEIGHT),
        "speed": scene.cube_speed,
    }


def _in_hand(scene: TrialScene, X_GO_before: RigidTransform) -> dict[str, float]:
    """Motion of the cube in the gripper since it was at ``X_GO_before``."""
    X_GO = scene.X_GO
    change = X_GO_before.inverse() @ X_GO
    return {
        "slip": float(np.linalg.norm(X_GO.translation() - X_GO_before.translation())),
        "in_hand_rotation": float(change.rotation().ToAngleAxis().angle()),
    }
