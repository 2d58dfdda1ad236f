"""What inverse kinematics answers: joint angles, or the reason why there are none."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from pydrake.math import RigidTransform

from models.gen3.nearest import LIMIT_WEIGHT, LIMIT_ZONE
from models.scenes.planning_scene import Clearance, PlanningScene

POSITION_TOLERANCE = 1e-5
"""Largest position error of an answer [m]."""
ANGLE_TOLERANCE = 1e-5
"""Largest rotation error of an answer [rad]."""


class Failure(StrEnum):
    """Why no configuration is returned; only `OUT_OF_REACH` and `BLOCKED` prove that none exists.

    The order is that of a search: each says how far the best candidate came.
    """

    OUT_OF_REACH = "out of reach"
    """The wrist would be further from the shoulder than the arm is long, or, of a Gen3, nearer
    than joint 4 can fold it."""
    NOT_FOUND = "not found"
    """No posture that was tried meets the pose."""
    JOINT_LIMIT = "joint limit"
    """Postures meet the pose, but all that were found are beyond a joint limit."""
    SELF_COLLISION = "self-collision"
    """The robot is in its own way in all that were found."""
    COLLISION = "collision"
    """All that were found collide, at least the best of them with something else."""
    BLOCKED = "hand blocked"
    """The hand itself, placed at the pose, is too near to the furniture or the cube."""


@dataclass(frozen=True)
class IkSolution:
    """The answer to one inverse-kinematics question.

    Attributes:
        q: joint angles [rad], one a joint; None if there is no answer.
        clearance: clearance of ``q``, or of the best rejected candidate.
        failure: None on success.
        attempts: values of the redundancy parameter, solutions or starting points that were tried.
    """

    q: np.ndarray | None
    clearance: Clearance | None
    failure: Failure | None
    attempts: int

    def reason(self) -> str:
        """Why there is no answer, for a person: the failure, and what collides by how much."""
        if self.failure is None:
            return "solved"
        if self.clearance is None or self.clearance.bodies is None:
            return str(self.failure)
        between = " and ".join(self.clearance.bodies)
        return f"{self.failure}: {1e3 * self.clearance.distance:.1f} mm between {between}"


def reaches(scene: PlanningScene, q: np.ndarray, X_WG: RigidTransform) -> bool:
    """Whether ``q [7]`` meets ``X_WG`` within the tolerances, and the joint limits."""
    position, angle = scene.error(q, X_WG)
    exact = position <= POSITION_TOLERANCE and angle <= ANGLE_TOLERANCE
    return exact and scene.within_limits(q)


def collision_failure(scene: PlanningScene, clearance: Clearance) -> Failure:
    """`SELF_COLLISION` if both bodies are the robot's, else `COLLISION`."""
    own = all(scene.is_robots(name) for name in clearance.bodies or ())
    return Failure.SELF_COLLISION if own else Failure.COLLISION


def posture_cost(scene: PlanningScene, q: np.ndarray, seed: np.ndarray) -> np.ndarray:
    """How far postures ``q [..., n]`` are from ``seed``, and how near to their limits [rad]."""
    room = np.minimum(q - scene.lower, scene.upper - q)
    short = np.clip(1.0 - room / LIMIT_ZONE, 0.0, None)
    return np.linalg.norm(q - seed, axis=-1) + LIMIT_WEIGHT * (short**2).sum(axis=-1)
