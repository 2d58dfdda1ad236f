"""A fast collision check of the Gen3: each of Drake's collision shapes inside a capsule.

Where capsules about two shapes are apart, so are the shapes. Where capsules within two shapes
overlap, the shapes collide for certain; a capsule and a ball are the shape themselves, within a
cylinder or a box there is a smaller one. Between the two, only the exact distance query can tell,
and so it is for shapes of which there is no capsule: the check saves queries, it decides none.

Shapes of the hand among themselves, and of the hand and the link before it, are left to the exact
query altogether: their capsules always touch, and at a margin of some millimetres the shapes
never do.

All frames are fixed in the arm's base B: where it is in the world, and how it is turned, does not
matter. What stands still counts with link 0; boxes that do are boxes.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Box, Capsule, Cylinder, GeometryId, Role, Shape, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.tree import BodyIndex

from models.compiled import compiled
from models.gen3.chain import Array, link_frames
from models.gen3.segments import to_box, to_segment
from models.scenes.planning_scene import PlanningScene

FREE, DOUBTFUL, SELF, FURNITURE = 0, 1, 2, 3
"""Verdicts: free; only the exact query can tell; certain collisions, by what the robot meets."""
HAND_LINK = 7
"""The link that carries bracelet, gripper, what the gripper holds and tools welded to these."""

_SLACK = 1e-5  # on both sides of the margin, for Drake's iterative distances [m]
_NONE = np.array([np.nan, np.nan])


class Enclosure(NamedTuple):
    """A capsule about a shape, and one within it.

    Attributes:
        centre: of both, in the shape's frame ``[3]`` [m].
        half: half the axis of the capsule about the shape ``[3]`` [m].
        radius: of that [m].
        core: of the one within, share of ``half`` and radius [m] ``[2]``; NaN if there is none.
    """

    centre: Array
    half: Array
    radius: float
    core: Array


class _Placed(NamedTuple):
    """A shape of the robot, or one that stands still and is no box."""

    link: int
    capsule: Enclosure
    X_LS: RigidTransform
    own: bool  # of arm and hand proper
    robot: bool


class Capsules(NamedTuple):
    """Capsules of robot and furniture, and boxes of the furniture, as arrays for compiled code.

    Attributes:
        link: ``[n]``, 0 (base, furniture) to 7 (hand), in whose frame the capsule is fixed.
        robot: whether it is the robot's ``[n]``.
        start: one end of its axis in that frame ``[n, 3]`` [m].
        end: the other ``[n, 3]`` [m].
        radius: ``[n]`` [m].
        core: of the capsule within the shape, as in `Enclosure` ``[n, 2]``.
        pairs: capsules that may collide ``[m, 2]``.
        centre: of the boxes in B ``[k, 3]`` [m].
        turn: their rotations in B ``[k, 3, 3]``.
        extent: half their edges ``[k, 3]`` [m].
        against: capsule and box that may collide ``[l, 2]``.
        complete: whether every shape has its capsule; if not, nothing is proved free.
    """

    link: NDArray[np.int64]
    robot: NDArray[np.bool_]
    start: Array
    end: Array
    radius: Array
    core: Array
    pairs: NDArray[np.int64]
    centre: Array
    turn: Array
    extent: Array
    against: NDArray[np.int64]
    complete: bool


def enclose(shape: Shape) -> Enclosure | None:
    """The capsules about and within a shape, None if it is no capsule, ball, cylinder or box."""
    zero = np.zeros(3)
    if isinstance(shape, Sphere):
        return Enclosure(zero, zero, shape.radius(), np.array([1.0, shape.radius()]))
    if isinstance(shape, Capsule):
        half, radius = np.array([0.0, 0.0, shape.length() / 2]), shape.radius()
        return Enclosure(zero, half, radius, np.array([1.0, radius]))
    if isinstance(shape, Cylinder):
        half, radius = np.array([0.0, 0.0, shape.length() / 2]), shape.radius()
        within = min(radius, half[2])
        return Enclosure(zero, half, radius, np.array([1.0 - within / half[2], within]))
    if isinstance(shape, Box):
        half = np.array(shape.size()) / 2
        axis = int(half.argmax())
        across = np.delete(half, axis)
        core = np.array([1.0 - across.min() / half[axis], across.min()])
        return Enclosure(zero, half * np.eye(3)[axis], float(np.linalg.norm(across)), core)
    return None


def capsules_of(scene: PlanningScene) -> Capsules:
    """Capsules about what a scene's robot consists of, the fingers open, and about furniture.

    Tools count with the link that they are welded to. The cube as an obstacle is left out: it
    moves, and so does whatever has joints of its own.
    """
    plant, inspector = scene.plant, scene.inspector
    # One posture and opening, whatever the scene was asked before.
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, scene.arm_instance, np.zeros(7))
    joints = [plant.GetJointByName(f"joint_{i}", scene.arm_instance) for i in range(1, 8)]
    links = [joints[0].parent_body(), *(joint.child_body() for joint in joints)]
    link_of = _links_of_bodies(scene, [link.index() for link in links])
    X_BW = links[0].EvalPoseInWorld(context).inverse()
    standing = {body.index() for body in plant.GetBodiesWeldedTo(plant.world_body())}
    own = {scene.arm_instance} | ({scene.hand_instance} if scene.robot.finger_joints else set())
    index: dict[GeometryId, int] = {}
    round_ones: list[_Placed] = []
    boxes: list[tuple[RigidTransform, Array]] = []
    left_out = False
    for geometry in inspector.GetAllGeometryIds(Role.kProximity):
        body = plant.GetBodyFromFrameId(inspector.GetFrameId(geometry))
        if body.model_instance() == scene.cube.model_instance():
            continue
        X_WS = body.EvalPoseInWorld(context) @ inspector.GetPoseInFrame(geometry)
        shape = inspector.GetShape(geometry)
        stands = body.index() in standing and body.index() != links[0].index()
        if stands and isinstance(shape, Box):
            index[geometry] = len(boxes)
            boxes.append((X_BW @ X_WS, np.array(shape.size()) / 2))
            continue
        capsule = enclose(shape) or _about_box(scene, geometry)
        link = link_of.get(body.index())
        if capsule is None or link is None:
            left_out = True
            continue
        # Fingers move.
        if not stands and body.index() not in _rigid(scene, links[link].index()):
            capsule = capsule._replace(core=_NONE)
        X_LS = links[link].EvalPoseInWorld(context).InvertAndCompose(X_WS)
        index[geometry] = -1 - len(round_ones)
        mine = body.model_instance() in own
        round_ones.append(_Placed(link, capsule, X_LS, mine, not stands))
    # Capsules have negative indices here, so that sorting puts boxes last.
    candidates = [
        sorted(index[geometry] for geometry in pair)
        for pair in inspector.GetCollisionCandidates()
        if all(geometry in index for geometry in pair)
    ]
    pairs = sorted((-1 - b, -1 - a) for a, b in candidates if b < 0)
    pairs = [(a, b) for a, b in pairs if not _are_neighbours(round_ones[a], round_ones[b])]
    against = sorted((-1 - a, b) for a, b in candidates if a < 0 <= b)
    ends = [
        [placed.X_LS @ (placed.capsule.centre + sign * placed.capsule.half) for sign in (-1, 1)]
        for placed in round_ones
    ]
    return Capsules(
        link=np.array([placed.link for placed in round_ones]),
        robot=np.array([placed.robot for placed in round_ones]),
        start=np.array([start for start, _ in ends]),
        end=np.array([end for _, end in ends]),
        radius=np.array([placed.capsule.radius for placed in round_ones]),
        core=np.array([placed.capsule.core for placed in round_ones]),
        pairs=np.array(pairs, dtype=np.int64).reshape(-1, 2),
        centre=np.array([X_BS.translation() for X_BS, _ in boxes]).reshape(-1, 3),
        turn=np.array([X_BS.rotation().matrix() for X_BS, _ in boxes]).reshape(-1, 3, 3),
        extent=np.array([extent for _, extent in boxes]).reshape(-1, 3),
        against=np.array(against, dtype=np.int64).reshape(-1, 2),
        complete=not left_out,
    )


def _rigid(scene: PlanningScene, link: BodyIndex) -> set[BodyIndex]:
    welded = scene.plant.GetBodiesWeldedTo(scene.plant.get_body(link))
    return {body.index() for body in welded}


def _links_of_bodies(scene: PlanningScene, links: list[BodyIndex]) -> dict[BodyIndex, int]:
    """Which link each body is welded to; fingers count with the hand."""
    link_of = dict.fromkeys(scene.plant.GetBodyIndices(scene.hand_instance), HAND_LINK)
    for number, link in enumerate(links):
        link_of |= dict.fromkeys(_rigid(scene, link), number)
    return link_of


def _about_box(scene: PlanningScene, geometry: GeometryId) -> Enclosure | None:
    """The capsule about a box about a shape, such as a mesh; None if the shape has no bounds."""
    box = scene.inspector.GetObbInGeometryFrame(geometry)
    about = None if box is None else enclose(Box(2.0 * np.maximum(box.half_width(), 1e-6)))
    if box is None or about is None:
        return None
    half = box.pose().rotation() @ about.half
    return Enclosure(box.pose().translation(), half, about.radius, _NONE)


def _are_neighbours(a: _Placed, b: _Placed) -> bool:
    """Whether hand and wrist are so near at every posture that the capsule of one tells nothing.

    A tool's capsule may touch them as well, but then its shape may, too.
    """
    alike = a.capsule.core[0] == b.capsule.core[0] == 1.0
    return abs(a.link - b.link) <= 1 and not alike and a.own and b.own


def verdicts(capsules: Capsules, q: Array, margin: float) -> NDArray[np.int64]:
    """`FREE`, `DOUBTFUL`, `SELF` or `FURNITURE` ``[n]`` at ``q [n, 7]`` with ``margin`` [m]."""
    return _verdicts(capsules, np.ascontiguousarray(q, dtype=np.float64), margin)


@compiled(error_model="numpy")
def _verdicts(capsules: Capsules, q: Array, margin: float) -> NDArray[np.int64]:
    frames, start, end = arrays(capsules)
    result = np.empty(len(q), dtype=np.int64)
    for i in range(len(q)):
        result[i] = check(capsules, q[i], margin, frames, start, end, True)
    return result


@compiled(error_model="numpy")
def arrays(capsules: Capsules) -> tuple[Array, Array, Array]:
    """What `check` works in: frames of the links, starts and ends of the capsules in B."""
    count = len(capsules.radius)
    return np.empty((8, 3, 4)), np.empty((count, 3)), np.empty((count, 3))


@compiled(error_model="numpy")
def check(
    capsules: Capsules,
    q: Array,
    margin: float,
    frames: Array,
    start: Array,
    end: Array,
    hand: bool,
) -> int:
    """One of `verdicts`; without ``hand``, leaving out the hand against the furniture."""
    link_frames(q, frames)
    place(capsules, frames, start, end)
    ends = np.empty((4, 3))
    result = FREE if capsules.complete else DOUBTFUL
    for i in range(len(capsules.against)):
        a, box = capsules.against[i, 0], capsules.against[i, 1]
        if not hand and capsules.link[a] == HAND_LINK:
            continue
        centre, turn, extent = capsules.centre[box], capsules.turn[box], capsules.extent[box]
        limit = margin + capsules.radius[a] + _SLACK
        if to_box(start[a], end[a], centre, turn, extent, limit, ends) < limit * limit:
            result = DOUBTFUL
            limit = margin + capsules.core[a, 1] - _SLACK
            _core(capsules, a, start, end, ends[2:])
            # Where there is no core, the comparison is one with NaN.
            squared = to_box(ends[2], ends[3], centre, turn, extent, limit, ends)
            if limit > 0.0 and squared < limit * limit:
                return FURNITURE
    for i in range(len(capsules.pairs)):
        a, b = capsules.pairs[i, 0], capsules.pairs[i, 1]
        mine = capsules.robot[a] and capsules.robot[b]
        if not hand and not mine and max(capsules.link[a], capsules.link[b]) == HAND_LINK:
            continue
        limit = margin + capsules.radius[a] + capsules.radius[b] + _SLACK
        if to_segment(start[a], end[a], start[b], end[b], limit) < limit * limit:
            result = DOUBTFUL
            limit = margin + capsules.core[a, 1] + capsules.core[b, 1] - _SLACK
            _core(capsules, a, start, end, ends[:2])
            _core(capsules, b, start, end, ends[2:])
            squared = to_segment(ends[0], ends[1], ends[2], ends[3], limit)
            if limit > 0.0 and squared < limit * limit:
                return SELF if mine else FURNITURE
    return result


@compiled(error_model="numpy")
def _core(capsules: Capsules, i: int, start: Array, end: Array, ends: Array) -> None:
    """Write the ends ``[2, 3]`` of the axis of the capsule within a shape; NaN if there is none."""
    share = capsules.core[i, 0]
    for k in range(3):
        middle, half = 0.5 * (start[i, k] + end[i, k]), 0.5 * share * (end[i, k] - start[i, k])
        ends[0, k], ends[1, k] = middle - half, middle + half


@compiled(error_model="numpy")
def place(capsules: Capsules, frames: Array, start: Array, end: Array) -> None:
    """Write the ends of the capsules in B ``[n, 3]``."""
    for i in range(len(capsules.radius)):
        link = capsules.link[i]
        for k in range(3):
            s = e = frames[link, k, 3]
            for j in range(3):
                s += frames[link, k, j] * capsules.start[i, j]
                e += frames[link, k, j] * capsules.end[i, j]
            start[i, k], end[i, k] = s, e
