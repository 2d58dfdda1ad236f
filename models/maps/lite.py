"""The Gen3 Lite's reachability map (thesis A.3), with the values 0, 1 and 2.

Two procedures, in this order: the polynomial with fine-tuning (`models.gen3_lite.ik`), then the
numerical solver alone, from random starts. The value of a pose says which of them was the first
to reach it, 1 or 2, or that none did, 0. To reach a pose is to meet it by Drake's forward
kinematics, within the joint limits, with a cube in the hand and every distance above the margin.
The poses are those of the task's cells. Unlike the Gen3's, the last joint ends at ±149°, so each
turn about the approach is a question of its own.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform

from models.gen3_lite.chain import LIMIT, tune
from models.gen3_lite.ik import solve_batch, within_limits
from models.gen3_lite.polynomial import out_of_reach
from models.inverse_kinematics.solution import Failure, collision_failure, reaches
from models.maps.gripper_poses import gripper_pose, pose_key
from models.scenes.parsing import ARM
from models.scenes.planning_scene import MARGIN, Clearance, PlanningScene
from models.scenes.robots import GEN3_LITE
from models.task.spaces import N_GRIPPERS, POSITIONS

NONE, POLYNOMIAL, NUMERICAL = VALUES = (0, 1, 2)
"""Values of the map."""
STARTS = 30
"""Starts of the numerical solver: the middle of the joints' ranges, then random ones."""


@dataclass(frozen=True)
class Entry:
    """One pose and what is known of it.

    Attributes:
        p_WG: position ``[3]`` of the tool centre point in the world [m].
        gripper: gripper orientation 0…17.
        value: 0, 1 or 2.
        q: joint angles ``[6]`` [rad], None if the value is 0.
        clearance: smallest distance at ``q``, or of the best rejected solution; None if no
            solution respects the limits.
        failure: why the value is 0; None otherwise.
        solutions: how many solutions the polynomial gives.
        within_limits: how many of these respect the joint limits.
    """

    p_WG: np.ndarray
    gripper: int
    value: int
    q: np.ndarray | None
    clearance: Clearance | None
    failure: Failure | None
    solutions: int
    within_limits: int


class LiteScene:
    """Drake's verdict on the Gen3 Lite, which carries a cube before box and table."""

    def __init__(self) -> None:
        """Build the scene."""
        self._scene = PlanningScene(robot=GEN3_LITE, carrying=True)
        plant, context = self._scene.plant, self._scene.context
        arm = plant.GetModelInstanceByName(ARM)
        base = plant.GetFrameByName("base_link", arm)
        end = plant.GetFrameByName("end_effector_link", arm)
        self._X_BW = base.CalcPoseInWorld(context).inverse()
        self._X_GE = plant.GetFrameByName("tcp").CalcPose(context, end).inverse()

    def end_effector(self, poses: Sequence[RigidTransform]) -> tuple[np.ndarray, np.ndarray]:
        """R_BE ``[n, 3, 3]`` and p_BE ``[n, 3]`` [m] that bring the gripper to each X_WG."""
        X_BE = [self._X_BW @ X_WG @ self._X_GE for X_WG in poses]
        R = np.array([X.rotation().matrix() for X in X_BE])
        return R, np.array([X.translation() for X in X_BE])

    def best(
        self, X_WG: RigidTransform, answers: Sequence[np.ndarray]
    ) -> tuple[np.ndarray, Clearance] | None:
        """Choose among joint angles ``[6]`` that meet the pose and the limits, by Drake.

        Returns:
            The posture furthest from the joint limits of those whose clearance exceeds the
            margin, else the one of the widest clearance; with that. None if no answer counts.
        """
        rated = [(self._scene.clearance(q), q) for q in answers if reaches(self._scene, q, X_WG)]
        free = [(c, q) for c, q in rated if c.distance > MARGIN]
        if free:
            clearance, q = min(free, key=lambda pair: np.max(np.abs(pair[1]) / LIMIT))
            return q, clearance
        if rated:
            clearance, q = max(rated, key=lambda pair: pair[0].distance)
            return q, clearance
        return None

    def failure(self, q: np.ndarray, clearance: Clearance) -> Failure:
        """What is wrong with joint angles ``[6]`` of too small a clearance."""
        blocked = self._scene.hand_is_blocked(q, MARGIN)
        return Failure.BLOCKED if blocked else collision_failure(self._scene, clearance)


def build(seed: int = 0, progress: Callable[[int, int], None] | None = None) -> list[Entry]:
    """Solve every cell's poses, orientation by orientation.

    Args:
        seed: of the numerical solver's random starts; each pose has its own stream.
        progress: called with (poses done, poses in all).
    """
    scene = LiteScene()
    poses = [(p_WG, gripper) for gripper in range(N_GRIPPERS) for p_WG in POSITIONS]
    R, p = scene.end_effector([gripper_pose(*pose) for pose in poses])
    solutions, too_far = solve_batch(R, p).q, out_of_reach(R, p)
    entries = []
    for i, (p_WG, gripper) in enumerate(poses):
        stream = np.random.default_rng([seed, *np.abs(pose_key(p_WG, gripper))])
        q = solutions[i][~np.isnan(solutions[i, :, 0])]
        entry = _entry(scene, p_WG, gripper, q, numerical(R[i], p[i], stream))
        if too_far[i]:
            entry = replace(entry, failure=Failure.OUT_OF_REACH)
        entries.append(entry)
        if progress:
            progress(i + 1, len(poses))
    return entries


def numerical(R_BE: np.ndarray, p_BE: np.ndarray, rng: np.random.Generator) -> list[np.ndarray]:
    """Answers ``[6]`` [rad] of the numerical solver alone, limits left aside: the second procedure.

    Args:
        R_BE: rotation of the end effector in the base ``[3, 3]``.
        p_BE: its position ``[3]`` [m].
        rng: source of the starts but the first.
    """
    starts = np.vstack([np.zeros(6), rng.uniform(-LIMIT, LIMIT, (STARTS - 1, 6))])
    tuned = (tune(start, R_BE, p_BE) for start in starts)
    return [q for q in tuned if q is not None]


def _entry(
    scene: LiteScene,
    p_WG: np.ndarray,
    gripper: int,
    solutions: np.ndarray,
    alone: list[np.ndarray],
) -> Entry:
    """Judge the answers of both procedures, ``solutions [k, 6]`` being the first one's."""
    X_WG = gripper_pose(p_WG, gripper)
    counts = len(solutions), int(within_limits(solutions).sum())
    closest = None
    for value, answers in ((POLYNOMIAL, list(solutions)), (NUMERICAL, alone)):
        best = scene.best(X_WG, answers)
        if best and best[1].distance > MARGIN:
            return Entry(p_WG, gripper, value, *best, None, *counts)
        if best and (closest is None or best[1].distance > closest[1].distance):
            closest = best
    if closest:
        failure = scene.failure(*closest)
    else:
        failure = Failure.JOINT_LIMIT if len(solutions) or alone else Failure.NOT_FOUND
    clearance = closest[1] if closest else None
    return Entry(p_WG, gripper, NONE, None, clearance, failure, *counts)
