"""Collision-free joint paths of straight segments.

A path is a list of waypoints ``[n, 7]`` [rad]; between two of them the joints move in
proportion. Endless joints take the shorter way round, so each waypoint is wound towards the
one before.

A segment counts as free if it is proved free along its whole length: at some configurations
distances are queried and found above the margin, and the `MotionBounds` of these leave no gap.
"""

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
from pydrake.math import RigidTransform

from models.arrays import finite_array, finite_number
from models.errors import ModelError
from models.motion.bounds import QUERY, MotionBounds
from models.motion.rrt_connect import Space, connect
from models.scenes.limits import LARGEST
from models.scenes.planning_scene import MARGIN, PlanningScene

PROVED = 0.5
"""Share of the margin that is proved between the configurations that keep all of it."""
TOUCHING = 1e-4
"""Distance of a start from which no way is proved free [m]."""
LEEWAY = 0.03
"""How far the robot may move from a start that does not keep the margin, to gain it [m]."""
CORNER_QUERY = 0.2
"""How far to look for distances at a corner that is to be rounded [m]."""


class _Segment:
    """A straight motion, and what the bounds prove of it; places on it are shares, 0 to 1."""

    def __init__(self, bounds: MotionBounds, q_from: np.ndarray, step: np.ndarray) -> None:
        self._bounds, self._from, self._step = bounds, q_from, step
        self.rates = bounds.rates(step)

    def free_share(self, at: float, margin: float) -> float:
        """How far the segment is surely free about a place, −1 if it does not keep the margin."""
        q, query = self._from + at * self._step, max(QUERY, 2.0 * margin)
        return self._bounds.free_share(
            q, self.rates, margin=margin, kept=PROVED * margin, query=query
        )

    def is_free(self, low: float, high: float, margin: float) -> bool:
        """Whether all between two places keeps `PROVED` of the margin."""
        # The widest gaps come first: a segment that collides mostly does so for a good part of it.
        gaps = [(low, high)]
        for begin, end in gaps:
            if begin < end:
                middle = (begin + end) / 2.0
                share = self.free_share(middle, margin)
                if share < 0.0:
                    return False
                gaps += [(begin, middle - share), (middle + share, end)]
        return True


