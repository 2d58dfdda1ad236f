"""How far the robot can move from a configuration before anything can touch: a certificate.

When joint j turns by Δq_j, no point beyond it moves further than its lever, the farthest that
the point can ever be from the joint's axis, times |Δq_j|. Two bodies at a distance d with the
joints lo + 1 … hi between them therefore stay at least d − Σ lever_j |Δq_j| apart. One distance
query thus proves a neighbourhood of its configuration free, and neighbourhoods that overlap
prove a path.
"""

import numpy as np
from pydrake.geometry import GeometryId
from pydrake.math import RigidTransform

from models.errors import ModelError
from models.scenes import gripper
from models.scenes.planning_scene import PlanningScene
from models.scenes.robots import Robot
from models.scenes.topology import links_of_bodies
from models.task.spaces import CUBE_EDGE

QUERY = 0.03
"""How far to look for distances [m]; looking further costs more than it saves on a segment."""

_OPENINGS = 17
_SLACK = 1e-4  # by how much fingers between two of as many openings can reach further [m]
_CORNERS = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8)


class MotionBounds:
    """Levers of a scene's robot with all that is welded to it, whatever the opening of its fingers.

    Attributes:
        scene: the robot and what to keep clear of.
        levers: ``[n + 1, n]`` [m] for n joints: the farthest that any collision shape of link
            0 … n can be from the axis of each joint up to its own, 0 for the joints beyond.
            Link 0 stands still, link n is the last with the hand and what these carry.
    """

    def __init__(self, scene: PlanningScene) -> None:
        """Measure the collision shapes of ``scene``.

        Raises:
            ModelError: if the bounds do not cover the scene: something moves with the arm and by
                a joint of its own, or has no bounded shape.
        """
        self.scene = scene
        plant = scene.plant
        self._query_port = plant.get_geometry_query_input_port()
        joints = [plant.GetJointByName(name, scene.arm_instance) for name in scene.robot.joints]
        n_joints = len(joints)
        links = links_of_bodies(scene)

        context = plant.CreateDefaultContext()
        plant.SetPositions(context, scene.arm_instance, np.zeros(n_joints))
        axes = [joint.frame_on_child().CalcPoseInWorld(context) for joint in joints]
        self._axes, self._centres = axes, _centres(axes)
        self._link: dict[GeometryId, int] = {}
        boxes = []
        for index, link in links.items():
            body = plant.get_body(index)
            for geometry in plant.GetCollisionGeometriesForBody(body):
                self._link[geometry] = link
                if geometry != scene.carried:
                    boxes.append((link, body, self._corners(geometry)))

        self._bare = np.zeros((n_joints + 1, n_joints))
        for fingers in _openings(scene.robot):
            for name, angle in zip(scene.robot.finger_joints, fingers, strict=True):
                plant.GetJointByName(name, scene.hand_instance).set_angle(context, angle)
            for link, body, corners in boxes:
                if link:
                    self._lengthen(self._bare, link, body.EvalPoseInWorld(context) @ corners)
        self.levers = self._bare.copy()
        if scene.carried is not None:
            corners = self._corners(scene.carried)
            body = plant.GetFrameByName("tcp").body()
            self._lengthen(self.levers, n_joints, body.EvalPoseInWorld(context) @ corners)

    def carry(self, X_GO: RigidTransform) -> None:
        """Have the scene's carried cube lie in the hand at ``X_GO`` (`PlanningScene.carry`)."""
        self.scene.carry(X_GO)
        X_WO = self.scene.forward(np.zeros(len(self._axes))) @ X_GO
        self.levers = self._bare.copy()
        self._lengthen(self.levers, len(self._axes), X_WO @ (0.5 * CUBE_EDGE * _CORNERS))

    def _lengthen(self, levers: np.ndarray, link: int, points: np.ndarray) -> None:
        """Make ``levers`` reach ``points [3, n]`` [m] of a link, in the world with all joints 0."""
        own = levers[link, :link]
        np.maximum(own, _levers(points, self._axes[:link], self._centres[:link]), out=own)

    def _corners(self, geometry: GeometryId) -> np.ndarray:
        """Corners ``[3, 8]`` [m] of a box about a shape, in its body's frame."""
        inspector = self.scene.inspector
        box = inspector.GetObbInGeometryFrame(geometry)
        if box is None:
            raise ModelError(
                f"{inspector.GetName(geometry)}: {inspector.GetShape(geometry)} has no bounds, nor "
                "does Drake measure distances to it; valid: any bounded collision shape"
            )
        corners = box.pose() @ (box.half_width()[:, None] * _CORNERS)
        return inspector.GetPoseInFrame(geometry) @ corners

    def rates(self, step: np.ndarray) -> np.ndarray:
        """Bound ``[n + 1, n + 1]`` [m] on link hi's motion, seen from lo, by ``step [n]`` [rad]."""
        upto = np.zeros(2 * (len(self.levers),))
        np.cumsum(self.levers * np.abs(step), axis=1, out=upto[:, 1:])
        seen = np.tril(np.diagonal(upto)[:, None] - upto)
        return seen + seen.T

    def free_share(
        self,
        q: np.ndarray,
        rates: np.ndarray,
        *,
        margin: float,
        kept: float,
        query: float = QUERY,
    ) -> float:
        """Share of a step that can be taken from ``q [7]``, either way, surely free.

        Args:
            q: where the step is taken [rad].
            rates: of the step, from `rates`.
            margin: distances at ``q`` must be above [m].
            kept: distances on the way stay above [m]; less than ``margin``.
            query: larger distances count as this [m]; more than ``margin``.

        Returns:
            The share, above 0 and perhaps above 1; −1 if a distance at ``q`` is within ``margin``.
        """
        self.scene.forward(q)
        geometry = self._query_port.Eval(self.scene.context)
        share = (query - kept) / max(float(rates.max()), 1e-9)
        for pair in geometry.ComputeSignedDistancePairwiseClosestPoints(query):
            if pair.distance <= margin:
                return -1.0
            rate = rates[self._link[pair.id_A], self._link[pair.id_B]]
            if pair.distance - kept < share * rate:
                share = (pair.distance - kept) / rate
        return float(share)


