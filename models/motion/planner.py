"""Plans of the task's actions: joint paths and grips, checked for collisions (thesis 5.8.2).

What is left out of the checks, and why:

* the cube against the table and the box: it lies there;
* the cube against the hand from the moment the fingers close: they are to touch it. It then
  counts as part of the hand, where it was measured to be in it;
* the held cube against the table while the hand lifts it straight up to the lower layer of cells:
  it rises from where it stood;
* the cube while the hand withdraws straight up after a drop, or to begin anew from beside it: it
  falls away beneath.

The closing axis is level in all 18 orientations, so fingers that move straight up or down
never push the cube between them.

A cube on the table lies flat, whatever was measured of its height and tilt. Where the arm's first
posture for a pose leads nowhere, other families of postures are tried, if the planner may search.
"""

from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from pydrake.math import RigidTransform

from models.inverse_kinematics.solution import Failure
from models.inverse_kinematics.solver import IkSolver
from models.maps.gripper_poses import grasp_position, gripper_pose, via_position
from models.maps.pose_solver import CLOSED_MARGIN
from models.maps.reachability import ReachabilityMap
from models.motion.cube import in_hand, lying
from models.motion.failures import ActionFailure, Infeasible
from models.motion.families import families, first_that_works
from models.motion.moves import CLOSE, OPEN, Grip, Move
from models.motion.paths import PathPlanner, wind_path
from models.motion.straight import straight_up, withdrawal
from models.scenes.gripper import MAX_OPENING
from models.scenes.planning_scene import HOME, MARGIN, PlanningScene
from models.task.spaces import CUBE_EDGE, GRID_Z, POSITIONS, REST_HEIGHT, VERTICAL, Action, Kind

_MET = (Failure.SELF_COLLISION, Failure.COLLISION, Failure.BLOCKED)  # within reach, but not free
APPROACH = 0.08
"""Height above the grasp from which the open hand comes straight down [m]."""
WITHDRAWALS = (0.10, 0.05, 0.0)
"""Heights by which the open hand goes straight up after a drop, the first it can [m].

A level hand near the robot cannot rise far; in the upper layer the cube falls clear of it.
"""
AT_CELL = 0.005, 0.05
"""How far a hand may be from a cell and orientation that it is said to be in [m], [rad]."""
ROOM = 0.01
"""Ways to carry the cube that keep this distance come first [m]: robots do not stand quite where
they are believed to, nor do cubes lie in the hand quite as they were measured."""
RAISED = 0.04
"""By how much a held cube is first raised that touches something where it is [m]."""


