"""Straight motions of the hand, up from where it is, without turning it."""

from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from pydrake.math import RigidTransform

from models.inverse_kinematics.optimised import follow
from models.motion.failures import ActionFailure, Infeasible
from models.motion.paths import PathPlanner
from models.scenes.planning_scene import MARGIN

RISE = 0.04
"""Largest step of a straight motion [m]; between steps the joints move in proportion."""
JOINT_STEP = 0.6
"""Largest joint motion in such a step [rad]; more would be another posture."""
_UP = np.array([0.0, 0.0, 1.0])


def straight_up(
    paths: PathPlanner, q: np.ndarray, height: float, margin: float = MARGIN
) -> np.ndarray:
    """Waypoints ``[n, 7]`` [rad] that raise the hand by ``height`` [m] from ``q [7]``.

    Raises:
        Infeasible: if no posture follows, or something is in the way.
    """
    scene = paths.scene
    X_WG = scene.forward(q)
    waypoints = [q]
    for rise in np.linspace(0.0, height, int(np.ceil(height / RISE)) + 1)[1:]:
        X_target = RigidTransform(X_WG.rotation(), X_WG.translation() + rise * _UP)
        q_next = follow(scene, X_target, waypoints[-1])
        if q_next is None or np.abs(q_next - waypoints[-1]).max() > JOINT_STEP:
            raise Infeasible(ActionFailure.OUT_OF_REACH, "no posture follows the hand straight up")
        if not paths.segment_is_free(waypoints[-1], q_next, margin):
            raise Infeasible(
                ActionFailure.NO_ROOM, f"straight up: too near, {scene.clearance(q_next).bodies}"
            )
        waypoints.append(q_next)
    return np.array(waypoints)


def withdrawal(paths: PathPlanner, q: np.ndarray, heights: Sequence[float]) -> np.ndarray:
    """Waypoints ``[n, 7]`` [rad] straight up, by the first of some heights [m] that works.

    Raises:
        Infeasible: if the last does not either.
    """
    for height in heights[:-1]:
        with suppress(Infeasible):
            return straight_up(paths, q, height)
    return straight_up(paths, q, heights[-1])
