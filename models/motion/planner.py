"""Plans of the task's actions: joint paths and grips, checked for collisions (thesis 5.8.2).

What is left out of the checks, and why:

* the cube against the table and the box: it lies there;
* the cube against the hand from the moment the fingers close: they are to touch it. It then
  counts as part of the hand, as a cylinder that contains it however it is turned;
* that cylinder against the table while the hand lifts the cube straight up to the lower layer
  of cells: the cube rises from where it stood;
* the cube while the hand withdraws straight up after a drop: it falls away beneath.

The closing axis is level in all 18 orientations, so fingers that move straight up or down
never push the cube between them.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from models.inverse_kinematics.optimised import follow
from models.inverse_kinematics.solver import IkSolver
from models.maps.gripper_poses import grasp_position, gripper_pose, via_position
from models.maps.pose_solver import CLOSED_MARGIN
from models.maps.reachability import ReachabilityMap
from models.motion.paths import PathPlanner, wind_path
from models.scenes.gripper import MAX_OPENING
from models.scenes.planning_scene import HOME, MARGIN, PlanningScene
from models.task.spaces import CUBE_EDGE, GRID_Z, POSITIONS, REST_HEIGHT, VERTICAL, Action, Kind

APPROACH = 0.08
"""Height above the grasp from which the open hand comes straight down [m]."""
WITHDRAWALS = (0.10, 0.05, 0.0)
"""Heights by which the open hand goes straight up after a drop, the first it can [m].

A level hand near the robot cannot rise far; in the upper layer the cube falls clear of it.
"""
RISE = 0.04
"""Largest step of a straight motion [m]; between steps the joints move in proportion."""
JOINT_STEP = 0.6
"""Largest joint motion in such a step [rad]; more would be another posture."""
GRASP_HEIGHTS = (0.515, 0.56)
"""Heights of the cube's centre at which it is grasped; others are clipped to them [m]."""

_UP = np.array([0.0, 0.0, 1.0])


class Infeasible(Exception):  # noqa: N818 - an answer rather than an error
    """The action cannot be carried out; the message says why."""


@dataclass(frozen=True)
class Move:
    """A joint path.

    Attributes:
        waypoints: ``[n, 7]`` [rad], n ≥ 2; the joints move in proportion between two of them.
        cuts: how far before and after each waypoint its corner may be rounded ``[n]`` [rad],
            as `PathPlanner.corner_cuts` proves; None rests at every corner.
    """

    waypoints: np.ndarray
    cuts: np.ndarray | None = None


@dataclass(frozen=True)
class Grip:
    """Fingers on their way to an opening.

    Attributes:
        width: commanded distance of the pads [m]; a cube between them stops them earlier.
        seconds: time to wait.
    """

    width: float
    seconds: float


