"""The workspace map in memory: shares of reachable orientations, and single poses by their hash."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.errors import ModelError
from models.inverse_kinematics.solution import Failure
from models.maps.gripper_poses import Key, pose_key
from models.maps.workspace import FAILURES, REACHABLE, Decisions, Grid
from models.task.spaces import N_GRIPPERS


@dataclass(frozen=True)
class WorkspaceEntry:
    """What the map says of one pose.

    Attributes:
        q: joint angles ``[7]`` [rad], None if the pose was not found reachable.
        clearance: smallest distance at ``q`` [m]; None without ``q``.
        failure: why there is no ``q``; None if there is.
    """

    q: np.ndarray | None
    clearance: float | None
    failure: Failure | None


@dataclass(frozen=True)
class WorkspaceMap:
    """A grid and what was decided about all of its poses.

    Attributes:
        grid: the poses.
        decisions: one reason for each.
    """

    grid: Grid
    decisions: Decisions

    def __post_init__(self) -> None:
        """Check the sizes.

        Raises:
            ModelError: if the decisions are not the grid's.
        """
        reason, q = self.decisions.reason, self.decisions.q
        if reason.shape != (self.grid.total,) or not (reason <= len(FAILURES)).all():
            valid = f"{self.grid.total} numbers, 0…{len(FAILURES)}"
            raise ModelError(f"workspace map: reason; valid: {valid}")
        reachable = (int((reason == REACHABLE).sum()), 7)
        if q.shape != reachable or self.decisions.clearance.shape != reachable[:1]:
            raise ModelError(f"workspace map: q, clearance; valid: {reachable[0]} rows")

    @cached_property
    def reachable(self) -> np.ndarray:
        """Boolean ``[nx, ny, nz, 18]``."""
        return (self.decisions.reason == REACHABLE).reshape(*self.grid.shape, N_GRIPPERS)

    @property
    def share(self) -> np.ndarray:
        """Share of the orientations in which each voxel's centre is reached ``[nx, ny, nz]``."""
        return self.reachable.mean(axis=-1)

    @cached_property
    def _index(self) -> dict[Key, int]:
        p_WG, gripper = self.grid.poses(0, self.grid.total)
        return {pose_key(p, g): i for i, (p, g) in enumerate(zip(p_WG, gripper, strict=True))}

    @cached_property
    def _row(self) -> np.ndarray:
        return np.cumsum(self.decisions.reason == REACHABLE) - 1

    def find(self, p_WG: np.ndarray, gripper: int) -> WorkspaceEntry | None:
        """The entry of a pose (position ``[3]`` [m], orientation 0…17), None if not on the grid.

        Raises:
            ModelError: if the position or the orientation is invalid.
        """
        i = self._index.get(pose_key(p_WG, gripper))
        if i is None:
            return None
        reason = int(self.decisions.reason[i])
        if reason != REACHABLE:
            return WorkspaceEntry(None, None, FAILURES[reason - 1])
        row = self._row[i]
        q = self.decisions.q[row].astype(np.float64)
        return WorkspaceEntry(q, float(self.decisions.clearance[row]), None)
