"""The workspace map: which of many gripper poses on a grid the arm reaches, free of collisions.

The Gen3's closed form proposes postures, capsules sort out most of those that collide, and
Drake's forward kinematics and distance query confirm every pose that counts as reachable.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform

from models.compiled import compiled
from models.errors import ModelError
from models.gen3.branches import BRANCHES, solve_into, wrist_in_reach
from models.gen3.capsules import DOUBTFUL, FREE, SELF, Capsules, arrays, check
from models.gen3.chain import Array
from models.gen3.newton import BEYOND_LIMITS, MET, NOT_MET, OUT_OF_REACH, work_arrays
from models.inverse_kinematics.solution import Failure, collision_failure, reaches
from models.inverse_kinematics.sweep import Sweep
from models.maps.gripper_poses import gripper_pose
from models.scenes.planning_scene import MARGIN, Clearance, PlanningScene
from models.task.spaces import N_GRIPPERS

REACHABLE = 0
FAILURES = tuple(Failure)
"""Reason ``i`` is stored as ``i + 1``; 0 stands for a reachable pose."""
CLEARANCE_LIMIT = 0.02
"""Larger clearances are stored as this one [m]."""

_SWEEP = 128  # values of q3, a power of two
_CANDIDATES = 48  # postures of one pose that the exact query looks at
_TOLERANCE = 1e-6  # of the closed form [m, rad]
_BY_ITSELF, _BY_FURNITURE = MET + 1, MET + 2  # certain collisions that were seen


@dataclass(frozen=True)
class Grid:
    """Voxels, each with the 18 gripper orientations at its centre.

    Attributes:
        low: centre of the first voxel in the world ``(x, y, z)`` [m].
        high: centre of the last, up to half a spacing.
        spacing: edge of a voxel [m].
    """

    low: tuple[float, float, float] = (0.2, -0.4, 0.5)
    high: tuple[float, float, float] = (0.9, 0.4, 0.925)
    spacing: float = 0.025

    def __post_init__(self) -> None:
        """Check the corners.

        Raises:
            ModelError: if a number is not finite, or the grid would be empty.
        """
        corners = np.array([self.low, self.high])
        if not np.isfinite(corners).all() or not (corners[0] <= corners[1]).all():
            raise ModelError(f"grid: low {self.low}, high {self.high}; valid: low ≤ high [m]")
        if not 0.0 < self.spacing < np.inf:
            raise ModelError(f"grid: spacing {self.spacing}; valid: above 0 [m]")

    @property
    def shape(self) -> tuple[int, int, int]:
        """Voxels along x, y and z."""
        extent = np.subtract(self.high, self.low) / self.spacing
        nx, ny, nz = (int(n) + 1 for n in np.floor(extent + 0.5))
        return nx, ny, nz

    @property
    def total(self) -> int:
        """Number of poses."""
        return int(np.prod(self.shape)) * N_GRIPPERS

    def axes(self) -> tuple[Array, Array, Array]:
        """Coordinates of the voxels' centres along x, y and z [m]."""
        # Rounded, so that what is meant as 0.55 is the number 0.55.
        x, y, z = (
            np.round(low + self.spacing * np.arange(n), 9)
            for low, n in zip(self.low, self.shape, strict=True)
        )
        return x, y, z

    def poses(self, start: int, stop: int) -> tuple[Array, np.ndarray]:
        """Positions ``[n, 3]`` [m] and gripper orientations ``[n]`` of poses ``start…stop − 1``.

        The orientation varies fastest, then z, y, x.
        """
        *voxel, gripper = np.unravel_index(np.arange(start, stop), (*self.shape, N_GRIPPERS))
        p_WG = np.stack([axis[i] for axis, i in zip(self.axes(), voxel, strict=True)], axis=-1)
        return p_WG, gripper


@dataclass(frozen=True)
class Decisions:
    """What became of some poses.

    Attributes:
        reason: ``[n]`` uint8, `REACHABLE` or one more than an index of `FAILURES`.
        q: postures of the reachable ones, in order ``[r, 7]`` float32 [rad].
        clearance: their smallest distances ``[r]`` float32 [m], `CLEARANCE_LIMIT` at most.
    """

    reason: np.ndarray
    q: np.ndarray
    clearance: np.ndarray

    @staticmethod
    def join(parts: "list[Decisions]") -> "Decisions":
        """Decisions about the poses of all parts, in their order."""
        return Decisions(
            np.concatenate([part.reason for part in parts]),
            np.concatenate([part.q for part in parts]),
            np.concatenate([part.clearance for part in parts]),
        )


