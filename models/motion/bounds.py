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
from pydrake.multibody.tree import BodyIndex

from models.scenes import gripper
from models.scenes.parsing import ARM, GRIPPER
from models.scenes.planning_scene import PlanningScene

N_JOINTS = 7
QUERY = 0.03
"""How far to look for distances [m]; looking further costs more than it saves on a segment."""

_OPENINGS = 17
_SLACK = 1e-4  # by how much fingers between two of as many openings can reach further [m]
_CORNERS = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8)


class MotionBounds:
    """Levers of a scene's robot, whatever the opening of its fingers.

    Attributes:
        scene: the robot and what to keep clear of.
        levers: ``[8, 7]`` [m]: the farthest that any collision shape of link 0 … 7 can be from
            the axis of each joint up to its own, 0 for the joints beyond. Link 0 stands still,
            link 7 is the bracelet with the hand and what that carries.
    """

    def __init__(self, scene: PlanningScene) -> None:
        """Measure the collision shapes of ``scene``."""
        self.scene = scene
        plant = scene.plant
        self._query_port = plant.get_geometry_query_input_port()
        inspector = self._query_port.Eval(scene.context).inspector()
        arm, hand = (plant.GetModelInstanceByName(name) for name in (ARM, GRIPPER))
        joints = [plant.GetJointByName(f"joint_{i}", arm) for i in range(1, N_JOINTS + 1)]
        links = {joint.child_body().index(): i for i, joint in enumerate(joints, start=1)}
        links |= dict.fromkeys(plant.GetBodyIndices(hand), N_JOINTS)

        context = plant.CreateDefaultContext()
        plant.SetPositions(context, arm, np.zeros(N_JOINTS))
        axes = [joint.frame_on_child().CalcPoseInWorld(context) for joint in joints]
        centres = _centres(axes)
        self._link: dict[GeometryId, int] = {}
        boxes = []
        for number in range(plant.num_bodies()):
            body = plant.get_body(BodyIndex(number))
            link = links.get(body.index(), 0)
            for geometry in plant.GetCollisionGeometriesForBody(body):
                self._link[geometry] = link
                box = inspector.GetObbInGeometryFrame(geometry)
                corners = box.pose() @ (box.half_width()[:, None] * _CORNERS)
                boxes.append((link, body, inspector.GetPoseInFrame(geometry) @ corners))

        self.levers = np.zeros((N_JOINTS + 1, N_JOINTS))
        for knuckle in np.linspace(0.0, gripper.KNUCKLE_LIMIT, _OPENINGS):
            for name, angle in zip(gripper.JOINTS, gripper.joint_positions(knuckle), strict=True):
                plant.GetJointByName(name, hand).set_angle(context, angle)
            for link, body, corners in boxes:
                if link:
                    points = body.EvalPoseInWorld(context) @ corners
                    levers = self.levers[link, :link]
                    np.maximum(levers, _levers(points, axes[:link], centres[:link]), out=levers)

    def rates(self, step: np.ndarray) -> np.ndarray:
        """Bound ``[8, 8]`` [m] on the motion of link hi, seen from lo, by ``step [7]`` [rad]."""
        upto = np.zeros((N_JOINTS + 1, N_JOINTS + 1))
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
            query: larger distances count as this [m].

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


def _centres(axes: list[RigidTransform]) -> list[np.ndarray]:
    """The point on each joint's axis that is nearest to the next axis, or the one before."""
    centres = []
    for i, X_WJ in enumerate(axes):
        X_WK = axes[i + 1] if i + 1 < len(axes) else axes[i - 1]
        u, v = X_WJ.rotation().matrix()[:, 2], X_WK.rotation().matrix()[:, 2]
        between, cosine = X_WK.translation() - X_WJ.translation(), u @ v
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
