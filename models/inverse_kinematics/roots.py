"""The Gen3 Lite's answer nearest to a posture: the nearest free one of all its solutions.

Six joints leave no redundancy: up to 16 postures meet a pose, and the polynomial gives them all.
"""

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from models.gen3_lite import chain
from models.gen3_lite.ik import solve, within_limits
from models.gen3_lite.polynomial import out_of_reach
from models.inverse_kinematics.arm_frames import ArmFrames
from models.inverse_kinematics.solution import (
    Failure,
    IkSolution,
    collision_failure,
    posture_cost,
    reaches,
)
from models.scenes.planning_scene import Clearance, PlanningScene


@dataclass(frozen=True)
class Roots:
    """The Gen3 Lite's polynomial in a scene.

    Attributes:
        scene: the robot and what to keep clear of.
        frames: what the arm's own chain has to do with the scene.
    """

    scene: PlanningScene
    frames: ArmFrames

    @classmethod
    def of(cls, scene: PlanningScene) -> "Roots | None":
        """The polynomial in a scene, None if its arm is not the Gen3 Lite."""
        frames = ArmFrames.of(scene, chain.LIMIT, chain.forward)
        return None if frames is None else cls(scene, frames)

    def solve(self, X_WG: RigidTransform, seed: np.ndarray, margin: float) -> IkSolution:
        """Look at every solution within the limits, the nearest first.

        Args:
            X_WG: wanted pose of the tool centre point.
            seed: what the answer is to be near to ``[6]`` [rad], by `posture_cost`.
            margin: smallest allowed distance [m].
        """
        R, p = self.frames.end_effector(X_WG)
        if out_of_reach(R, p):
            return IkSolution(None, None, Failure.OUT_OF_REACH, 0)
        every = solve(R, p)
        q = np.clip(every[within_limits(every)], self.scene.lower, self.scene.upper)
        best: Clearance | None = None
        for i in np.argsort(posture_cost(self.scene, q, seed), kind="stable"):
            if not reaches(self.scene, q[i], X_WG):
                continue
            clearance = self.scene.clearance(q[i], max(0.05, 2.0 * margin))
            if clearance.distance > margin:
                return IkSolution(q[i], clearance, None, len(every))
            if best is None and self.scene.hand_is_blocked(q[i], margin):
                return IkSolution(None, clearance, Failure.BLOCKED, len(every))
            if best is None or clearance.distance > best.distance:
                best = clearance
        if best is not None:
            return IkSolution(None, best, collision_failure(self.scene, best), len(every))
        failure = Failure.JOINT_LIMIT if len(every) else Failure.NOT_FOUND
        return IkSolution(None, None, failure, len(every))