class WorkspaceSolver:
    """Decides poses of the open, empty hand over box and table; a pure function of the poses."""

    def __init__(self, margin: float = MARGIN) -> None:
        """Build the scene.

        Args:
            margin: smallest allowed distance [m].

        Raises:
            ModelError: if the arm has no closed form.
        """
        self.margin = margin
        self._scene = PlanningScene()
        arm = Sweep.of(self._scene)
        if arm is None:
            raise ModelError("workspace map: the scene's arm; valid: the Gen3")
        self._arm = arm
        # Bit reversal: any first part of the sweep covers the turn evenly.
        bits = int(np.log2(_SWEEP))
        order = [int(f"{i:0{bits}b}"[::-1], 2) for i in range(_SWEEP)]
        self._q3 = 2.0 * np.pi * np.array(order) / _SWEEP

    def decide(self, p_WG: Array, gripper: np.ndarray) -> Decisions:
        """Decide poses at positions ``[n, 3]`` [m] with orientations ``[n]``."""
        poses = [gripper_pose(p, int(g)) for p, g in zip(p_WG, gripper, strict=True)]
        ends = [self._arm.end_effector(X_WG) for X_WG in poses]
        R, p = (np.ascontiguousarray([end[k] for end in ends]) for k in (0, 1))
        seen, count, candidates = _search(R, p, self._q3, self._arm.capsules, self.margin)
        # Rounded as they are stored, so that what is confirmed is what is kept.
        candidates = candidates.astype(np.float32)
        reason = np.zeros(len(poses), dtype=np.uint8)
        q, clearance = [], []
        for i, X_WG in enumerate(poses):
            best, refused = self._confirm(X_WG, candidates[i, : count[i]])
            if best is not None and refused is None:
                q.append(candidates[i, best[0]])
                clearance.append(best[1].distance)
            else:
                failure = refused or self._unproposed(int(seen[i]), candidates[i, 0])
                reason[i] = 1 + FAILURES.index(failure)
        return Decisions(
            reason,
            np.array(q, dtype=np.float32).reshape(-1, 7),
            np.array(clearance, dtype=np.float32),
        )

    def _confirm(
        self, X_WG: RigidTransform, candidates: Array
    ) -> tuple[tuple[int, Clearance] | None, Failure | None]:
        """The first candidate that Drake finds free, or what it says of the best other one."""
        best: Clearance | None = None
        for i, q in enumerate(candidates.astype(np.float64)):
            if not reaches(self._scene, q, X_WG):
                continue
            clearance = self._scene.clearance(q, CLEARANCE_LIMIT)
            if clearance.distance > self.margin:
                return (i, clearance), None
            if best is None and self._scene.hand_is_blocked(q, self.margin):
                return None, Failure.BLOCKED
            if best is None or clearance.distance > best.distance:
                best = clearance
        return None, None if best is None else collision_failure(self._scene, best)

    def _unproposed(self, seen: int, q: Array) -> Failure:
        """Why no candidate met the pose; ``q [7]`` does if all postures collided for certain."""
        collided = seen in (_BY_ITSELF, _BY_FURNITURE)
        if collided and self._scene.hand_is_blocked(q.astype(np.float64), self.margin):
            return Failure.BLOCKED
        return _FAILURES[seen]


_FAILURES = {
    OUT_OF_REACH: Failure.OUT_OF_REACH,
    NOT_MET: Failure.NOT_FOUND,
    BEYOND_LIMITS: Failure.JOINT_LIMIT,
    MET: Failure.NOT_FOUND,  # within the tolerances
    _BY_ITSELF: Failure.SELF_COLLISION,
    _BY_FURNITURE: Failure.COLLISION,
}


@compiled(error_model="numpy")
def _search(
    R: Array, p: Array, q3: Array, model: Capsules, margin: float
) -> tuple[NDArray[np.int8], NDArray[np.int64], Array]:
    """Candidates for the exact query: ``[n, k, 7]`` and their numbers ``[n]``; what was seen.

        The first candidate is free by its capsules, where there is one; the rest are doubtful. The
    hand against the furniture is left out: it is the same for all postures of a pose, and Drake
    asks it of the candidates. Where there are none, but collisions were seen, the first place
    holds one of the postures that collide.
    """
    n = len(R)
    seen, count = np.full(n, NOT_MET, dtype=np.int8), np.zeros(n, dtype=np.int64)
    candidates = np.zeros((n, _CANDIDATES, 7))
    answers, work = np.empty((BRANCHES, 7)), work_arrays()
    frames, start, end = arrays(model)
    for i in range(n):
        if not wrist_in_reach(R[i], p[i]):
            seen[i] = OUT_OF_REACH
            continue
        found = False
        for j in range(len(q3)):
            answers[:] = np.nan
            status = solve_into(R[i], p[i], q3[j], answers, BRANCHES, _TOLERANCE, work)
            seen[i] = max(seen[i], status)
            for branch in range(BRANCHES):
                if np.isnan(answers[branch, 0]):
                    continue
                verdict = check(model, answers[branch], margin, frames, start, end, False)
                if verdict == FREE:
                    found = True
                    if count[i] < _CANDIDATES:
                        candidates[i, count[i]] = candidates[i, 0]
                        count[i] += 1
                    candidates[i, 0] = answers[branch]
                    break
                if verdict == DOUBTFUL:
                    if count[i] < _CANDIDATES:
                        candidates[i, count[i]] = answers[branch]
                        count[i] += 1
                else:
                    seen[i] = max(seen[i], _BY_ITSELF if verdict == SELF else _BY_FURNITURE)
                    if count[i] == 0:
                        candidates[i, 0] = answers[branch]
            if found:
                break
    return seen, count, candidates
