"""The reachability map (thesis 5.5): which gripper poses the arm reaches, and how.

Neighbouring poses get neighbouring joint angles, so that straight joint paths exist between
most of them: each orientation keeps to one family of postures, the one that covers most of
its poses, and orientations that share their approach differ in joint 7 only.
"""

from collections.abc import Callable, Iterable

import numpy as np

from models.errors import ModelError
from models.maps.gripper_poses import Key, Layer, pose_key, standard_poses
from models.maps.pose_solver import Entry, PoseSolver
from models.scenes.planning_scene import HOME
from models.task.spaces import N_GRIPPERS, R_WG

JUMP = 1.0
"""Largest change of a joint between neighbouring poses of one family [rad]."""


class ReachabilityMap:
    """Entries by pose; an unknown pose is solved and added on demand (5.8.2)."""

    def __init__(self, entries: Iterable[Entry] = (), seed: int = 0) -> None:
        """Hold entries.

        Args:
            entries: what is known.
            seed: of the random starting points for what is not.
        """
        self.seed = seed
        self._entries: dict[Key, Entry] = {}
        self._solver: PoseSolver | None = None
        for entry in entries:
            self.add(entry)

    @property
    def entries(self) -> list[Entry]:
        """All entries, in the order in which they came."""
        return list(self._entries.values())

    @property
    def solver(self) -> PoseSolver:
        """What solves new poses; built when first needed."""
        self._solver = self._solver or PoseSolver(self.seed)
        return self._solver

    def add(self, entry: Entry) -> None:
        """Take an entry in; it replaces one of the same pose."""
        self._entries[pose_key(entry.p_WG, entry.gripper)] = entry

    def find(self, p_WG: np.ndarray, gripper: int) -> Entry | None:
        """The entry of a pose (position ``[3]`` [m], orientation 0…17), None if unknown.

        Raises:
            ModelError: if the position or the orientation is invalid.
        """
        return self._entries.get(pose_key(p_WG, gripper))

    def posture(self, p_WG: np.ndarray, gripper: int) -> np.ndarray | None:
        """Joint angles ``[7]`` [rad] at a pose of the map, None if it is not reachable.

        Raises:
            ModelError: if the map does not hold the pose.
        """
        entry = self.find(p_WG, gripper)
        if entry is None:
            raise ModelError(
                f"reachability map: no pose at {np.round(p_WG, 4).tolist()} m with gripper "
                f"{gripper}; valid: the poses of its file, or solve_and_add"
            )
        return entry.q

    def solve_and_add(self, p_WG: np.ndarray, gripper: int, layer: Layer = Layer.ADDED) -> Entry:
        """The entry of a pose, solved first if the map does not hold it.

        Args:
            p_WG: position ``[3]`` of the tool centre point [m]; an added one is solved at the
                nearest whole 0.1 mm.
            gripper: gripper orientation 0…17.
            layer: what the pose is for, if it is new.

        Raises:
            ModelError: if the position or the orientation is invalid.
        """
        entry = self.find(p_WG, gripper)
        if entry is None:
            p_WG = np.array(p_WG, dtype=float)
            if layer == Layer.ADDED:
                # Whichever of the positions that count as one is asked for first.
                p_WG = np.array(pose_key(p_WG, gripper)[:3]) / 1e4
            entry = self._solve(p_WG, gripper, layer)
            self.add(entry)
        return entry

    def _solve(self, p_WG: np.ndarray, gripper: int, layer: Layer) -> Entry:
        # Added entries show no way: the answer must not depend on what was asked before.
        for other in same_approach(gripper):
            known = self.find(p_WG, other)
            if known is not None and known.layer != Layer.ADDED:
                turned = self.solver.turned(known, gripper)
                if turned:
                    return turned
        standard = (entry for entry in self._entries.values() if entry.layer != Layer.ADDED)
        q = nearest_posture(p_WG, gripper, standard)
        if q is not None:
            entry = self.solver.near(layer, p_WG, gripper, q)
            if entry.value:
                return entry
        return self.solver.alone(layer, p_WG, gripper, HOME if q is None else q)[0]


def nearest_posture(p_WG: np.ndarray, gripper: int, entries: Iterable[Entry]) -> np.ndarray | None:
    """Joint angles ``[7]`` [rad] of the nearest reachable entry of the same orientation."""
    known = [(entry.p_WG, entry.q) for entry in entries if entry.gripper == gripper]
    reachable = [(float(np.linalg.norm(p - p_WG)), q) for p, q in known if q is not None]
    return min(reachable, key=lambda pair: pair[0])[1] if reachable else None


def same_approach(gripper: int) -> list[int]:
    """The orientations before this one that differ by a turn about the approach alone."""
    return [g for g in range(gripper) if R_WG[g][:, 2] @ R_WG[gripper][:, 2] > 1.0 - 1e-9]


def best_family(solver: PoseSolver, gripper: int) -> list[Entry]:
    """The family of postures that covers most standard poses of an orientation.

    A family grows from one answer at the first standard pose; every further pose is solved
    from the nearest pose that the family holds. One pose more is worth a posture that is one
    radian further from `HOME`.
    """
    poses = list(standard_poses(gripper))
    families: list[tuple[float, list[Entry]]] = []
    for first in solver.alone(*poses[0], gripper):
        if first.q is None:
            return []
        family = [first]
        for layer, p_WG in poses[1:]:
            q = nearest_posture(p_WG, gripper, family)
            assert q is not None
            entry = solver.near(layer, p_WG, gripper, q)
            if entry.q is not None and np.max(np.abs(_shorter_way(entry.q - q))) < JUMP:
                family.append(entry)
        families.append((len(family) - float(np.linalg.norm(first.q - HOME)), family))
    return max(families, key=lambda rated: rated[0])[1]


def build(seed: int = 0, progress: Callable[[int, int], None] | None = None) -> ReachabilityMap:
    """Solve every standard pose of every orientation.

    Args:
        seed: of the random starting points.
        progress: called with (orientations done, orientations in all).
    """
    reachability = ReachabilityMap(seed=seed)
    for gripper in range(N_GRIPPERS):
        if not same_approach(gripper):
            for entry in best_family(reachability.solver, gripper):
                reachability.add(entry)
        for layer, p_WG in standard_poses(gripper):
            reachability.solve_and_add(p_WG, gripper, layer)
        if progress:
            progress(gripper + 1, N_GRIPPERS)
    layers = list(Layer)
    entries = sorted(
        reachability.entries,
        key=lambda entry: (layers.index(entry.layer), entry.gripper, *entry.p_WG.tolist()),
    )
    return ReachabilityMap(entries, seed)


def _shorter_way(difference: np.ndarray) -> np.ndarray:
    return (difference + np.pi) % (2.0 * np.pi) - np.pi