class ActionPlanner:
    """Plans one action at a time; a pure function of its arguments and the map."""

    def __init__(self, reachability: ReachabilityMap, *, search: bool = True) -> None:
        """Plan with the postures of a map.

        Args:
            reachability: the map.
            search: whether to search by RRT-Connect where no straight path and no via serves;
                it always draws the same samples.
        """
        self._map, self._search = reachability, search
        self._empty, self._carrying = (
            PathPlanner(PlanningScene(carrying=carrying)) for carrying in (False, True)
        )
        self._solvers = {paths: IkSolver(paths.scene) for paths in (self._empty, self._carrying)}
        self.velocity_limit = self._carrying.scene.velocity_limit
        """Of the joints, ``[7]`` [rad/s]."""

    def plan(
        self,
        action: Action,
        position: int,
        gripper: int | None,
        q: np.ndarray,
        width: float,
        X_WO: RigidTransform,
    ) -> tuple[Move | Grip, ...]:
        """Plan an action from where the robot is.

        Args:
            action: what to do.
            position: the cube's cell 0…17.
            gripper: gripper orientation 0…17 that holds the cube, None if it is free.
            q: joint angles ``[7]`` [rad].
            width: opening of the fingers [m].
            X_WO: measured pose of the cube.

        Raises:
            Infeasible: if the action does not fit the state, or no free motion is found.
        """
        if position not in range(len(POSITIONS)):
            raise Infeasible(ActionFailure.UNFIT, "the cube is lost")
        target = action.target
        if gripper is None:
            if action.kind != Kind.GRASP or target is None:
                raise Infeasible(ActionFailure.UNFIT, "the cube is not held")
            return self._grasp(target, position, q, width, lying(X_WO))
        if action.kind == Kind.GRASP:
            raise Infeasible(ActionFailure.UNFIT, "the cube is held already")
        if target is None:
            return self._drop(position, gripper, q, X_WO)
        there = (target, gripper) if action.kind == Kind.TRANSLATE else (position, target)
        return (self._carry((position, gripper), there, q, X_WO),)

    def posture(self, position: int, gripper: int) -> np.ndarray | None:
        """Joint angles ``[7]`` [rad] that hold the cube in a cell, None if out of reach."""
        return self._map.posture(POSITIONS[position], gripper)

    def detours(self, here: tuple[int, int], there: tuple[int, int]) -> list[list[np.ndarray]]:
        """Lists of configurations ``[7]`` [rad] to carry the cube through, the best first.

        The way back has the same lists, reversed, in another order.

        Args:
            here: cell and gripper orientation of the start.
            there: cell and gripper orientation of the goal.
        """
        start, goal = (self._via(*end) for end in (here, there))
        return [
            via for via in (goal, start, start + goal, *self._crossroads(there[0], here[0])) if via
        ]

    def _carry(
        self, here: tuple[int, int], there: tuple[int, int], q: np.ndarray, X_WO: RigidTransform
    ) -> Move:
        """Bring the held cube to another cell or orientation."""
        paths, goal = self._carrying, self.posture(*there)
        X_WG = gripper_pose(POSITIONS[there[0]], there[1])
        if here == there and self._is_at(there, q):
            raise Infeasible(ActionFailure.UNFIT, "the hand is there already")
        if goal is None:
            raise Infeasible(
                ActionFailure.OUT_OF_REACH, f"cell {there[0]} is out of reach of gripper {there[1]}"
            )
        paths.carry(in_hand(paths.scene.forward(q), X_WO))
        begun = q[None]
        if not paths.scene.is_free(q, MARGIN):
            begun = straight_up(self._empty_hand(CUBE_EDGE, None), q, RAISED)

        def bring(goal: np.ndarray) -> Move:
            way = self._path(paths, begun[-1], goal, self.detours(here, there), room=ROOM)
            return _rounded(paths, np.vstack([begun, way[1:]]))

        return first_that_works(bring, goal, lambda: self._others(paths, X_WG, goal))

    def _grasp(
        self, gripper: int, position: int, q: np.ndarray, width: float, X_WO: RigidTransform
    ) -> tuple[Move | Grip, ...]:
        """Open, come down on the cube, close, and lift it to the middle of its cell.

        A hand that stands too near to the cube for that goes straight up first.
        """
        x, y, _ = POSITIONS[position]
        nominal = np.array([x, y, REST_HEIGHT])
        seed = self._map.posture(grasp_position(nominal, gripper), gripper)
        if seed is None or self.posture(position, gripper) is None:
            raise Infeasible(
                ActionFailure.OUT_OF_REACH,
                f"gripper {gripper} does not reach a cube on the table there",
            )
        X_WG = gripper_pose(grasp_position(X_WO.translation(), gripper), gripper)

        paths = self._empty_hand(MAX_OPENING, X_WO)
        away: tuple[Move, ...] = ()
        if not paths.scene.is_free(q, MARGIN):
            # Fingers that closed on nothing may touch the table; they rise from it.
            alone = self._empty_hand(max(width, CUBE_EDGE), None)
            away = (_rounded(alone, withdrawal(alone, q, WITHDRAWALS[:-1])),)
            q = away[0].waypoints[-1]
            self._empty_hand(MAX_OPENING, X_WO)
        answer = self._solvers[paths].solve(X_WG, seed=seed)
        nearest = answer.q
        if nearest is None:
            kind = ActionFailure.NO_ROOM if answer.failure in _MET else ActionFailure.OUT_OF_REACH
            raise Infeasible(kind, f"gripper {gripper} at the cube: {answer.failure}")

        def take(q_grasp: np.ndarray) -> tuple[Move | Grip, ...]:
            approach = self._approach(q, q_grasp, position, gripper, X_WO)
            return approach, CLOSE, self._raise(approach.waypoints[-1], position, gripper, X_WO)

        def others() -> list[np.ndarray]:
            return self._others(self._empty_hand(MAX_OPENING, X_WO), X_WG, nearest)

        opening = () if width > MAX_OPENING - 1e-3 else (OPEN,)
        return (*away, *opening, *first_that_works(take, nearest, others))

    def _approach(
        self,
        q: np.ndarray,
        q_grasp: np.ndarray,
        position: int,
        gripper: int,
        X_WO: RigidTransform,
    ) -> Move:
        """Come down on the cube with open fingers."""
        paths = self._empty_hand(MAX_OPENING, X_WO)
        down = straight_up(paths, q_grasp, APPROACH)[::-1]
        vias = [self._via(position, gripper), *self._crossroads(position)]
        path = self._path(paths, q, down[0], vias)
        return _rounded(paths, wind_path(paths.scene, [*path, *down[1:]]))

    def _raise(
        self, q_grasp: np.ndarray, position: int, gripper: int, X_WO: RigidTransform
    ) -> Move:
        """Lift the cube that the fingers have closed on, and bring it to the middle of its cell."""
        cell = self.posture(position, gripper)
        assert cell is not None
        paths = self._empty_hand(CUBE_EDGE, None)
        if not paths.scene.is_free(q_grasp, CLOSED_MARGIN):
            raise Infeasible(
                ActionFailure.NO_ROOM,
                f"gripper {gripper} at the cube: closed, it touches something",
            )
        height = max(0.0, GRID_Z[0] - paths.scene.forward(q_grasp).translation()[2])
        lift = straight_up(paths, q_grasp, height, CLOSED_MARGIN)
        self._carrying.carry(in_hand(paths.scene.forward(q_grasp), X_WO))
        centring = self._path(self._carrying, lift[-1], cell, [self._via(position, gripper)])
        return _rounded(self._carrying, np.vstack([lift, centring[1:]]))

    def _drop(
        self, position: int, gripper: int, q: np.ndarray, X_WO: RigidTransform
    ) -> tuple[Move | Grip, ...]:
        """Open, withdraw straight up, and go home; first to the cell, if the hand is not there."""
        here = (position, gripper)
        centring: tuple[Move, ...] = ()
        if not self._is_at(here, q):
            with suppress(Infeasible):
                centring = (self._carry(here, here, q, X_WO),)
                q = centring[0].waypoints[-1]
        paths = self._empty_hand(MAX_OPENING, None)
        if not paths.scene.is_free(q, MARGIN):
            raise Infeasible(ActionFailure.NO_ROOM, "there is no room to open the fingers")
        up = withdrawal(paths, q, WITHDRAWALS)
        x, y, _ = X_WO.translation()
        paths = self._empty_hand(MAX_OPENING, RigidTransform(np.array([x, y, REST_HEIGHT])))
        vias = [self._via(position, gripper), *self._crossroads(position)]
        home = self._path(paths, up[-1], HOME, vias)
        return (*centring, OPEN, _rounded(paths, np.vstack([up, home[1:]])))

    def _is_at(self, cell: tuple[int, int], q: np.ndarray) -> bool:
        """Whether the hand is where a cell and an orientation have it."""
        errors = self._carrying.scene.error(q, gripper_pose(POSITIONS[cell[0]], cell[1]))
        return errors[0] <= AT_CELL[0] and errors[1] <= AT_CELL[1]

    def _others(self, paths: PathPlanner, X_WG: RigidTransform, q: np.ndarray) -> list[np.ndarray]:
        """Postures ``[7]`` [rad] of other families than ``q [7]``; none without a search."""
        return families(X_WG, q, self._solvers[paths]) if self._search else []

    def _path(
        self,
        paths: PathPlanner,
        q: np.ndarray,
        goal: np.ndarray,
        vias: Sequence[Sequence[np.ndarray]],
        room: float | None = None,
    ) -> np.ndarray:
        if not paths.scene.is_free(goal, MARGIN):
            raise Infeasible(ActionFailure.NO_ROOM, "where it leads, something is too near")
        search = np.random.default_rng(0) if self._search else None
        path = paths.plan(q, goal, vias, search=search, room=room)
        if path is None:
            raise Infeasible(ActionFailure.NO_PATH, "no free path found")
        return path

    def _via(self, position: int, gripper: int) -> list[np.ndarray]:
        """The posture high above a cell, in a list; an empty one if out of reach."""
        q = self._map.posture(via_position(POSITIONS[position]), gripper)
        return [] if q is None else [q]

    def _crossroads(self, *positions: int) -> list[list[np.ndarray]]:
        """Postures, one a list, from which most others can be reached: `HOME` and above cells."""
        above = (self._via(position, gripper) for position in positions for gripper in VERTICAL)
        return [[HOME], *above]

    def _empty_hand(self, width: float, X_WO: RigidTransform | None) -> PathPlanner:
        """Paths without a carried cube, the fingers and the free cube as wanted."""
        self._empty.scene.open_to(width)
        self._empty.scene.place_cube(X_WO)
        return self._empty


def _rounded(paths: PathPlanner, waypoints: np.ndarray) -> Move:
    """A move whose corners are rounded as far as the scene allows."""
    return Move(waypoints, paths.corner_cuts(waypoints))
