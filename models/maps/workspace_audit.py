"""Is the workspace map right? Asked of Drake alone: neither closed form nor capsules.

Positives are judged again in a fresh scene, all of them. Negatives of a random sample are
searched for an answer by Newton's method and Drake's optimiser from many random postures.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from models.inverse_kinematics.optimised import Starts, follow, search
from models.inverse_kinematics.solution import reaches
from models.maps.gripper_poses import gripper_pose
from models.maps.workspace import REACHABLE
from models.maps.workspace_map import WorkspaceMap
from models.scenes.planning_scene import MARGIN, PlanningScene

RESTARTS = 40
"""Random postures from which Newton's method starts."""
OPTIMISED = 6
"""Postures met in collision from which the optimiser is asked for a free one."""


@dataclass(frozen=True)
class Audit:
    """What an audit counted.

    Attributes:
        positives: reachable poses of the map, all judged again.
        rejected: those that did not pass.
        sample: random poses, drawn from the whole grid.
        negatives: those of the sample that the map calls not reachable.
        missed: negatives that were reached after all.
    """

    positives: int
    rejected: int
    sample: int
    negatives: int
    missed: int

    @property
    def false_negative_rate(self) -> float:
        """Share of the sample's reachable poses, by map or audit, that the map misses."""
        reachable = self.sample - self.negatives + self.missed
        return self.missed / reachable if reachable else 0.0


def audit(
    the_map: WorkspaceMap,
    sample: int,
    rng: np.random.Generator,
    margin: float = MARGIN,
    progress: Callable[[int], None] | None = None,
) -> Audit:
    """Judge all positives again, and search ``sample`` random poses for missed ones.

    Args:
        the_map: what to check.
        sample: poses of the random sample, at most as many as the map has.
        rng: draws sample and postures.
        margin: smallest allowed distance [m].
        progress: called with the number of poses just done.
    """
    scene = PlanningScene()
    total = the_map.grid.total
    p_WG, gripper = the_map.grid.poses(0, total)
    reachable = np.flatnonzero(the_map.decisions.reason == REACHABLE)
    rejected = 0
    for i, q in zip(reachable, the_map.decisions.q.astype(np.float64), strict=True):
        X_WG = gripper_pose(p_WG[i], int(gripper[i]))
        rejected += not (reaches(scene, q, X_WG) and scene.is_free(q, margin))
        if progress:
            progress(1)
    chosen = np.sort(rng.choice(total, min(sample, total), replace=False))
    negatives = chosen[the_map.decisions.reason[chosen] != REACHABLE]
    missed = 0
    for i in negatives:
        missed += is_reachable(scene, gripper_pose(p_WG[i], int(gripper[i])), rng, margin)
        if progress:
            progress(1)
    return Audit(len(reachable), rejected, len(chosen), len(negatives), missed)


def is_reachable(
    scene: PlanningScene, X_WG: RigidTransform, rng: np.random.Generator, margin: float = MARGIN
) -> bool:
    """Whether a pose is reached free of collisions from any of many random postures."""
    low, high = np.maximum(scene.lower, -np.pi), np.minimum(scene.upper, np.pi)
    optimised = 0
    for _ in range(RESTARTS):
        q = follow(scene, X_WG, rng.uniform(low, high))
        if q is None:
            continue
        if scene.is_free(q, margin):
            return True
        if scene.hand_is_blocked(q, margin):
            return False
        if optimised < OPTIMISED:
            optimised += 1
            answers = search(scene, X_WG, Starts(q), margin=margin)
            if answers[0].q is not None:
                return True
    return False