class PathPlanner:
    """Free paths in one scene, whose robot is measured once.

    The fingers may open and the cube may move between two questions: the scene is asked as it is.

    Attributes:
        scene: the robot and what to keep clear of.
        margin: smallest allowed distance [m].
    """

    def __init__(self, scene: PlanningScene, margin: float = MARGIN) -> None:
        """Measure the robot of ``scene``.

        Raises:
            ModelError: if the margin is not above 0, or something in the scene moves in a way that
                no proof covers.
        """
        if not isinstance(scene, PlanningScene):
            raise ModelError(f"scene: {type(scene).__name__}; valid: a PlanningScene")
        self.scene, self.margin = scene, _checked_margin(margin)
        self._bounds = MotionBounds(scene)

    def carry(self, X_GO: RigidTransform) -> None:
        """Have the scene's carried cube lie in the hand at ``X_GO`` (`PlanningScene.carry`)."""
        self._bounds.carry(X_GO)

    def segment_is_free(
        self, q_from: np.ndarray, q_to: np.ndarray, margin: float | None = None
    ) -> bool:
        """Whether the straight segment keeps its distances: `PROVED` of the margin everywhere.

        Every configuration looked at keeps all of the margin, the end among them. A start that
        does not is where the robot already is: for `LEEWAY` it is then proved to come no nearer
        than to a quarter of the distance at the start. From a start nearer than `TOUCHING` nothing
        can be proved. Joint limits are not looked at.

        Args:
            q_from: ``[7]`` [rad].
            q_to: ``[7]`` [rad]; wound towards ``q_from`` first.
            margin: a smallest allowed distance other than the planner's [m].

        Raises:
            ModelError: if a posture is none, or the margin is not above 0.
        """
        q_from, q_to = (
            self.scene.require_posture(q, name) for q, name in ((q_from, "q_from"), (q_to, "q_to"))
        )
        margin = self.margin if margin is None else _checked_margin(margin)
        segment = _Segment(self._bounds, q_from, self.scene.wind(q_to, q_from) - q_from)
        last = segment.free_share(1.0, margin)
        if last < 0.0:
            return False
        first = segment.free_share(0.0, margin)
        if first < 0.0:
            start = self.scene.clearance(q_from, margin).distance
            first = LEEWAY / max(segment.rates.max(), LEEWAY)
            if start < TOUCHING or not segment.is_free(0.0, first, start / 2.0):
                return False
        return segment.is_free(first, 1.0 - last, margin)

    def plan(
        self,
        q_from: np.ndarray,
        q_to: np.ndarray,
        vias: Iterable[Sequence[np.ndarray]] = (),
        search: np.random.Generator | None = None,
        room: float | None = None,
    ) -> np.ndarray | None:
        """Find a free path: the straight one, else the first through vias, else by search.

        Args:
            q_from: ``[7]`` [rad].
            q_to: ``[7]`` [rad]; endless joints may end other turns away.
            vias: lists of configurations ``[7]`` [rad] to go through, tried in order.
            search: source of the samples of an RRT-Connect search; None does without.
            room: a larger distance [m]: straight paths and vias that keep it come first.

        Returns:
            Waypoints ``[n, 7]`` [rad] from ``q_from`` to ``q_to``, None if none was found.

        Raises:
            ModelError: if a posture is none, or ``q_to`` or a via is beyond a joint limit;
                ``q_from`` may be; or if the room is less than the margin.
        """
        scene = self.scene
        q_from, q_to = (
            scene.require_posture(q, name) for q, name in ((q_from, "q_from"), (q_to, "q_to"))
        )
        scene.limits.require(q_to, "q_to")
        if np.abs(np.where(scene.continuous, q_from, 0.0)).max() > LARGEST:
            scene.limits.require(q_from, "q_from")
        if search is not None and not isinstance(search, np.random.Generator):
            raise ModelError(f"search: {search!r}; valid: a numpy.random.Generator or None")
        vias = [tuple(between) for between in vias]
        for via in (q for between in vias for q in between):
            scene.limits.require(scene.require_posture(via, "via"), "via")
        margins = [self.margin]
        if room is not None:
            if not _checked_margin(room) >= self.margin:
                raise ModelError(
                    f"room {room:g}; valid: the planner's margin, {self.margin:g}, or more"
                )
            if scene.is_free(q_from, room) and scene.is_free(q_to, room):
                margins = [room, self.margin]
        for margin in margins:
            for between in [(), *vias]:
                path = wind_path(scene, [q_from, *between, q_to])
                if all(self.segment_is_free(a, b, margin) for a, b in pairwise(path)):
                    return path
        if search is None or not scene.is_free(q_to, self.margin):
            return None
        lower = np.where(scene.continuous, q_from - np.pi, scene.lower)
        upper = np.where(scene.continuous, q_from + np.pi, scene.upper)
        space = Space(self.segment_is_free, lower, upper, self._bounds.levers[-1])
        found = connect(q_from, scene.wind(q_to, q_from), space, search)
        return None if found is None else wind_path(scene, list(found))

    def corner_cuts(self, waypoints: np.ndarray) -> np.ndarray:
        """How far before and after each waypoint a motion may leave the path to round its corner.

        A corner and the points ``cut`` before and after it span a triangle. The bounds at the
        corner prove the two points free, and with them all the triangle: a bound on the motion is
        a norm, so it is largest at a vertex. Corners keep the margin, triangles `PROVED` of it.

        Args:
            waypoints: ``[n, 7]`` [rad] of a free path.

        Returns:
            Lengths in joint space ``[n]`` [rad], at most half a segment; 0 at both ends and at
            corners that do not keep the margin.

        Raises:
            ModelError: if the waypoints are none.
        """
        bounds, margin = self._bounds, self.margin
        waypoints = finite_array(waypoints, (len(self.scene.arm_index),), "waypoints")
        if waypoints.ndim != 2:
            raise ModelError(f"waypoints: shape {list(waypoints.shape)}; valid: [n, 7] angles")
        steps = np.diff(waypoints, axis=0)
        lengths = np.linalg.norm(steps, axis=1)
        cuts = np.zeros(len(waypoints))
        query = max(CORNER_QUERY, 2.0 * margin)
        for i in range(1, len(waypoints) - 1):
            before, after = lengths[i - 1], lengths[i]
            if min(before, after) > 0.0:
                rates = np.maximum(
                    bounds.rates(steps[i - 1] / before), bounds.rates(steps[i] / after)
                )
                proved = bounds.free_share(
                    waypoints[i], rates, margin=margin, kept=PROVED * margin, query=query
                )
                # Half of what is proved, so as not to spend the whole distance on speed.
                cuts[i] = np.clip(proved, 0.0, min(before, after)) / 2.0
        return cuts


def plan_path(
    scene: PlanningScene,
    q_from: np.ndarray,
    q_to: np.ndarray,
    vias: Iterable[Sequence[np.ndarray]] = (),
    margin: float = MARGIN,
    search: np.random.Generator | None = None,
) -> np.ndarray | None:
    """Answer one question: `PathPlanner.plan` of a planner made for it.

    The arguments are those of the planner and of its method. Measuring the scene's robot takes
    some 50 ms, so whoever asks often keeps a `PathPlanner`.
    """
    return PathPlanner(scene, margin).plan(q_from, q_to, vias, search)


def wind_path(scene: PlanningScene, waypoints: Sequence[np.ndarray]) -> np.ndarray:
    """Waypoints ``[n, 7]`` [rad], each wound towards the one before."""
    path = [np.asarray(waypoints[0], dtype=float)]
    for q in waypoints[1:]:
        path.append(scene.wind(q, path[-1]))
    return np.array(path)


def _checked_margin(margin: float) -> float:
    return finite_number(margin, "margin", above=0.0, valid="metres above 0")
