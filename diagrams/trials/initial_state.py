"""How a trial begins: the noise it draws, and how a held cube lies in the hand."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from diagrams.faults import SimulatorFault
from diagrams.trials.record import Noise, Outcome, TrialConfig, TrialRecord
from models.maps.gripper_poses import RETREAT
from models.rotations import geodesic_angle, rotation_vector_to_matrix
from models.task.spaces import CUBE_EDGE, R_WG, R_WO

FLUSH_LIMIT = np.radians(22.5)
"""Largest misalignment [rad] that closing fingers turn flush; beyond it edges jam."""
MOST_DRAWS = 10
"""Of initial states, until the hand holds the cube; one in two hundred is not held."""


def draw_noise(config: TrialConfig, rng: np.random.Generator) -> Noise:
    """Draw every random quantity of a trial, always all and in the same order."""
    return Noise(
        x=rng.normal(0.0, config.position_sd),
        y=rng.normal(0.0, config.position_sd),
        yaw=rng.normal(0.0, config.yaw_sd),
        turn_about_closing=rng.normal(0.0, config.tilt_sd),
        gripper_roll=rng.normal(0.0, config.tilt_sd),
        gripper_pitch=rng.normal(0.0, config.tilt_sd),
        friction=rng.uniform(*config.friction),
        mass=rng.uniform(*config.mass),
        restitution=rng.uniform(*config.restitution) if config.solver == "cenic" else None,
    )


class NotHeld(Exception):  # noqa: N818 - an answer rather than an error
    """The hand lost the cube before the action began, so that there was nothing to try."""


class Creeps(Exception):  # noqa: N818 - likewise
    """The cube does not lie still in the closed hand, which may be about to squeeze it out."""

    def __init__(self, accuracy: float) -> None:
        """Say by what ``accuracy`` of the integrator it does."""
        super().__init__(f"it creeps, at an accuracy of {accuracy:g}")
        self.accuracy = accuracy


def begin(
    attempt: Callable[[Noise], TrialRecord], config: TrialConfig, rng: np.random.Generator
) -> TrialRecord:
    """Draw initial states until one is what the trial's state names, and try the action from it.

    A held state is one that a grasp has left. With some of the noise the fingers squeeze the cube
    out as soon as they close: no grasp leaves that.

    Args:
        attempt: runs the trial with given noise.
        config: the noise.
        rng: draws it.

    Returns:
        What ``attempt`` returned, with noise and draws; a simulator's failure as a fault.
    """
    for draws in range(1, MOST_DRAWS + 1):
        noise = draw_noise(config, rng)
        try:
            record = attempt(noise)
        except NotHeld:
            continue
        except SimulatorFault as fault:
            record = TrialRecord(Outcome.FAULT, fault=fault.text)
        return replace(record, noise=noise, draws=draws)
    never = f"the hand held the cube in none of {MOST_DRAWS} initial states"
    return TrialRecord(Outcome.FAULT, fault=never, noise=noise, draws=MOST_DRAWS)


def held_pose(orientation: int, gripper: int, noise: Noise) -> RigidTransform:
    """X_GO with which a held state begins: what a grasp would have left, and noise.

    Closing turns a nearly flush cube flush; one that is further off is held by its edges. A
    cube that shows the palm an edge was grasped with the fingers drawn back.

    Args:
        orientation: the cube's nominal orientation 0…47.
        gripper: gripper orientation 0…17.
        noise: as `draw_noise` gives it.
    """
    R_GO = settle_in_hand(R_WG[gripper].T @ R_WO[orientation])
    R_GO = rotation_vector_to_matrix([0.0, noise.turn_about_closing, 0.0]) @ R_GO
    depth = 0.5 * CUBE_EDGE * np.abs(R_GO[2]).sum()
    drawn_back = RETREAT if depth > 0.6 * CUBE_EDGE else 0.0
    # Within the pads' plane; across it the fingers centre the cube.
    return RigidTransform(RotationMatrix(R_GO), [noise.x, 0.0, noise.y + drawn_back])


def settle_in_hand(R_GO: np.ndarray) -> np.ndarray:
    """Orientation ``[3, 3]`` of the cube in the gripper once the fingers have closed on it."""
    flush = R_GO @ turn_to_flush(R_GO)
    return flush if geodesic_angle(R_GO, flush) < FLUSH_LIMIT else R_GO


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