def _openings(robot: Robot) -> list[np.ndarray]:
    """Positions of the fingers' joints [rad] from open to closed."""
    if robot.finger_joints == gripper.JOINTS:
        knuckles = np.linspace(0.0, gripper.KNUCKLE_LIMIT, _OPENINGS)
        return [gripper.joint_positions(knuckle) for knuckle in knuckles]
    return [robot.finger_positions(w) for w in np.linspace(0.0, robot.max_opening, _OPENINGS)]


def _centres(axes: list[RigidTransform]) -> list[np.ndarray]:
    """The point on each joint's axis that is nearest to the next axis, or the one before."""
    centres = []
    for i, X_WJ in enumerate(axes):
        X_WK = axes[i + 1] if i + 1 < len(axes) else axes[i - 1]
        u, v = X_WJ.rotation().matrix()[:, 2], X_WK.rotation().matrix()[:, 2]
        between, cosine = X_WK.translation() - X_WJ.translation(), u @ v
        # Of a parallel axis every point is as near.
        parallel = 1.0 - cosine**2 < 1e-9
        cosine = 0.0 if parallel else cosine
        along = (between @ u - cosine * (between @ v)) / (1.0 - cosine**2)
        centres.append(X_WJ.translation() + along * u)
    return centres


def _levers(
    points: np.ndarray, axes: list[RigidTransform], centres: list[np.ndarray]
) -> np.ndarray:
    """Farthest that ``points [3, n]`` beyond the last axis can be from each of the axes."""
    offsets = points.T - centres[-1]
    own = np.linalg.norm(np.cross(offsets, axes[-1].rotation().matrix()[:, 2]), axis=1).max()
    # Seen from a joint further in, the chain of centres may stretch straight.
    reach = np.linalg.norm(offsets, axis=1).max()
    links = np.linalg.norm(np.diff(centres, axis=0), axis=1)
    inner = reach + np.cumsum(links[::-1])[::-1]
    return np.append(inner, own) + _SLACK
