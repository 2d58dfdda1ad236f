"""A fast collision check of the Gen3: each of Drake's collision shapes inside a capsule.

Shapes of the hand among themselves, and of the hand and the link before it, are left to the exact
query altogether: their capsules always touch, and at a margin of some millimetres the shapes
never do.

A capsule about a capsule is the shape itself, so a collision of two of them, or of one with a
box of the furniture, is certain. Cylinders and boxes of wrist and hand are smaller than their
capsules: where these touch, only the exact distance query can tell.

All frames are axis-aligned with the arm's base B, whose position in the world is the only thing
that furniture needs to know.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Box, Capsule, Cylinder, GeometryId, Role, Shape
from pydrake.math import RigidTransform

from models.compiled import compiled
from models.errors import ModelError
from models.gen3.chain import Array, link_frames
from models.scenes.planning_scene import PlanningScene
from models.scenes.topology import links_of_bodies

FREE, DOUBTFUL, SELF, FURNITURE = 0, 1, 2, 3
"""Verdicts: free; only the exact query can tell; certain collisions, by what the robot meets."""
HAND_LINK = 7
"""The link that carries bracelet, gripper, what the gripper holds and tools welded to these."""

_SLACK = 1e-5  # on both sides of the margin, for Drake's iterative distances [m]
_BISECTIONS = 24


_Placed = tuple[int, Array, Array, float, bool, bool]
"""Link, ends of the axis, radius, whether exact, whether of arm and hand proper."""


class Capsules(NamedTuple):
    """Capsules of the robot and boxes of the furniture, as arrays for compiled code.

    Attributes:
        link: ``[n]``, 0 (base) to 7 (hand), the link whose frame the capsule is fixed in.
        start: one end of its axis in that frame ``[n, 3]`` [m].
        end: the other ``[n, 3]`` [m].
        radius: ``[n]`` [m].
        exact: whether the capsule is Drake's shape itself ``[n]``.
        pairs: capsules that may collide ``[m, 2]``.
        low: lower corners of the boxes in B ``[k, 3]`` [m].
        high: upper corners ``[k, 3]`` [m].
        against: capsule and box that may collide ``[l, 2]``.
    """

    link: NDArray[np.int64]
    start: Array
    end: Array
    radius: Array
    exact: NDArray[np.bool_]
    pairs: NDArray[np.int64]
    low: Array
    high: Array
    against: NDArray[np.int64]


def enclose(shape: Shape) -> tuple[Array, float, bool]:
    """The capsule about a shape: half its axis ``[3]`` [m], its radius [m], whether it is exact.

    Raises:
        ModelError: if the shape is not a capsule, cylinder or box.
    """
    if isinstance(shape, Capsule):
        return np.array([0.0, 0.0, shape.length() / 2]), shape.radius(), True
    if isinstance(shape, Cylinder):
        return np.array([0.0, 0.0, shape.length() / 2]), shape.radius(), False
    if isinstance(shape, Box):
        half = np.array(shape.size()) / 2
        axis = int(half.argmax())
        return half * np.eye(3)[axis], float(np.linalg.norm(np.delete(half, axis))), False
    raise ModelError(f"collision shape {shape}; valid: capsule, cylinder, box")


def capsules_of(scene: PlanningScene) -> Capsules:
    """Capsules about what a scene's robot consists of, the fingers as they stand.

    Tools count with the link that they are welded to. The cube as an obstacle is left out: it
    moves.

    Raises:
        ModelError: if a shape is not a capsule, cylinder or box, a piece of furniture is turned, or
            something else than arm and fingers moves.
    """
    plant, inspector, context = scene.plant, scene.inspector, scene.context
    joints = [plant.GetJointByName(f"joint_{i}", scene.arm_instance) for i in range(1, 8)]
    link_of = links_of_bodies(scene)
    own = (scene.arm_instance, scene.hand_instance)
    links = [joints[0].parent_body(), *(joint.child_body() for joint in joints)]
    X_BW = links[0].EvalPoseInWorld(context).inverse()
    standing = {body.index() for body in plant.GetBodiesWeldedTo(plant.world_body())}
    index: dict[GeometryId, int] = {}
    robot: list[_Placed] = []
    boxes: list[tuple[Array, Array]] = []
    for geometry in inspector.GetAllGeometryIds(Role.kProximity):
        body = plant.GetBodyFromFrameId(inspector.GetFrameId(geometry))
        X_WS = body.EvalPoseInWorld(context) @ inspector.GetPoseInFrame(geometry)
        shape = inspector.GetShape(geometry)
        if body.index() in standing and body.index() != links[0].index():
            X_BS = X_BW @ X_WS
            if not (isinstance(shape, Box) and X_BS.rotation().IsNearlyIdentity(1e-12)):
                raise ModelError(f"{body.name()}: valid furniture: boxes parallel to the base")
            index[geometry] = len(boxes)
            extent = np.array(shape.size()) / 2
            boxes.append((X_BS.translation() - extent, X_BS.translation() + extent))
        elif body.model_instance() != scene.cube.model_instance():
            link = link_of[body.index()]
            if not link and body.index() != links[0].index():
                raise ModelError(f"{body.name()}: moves without the arm; valid: the cube alone")
            X_LS: RigidTransform = links[link].EvalPoseInWorld(context).InvertAndCompose(X_WS)
            half, radius, exact = enclose(shape)
            index[geometry] = -1 - len(robot)
            placed = (link, X_LS @ -half, X_LS @ half, radius, exact, body.model_instance() in own)
            robot.append(placed)
    # Robot's shapes have negative indices here, so that sorting puts furniture last.
    candidates = [
        sorted(index[geometry] for geometry in pair)
        for pair in inspector.GetCollisionCandidates()
        if all(geometry in index for geometry in pair)
    ]
    pairs = sorted((-1 - b, -1 - a) for a, b in candidates if b < 0)
    pairs = [(a, b) for a, b in pairs if not _are_neighbours(robot[a], robot[b])]
    against = sorted((-1 - a, b) for a, b in candidates if a < 0 <= b)
    links_of, starts, ends, radii, exactness, _ = zip(*robot, strict=True)
    low, high = zip(*boxes, strict=True)
    return Capsules(
        link=np.array(links_of),
        start=np.array(starts),
        end=np.array(ends),
        radius=np.array(radii),
        exact=np.array(exactness),
        pairs=np.array(pairs),
        low=np.array(low),
        high=np.array(high),
        against=np.array(against),
    )


def _are_neighbours(a: _Placed, b: _Placed) -> bool:
    """Whether hand and wrist are so near at every posture that the capsule of one tells nothing.

    A tool's capsule may touch them as well, but then its shape may, too.
    """
    return abs(a[0] - b[0]) <= 1 and not (a[4] and b[4]) and a[5] and b[5]


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
    result = FREE
    for i in range(len(capsules.against)):
        a, box = capsules.against[i, 0], capsules.against[i, 1]
        if not hand and capsules.link[a] == HAND_LINK:
            continue
        limit = margin + capsules.radius[a]
        squared = _to_box(start[a], end[a], capsules.low[box], capsules.high[box], limit + _SLACK)
        if squared < (limit + _SLACK) ** 2:
            if capsules.exact[a] and squared < (limit - _SLACK) ** 2:
                return FURNITURE
            result = DOUBTFUL
    for i in range(len(capsules.pairs)):
        a, b = capsules.pairs[i, 0], capsules.pairs[i, 1]
        limit = margin + capsules.radius[a] + capsules.radius[b]
        squared = _to_segment(start[a], end[a], start[b], end[b], limit + _SLACK)
        if squared < (limit + _SLACK) ** 2:
            if capsules.exact[a] and capsules.exact[b] and squared < (limit - _SLACK) ** 2:
                return SELF
            result = DOUBTFUL
    return result


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


@compiled(error_model="numpy")
def _to_segment(a: Array, b: Array, c: Array, d: Array, limit: float) -> float:
    """Squared distance of segments ab and cd [m²]; larger, but above ``limit``², if far apart."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = d[0] - c[0], d[1] - c[1], d[2] - c[2]
    wx, wy, wz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    uu, vv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
    # Between the middles, against both halves and the limit.
    mx, my, mz = wx + 0.5 * (vx - ux), wy + 0.5 * (vy - uy), wz + 0.5 * (vz - uz)
    between = mx * mx + my * my + mz * mz
    reach = limit + 0.5 * (np.sqrt(uu) + np.sqrt(vv))
    if between > reach * reach:
        return np.inf
    uv = ux * vx + uy * vy + uz * vz
    uw, vw = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
    # The nearest points a + s·u and c + t·v: free minimum, then clamped one after the other.
    det = uu * vv - uv * uv
    s = min(max((uw * vv - uv * vw) / det, 0.0), 1.0) if det > 1e-12 * uu * vv else 0.0
    t = (s * uv - vw) / vv
    if t < 0.0 or t > 1.0:
        t = min(max(t, 0.0), 1.0)
        s = min(max((t * uv + uw) / uu, 0.0), 1.0)
    x, y, z = wx + t * vx - s * ux, wy + t * vy - s * uy, wz + t * vz - s * uz
    return x * x + y * y + z * z


@compiled(error_model="numpy")
def _to_box(a: Array, b: Array, low: Array, high: Array, limit: float) -> float:
    """Squared distance of segment ab and a box [m²]; larger, but above ``limit``², if far apart.

    It is convex along the segment: bisection on the sign of its slope.
    """
    for k in range(3):
        if min(a[k], b[k]) > high[k] + limit or max(a[k], b[k]) < low[k] - limit:
            return np.inf
    left, right = 0.0, 1.0
    squared = np.inf
    for _ in range(_BISECTIONS):
        t = 0.5 * (left + right)
        value, slope = 0.0, 0.0
        for k in range(3):
            x = a[k] + t * (b[k] - a[k])
            outside = x - high[k] if x > high[k] else min(x - low[k], 0.0)
            value += outside * outside
            slope += outside * (b[k] - a[k])
        squared = min(squared, value)
        if value == 0.0 or slope == 0.0:
            break
        if slope > 0.0:
            right = t
        else:
            left = t
    return squared