CLOSE, OPEN = Grip(0.0, 1.3), Grip(MAX_OPENING, 1.6)
"""Until the force has built up; until the fingers are wide open, from however tight a grip."""


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
        self._solver = IkSolver(self._empty.scene)
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
            raise Infeasible("the cube is lost")
        target = action.target
        if gripper is None:
            if action.kind != Kind.GRASP or target is None:
                raise Infeasible("the cube is not held")
            return self._grasp(target, position, q, width, X_WO)
        if action.kind == Kind.GRASP:
            raise Infeasible("the cube is held already")
        if target is None:
            return self._drop(position, gripper, q, X_WO)
        there = (target, gripper) if action.kind == Kind.TRANSLATE else (position, target)
        return (self._carry((position, gripper), there, q),)

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

    def _carry(self, here: tuple[int, int], there: tuple[int, int], q: np.ndarray) -> Move:
        """Bring the held cube to another cell or orientation."""
        if here == there:
            raise Infeasible("the hand is there already")
        goal = self.posture(*there)
        if goal is None:
            raise Infeasible(f"cell {there[0]} is out of reach of gripper {there[1]}")
        return _rounded(
            self._carrying, self._path(self._carrying, q, goal, self.detours(here, there))
        )

    def _grasp(
        self, gripper: int, position: int, q: np.ndarray, width: float, X_WO: RigidTransform
    ) -> tuple[Move | Grip, ...]:
        """Open, come down on the cube, close, and lift it to the middle of its cell."""
        column = POSITIONS[position]
        nominal = np.array([column[0], column[1], REST_HEIGHT])
        seed = self._map.posture(grasp_position(nominal, gripper), gripper)
        cell = self.posture(position, gripper)
        if seed is None or cell is None:
            raise Infeasible(f"gripper {gripper} does not reach a cube on the table there")
        x, y, z = X_WO.translation()
        p_WO = np.array([x, y, np.clip(z, *GRASP_HEIGHTS)])
        X_WG = gripper_pose(grasp_position(p_WO, gripper), gripper)

        paths = self._empty_hand(MAX_OPENING, X_WO)
        answer = self._solver.solve(X_WG, seed=seed)
        if answer.q is None:
            raise Infeasible(f"gripper {gripper} at the cube: {answer.failure}")
        down = self._straight_up(paths, answer.q, APPROACH)[::-1]
        via = self._via(position, gripper)
        path = self._path(paths, q, down[0], [via, *self._crossroads(position)])
        approach = _rounded(paths, wind_path(paths.scene, [*path, *down[1:]]))
        q_grasp = approach.waypoints[-1]

        paths = self._empty_hand(CUBE_EDGE, None)
        if not paths.scene.is_free(q_grasp, CLOSED_MARGIN):
            raise Infeasible(f"gripper {gripper} at the cube: closed, it touches something")
        height = max(0.0, GRID_Z[0] - X_WG.translation()[2])
        lift = self._straight_up(paths, q_grasp, height, CLOSED_MARGIN)
        centring = self._path(self._carrying, lift[-1], cell, [via])
        opening = () if width > MAX_OPENING - 1e-3 else (OPEN,)
        raising = _rounded(self._carrying, np.vstack([lift, centring[1:]]))
        return (*opening, approach, CLOSE, raising)

    def _drop(
        self, position: int, gripper: int, q: np.ndarray, X_WO: RigidTransform
    ) -> tuple[Move | Grip, ...]:
        """Open, withdraw straight up, and go home."""
        paths = self._empty_hand(MAX_OPENING, None)
        if not paths.scene.is_free(q, MARGIN):
            raise Infeasible("there is no room to open the fingers")
        up = self._withdraw(paths, q)
        x, y, _ = X_WO.translation()
        paths = self._empty_hand(MAX_OPENING, RigidTransform(np.array([x, y, REST_HEIGHT])))
        vias = [self._via(position, gripper), *self._crossroads(position)]
        home = self._path(paths, up[-1], HOME, vias)
        return OPEN, _rounded(paths, np.vstack([up, home[1:]]))

    def _withdraw(self, paths: PathPlanner, q: np.ndarray) -> np.ndarray:
        """Waypoints ``[n, 7]`` [rad] straight up, by the first of `WITHDRAWALS` that works."""
        for height in WITHDRAWALS[:-1]:
            with suppress(Infeasible):
                return self._straight_up(paths, q, height)
        return self._straight_up(paths, q, WITHDRAWALS[-1])

    def _straight_up(
        self, paths: PathPlanner, q: np.ndarray, height: float, margin: float = MARGIN
    ) -> np.ndarray:
        """Waypoints ``[n, 7]`` [rad] that raise the hand by ``height`` [m] without turning it."""
        scene = paths.scene
        X_WG = scene.forward(q)
        waypoints = [q]
        for rise in np.linspace(0.0, height, int(np.ceil(height / RISE)) + 1)[1:]:
            X_target = RigidTransform(X_WG.rotation(), X_WG.translation() + rise * _UP)
            q_next = follow(scene, X_target, waypoints[-1])
            if q_next is None or np.abs(q_next - waypoints[-1]).max() > JOINT_STEP:
                raise Infeasible("no posture follows the hand straight up")
            if not paths.segment_is_free(waypoints[-1], q_next, margin):
                raise Infeasible(f"straight up: too near, {scene.clearance(q_next).bodies}")
            waypoints.append(q_next)
        return np.array(waypoints)

    def _path(
        self,
        paths: PathPlanner,
        q: np.ndarray,
        goal: np.ndarray,
        vias: Sequence[Sequence[np.ndarray]],
    ) -> np.ndarray:
        search = np.random.default_rng(0) if self._search else None
        path = paths.plan(q, goal, vias, search=search)
        if path is None:
            raise Infeasible("no free path found")
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
