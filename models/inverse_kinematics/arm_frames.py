"""What an arm's own chain, from base to end effector, has to do with a scene."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform

from models.scenes.planning_scene import PlanningScene


class ArmFrames(NamedTuple):
    """Poses that stay as they are whatever the joints do.

    Attributes:
        X_BW: the world in the arm's base.
        X_GE: the end effector in the gripper frame.
    """

    X_BW: RigidTransform
    X_GE: RigidTransform

    @classmethod
    def of(
        cls,
        scene: PlanningScene,
        limit: np.ndarray,
        forward: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    ) -> "ArmFrames | None":
        """Measure a scene; None if its arm has other limits, or is not where ``forward`` says.

        Args:
            scene: the scene.
            limit: largest magnitude of each joint angle ``[n]`` [rad].
            forward: R_BE and p_BE at joint angles ``[n]``.
        """
        if not (np.array_equal(scene.upper, limit) and np.array_equal(-scene.lower, limit)):
            return None
        # From one posture, so that roundings do not depend on what the scene was asked before.
        scene.forward(np.zeros(len(limit)))
        plant, context = scene.plant, scene.context
        first = plant.GetJointByName(scene.robot.joints[0], scene.arm_instance)
        last = plant.GetBodyByName("end_effector_link", scene.arm_instance)
        X_WB, X_WE = (body.EvalPoseInWorld(context) for body in (first.parent_body(), last))
        X_WG = plant.GetFrameByName("tcp").CalcPoseInWorld(context)
        found = cls(X_WB.inverse(), X_WG.InvertAndCompose(X_WE))
        q = scene.robot.home
        pairs = zip(found.end_effector(scene.forward(q)), forward(q), strict=True)
        return found if all(np.allclose(*pair, atol=1e-9) for pair in pairs) else None

    def end_effector(self, X_WG: RigidTransform) -> tuple[np.ndarray, np.ndarray]:
        """R_BE ``[3, 3]`` and p_BE ``[3]`` [m] of a pose of the tool centre point."""
        X_BE = self.X_BW @ X_WG @ self.X_GE
        # One memory layout, else each further one is compiled anew.
        return np.ascontiguousarray(X_BE.rotation().matrix()), X_BE.translation()
