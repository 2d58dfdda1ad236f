"""Which actions have a complete plan, from every state (thesis 5.8.2).

Plans are made between the middles of the cells and start at the map's postures. The cube's
orientation does not matter: a grasp must be free for a cube turned flush and one turned by
45°, and a held cube counts with all its turns.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from models.maps.reachability import ReachabilityMap
from models.motion.failures import Infeasible
from models.motion.paths import PathPlanner
from models.motion.planner import ActionPlanner
from models.scenes.gripper import MAX_OPENING
from models.scenes.planning_scene import HOME, PlanningScene
from models.task.spaces import (
    CUBE_EDGE,
    N_ACTIONS,
    N_FREE,
    N_GRIPPERS,
    N_ORIENTATIONS,
    N_POSITIONS,
    N_STATES,
    N_TARGETS,
    N_XY,
    POSITIONS,
    REST_HEIGHT,
    Action,
    Kind,
)


@dataclass(frozen=True)
class Feasibility:
    """Feasible actions; a target equal to the present pose is never one.

    Attributes:
        grasp: ``[9, 18]``: column, gripper orientation.
        translate: ``[18, 18, 18]``: cell, gripper orientation, target cell.
        rotate: ``[18, 18, 18]``: cell, gripper orientation, target orientation.
        drop: ``[18, 18]``: cell, gripper orientation.
        held: ``[18, 18]``: whether the arm reaches the held pose at all.
    """

    grasp: np.ndarray
    translate: np.ndarray
    rotate: np.ndarray
    drop: np.ndarray
    held: np.ndarray

    def mask(self) -> np.ndarray:
        """Boolean ``[15985, 55]``: state, *lost* last, by action."""
        free = np.zeros((N_XY, N_ACTIONS), dtype=bool)
        free[:, :N_TARGETS] = self.grasp
        held = np.zeros((N_POSITIONS, N_GRIPPERS, N_ACTIONS), dtype=bool)
        held[..., N_TARGETS : 2 * N_TARGETS] = self.translate
        held[..., 2 * N_TARGETS : 3 * N_TARGETS] = self.rotate
        held[..., -1] = self.drop
        mask = np.zeros((N_STATES + 1, N_ACTIONS), dtype=bool)
        mask[:N_FREE] = np.repeat(free, N_ORIENTATIONS, axis=0)
        mask[N_FREE:N_STATES] = np.repeat(held.reshape(-1, N_ACTIONS), N_ORIENTATIONS, axis=0)
        return mask


def compute(
    reachability: ReachabilityMap,
    progress: Callable[[int, int], None] | None = None,
    cells: Sequence[int] = range(N_POSITIONS),
) -> Feasibility:
    """Plan every action at the middles of the cells.

    Args:
        reachability: the standard poses' postures.
        progress: called with (cells done, cells in all).
        cells: cells to look at; whatever begins or ends in another counts as infeasible.
    """
    planner, roads = ActionPlanner(reachability, search=False), _Roads()
    shape = (N_POSITIONS, N_GRIPPERS)
    grasp = np.zeros((N_XY, N_GRIPPERS), dtype=bool)
    held, drop = (np.zeros(shape, dtype=bool) for _ in range(2))
    translate = np.zeros((*shape, N_POSITIONS), dtype=bool)
    rotate = np.zeros((*shape, N_GRIPPERS), dtype=bool)

    def is_connected(here: tuple[int, int], there: tuple[int, int]) -> bool:
        ends = planner.posture(*here), planner.posture(*there)
        if ends[0] is None or ends[1] is None:
            return False
        return any(
            roads.is_open([ends[0], *via, ends[1]]) for via in ([], *planner.detours(here, there))
        )

    for done, p in enumerate(cells, start=1):
        for g in range(N_GRIPPERS):
            held[p, g] = planner.posture(p, g) is not None
            if p % 2 == 0:
                grasp[p // 2, g] = _can_grasp(planner, p, g)
            drop[p, g] = _can_drop(planner, p, g)
            # What can be gone can be gone back.
            for other in cells[: done - 1]:
                translate[p, g, other] = translate[other, g, p] = is_connected((p, g), (other, g))
            for other in range(g):
                rotate[p, g, other] = rotate[p, other, g] = is_connected((p, g), (p, other))
        if progress:
            progress(done, len(cells))
    return Feasibility(grasp, translate, rotate, drop, held)


class _Roads:
    """Straight segments that a hand with the cube can take, each looked at once."""

    def __init__(self) -> None:
        self._paths = PathPlanner(PlanningScene(carrying=True))
        self._known: dict[frozenset[bytes], bool] = {}

    def is_open(self, stops: list[np.ndarray]) -> bool:
        return all(self._is_free(a, b) for a, b in pairwise(stops))

    def _is_free(self, a: np.ndarray, b: np.ndarray) -> bool:
        key = frozenset((a.tobytes(), b.tobytes()))
        if key not in self._known:
            self._known[key] = self._paths.segment_is_free(a, b)
        return self._known[key]


def _can_grasp(planner: ActionPlanner, position: int, gripper: int) -> bool:
    action = Action(Kind.GRASP, gripper)
    x, y, _ = POSITIONS[position]
    for yaw in (0.0, np.pi / 4.0):
        X_WO = RigidTransform(RollPitchYaw(0.0, 0.0, yaw), np.array([x, y, REST_HEIGHT]))
        try:
            planner.plan(action, position, None, HOME, MAX_OPENING, X_WO)
        except Infeasible:
            return False
    return True


def _can_drop(planner: ActionPlanner, position: int, gripper: int) -> bool:
    q, X_WO = planner.posture(position, gripper), RigidTransform(POSITIONS[position])
    if q is None:
        return False
    try:
        planner.plan(Action(Kind.DROP), position, gripper, q, CUBE_EDGE, X_WO)
    except Infeasible:
        return False
    return True
