"""Forward kinematics of the Gen3 with its 2F-85, and its distance to everything.

One `PlanningScene` holds a plant with the robot, box and table; the arm's seven joint angles
are the only freedom, the fingers stand at a given opening, and the cube is absent, an obstacle
at a given pose, or carried. Everything that plans asks it for the verdict.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from pydrake.geometry import (
    Box,
    CollisionFilterDeclaration,
    Cylinder,
    GeometryId,
    GeometrySet,
    SignedDistancePair,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.multibody.tree import JacobianWrtVariable, RigidBody
from pydrake.systems.framework import DiagramBuilder

from models.arrays import Array, finite_array, finite_number, finite_vector
from models.errors import ModelError
from models.scenes.assembly import assemble
from models.scenes.inputs import finite_pose
from models.scenes.limits import JointLimits
from models.scenes.parsing import ARM, CUBE, GRIPPER, add_models
from models.scenes.robots import GEN3, HOME, Robot
from models.scenes.setup import Setup
from models.task.spaces import CUBE_EDGE

__all__ = ["HOME", "MARGIN", "Clearance", "PlanningScene"]

MARGIN = 0.002
"""Smallest distance between bodies that planning allows [m]."""

_AWAY = RigidTransform([0.0, 0.0, -5.0])


@dataclass(frozen=True)
class Clearance:
    """The smallest signed distance.

    Attributes:
        distance: metres; capped at the limit of the query.
        bodies: the two bodies' scoped names, None if nothing is nearer than the limit.
    """

    distance: float
    bodies: tuple[str, str] | None


class PlanningScene:
    """Robot, box and table for kinematics and distance queries; no dynamics.

    Whatever takes joint angles, widths, limits of distance or poses raises a `ModelError` where
    they are of another size, or not finite: Drake would end the program.

    Attributes:
        plant: the scene's plant.
        context: the plant's own context, as the last question left it.
        inspector: of its shapes.
        carried: the shape of the cube in the hand; None if the hand is empty.
        robot: the arm with its hand.
        arm_instance: model instance of the arm.
        hand_instance: model instance of the hand.
        cube: the cube's body.
        arm_index: places of the joint angles in the plant's positions ``[7]``.
        limits: where the joints may be; ``lower`` and ``upper`` [rad] are its own.
        velocity_limit: of the joints ``[7]`` [rad/s].
        continuous: which joints are endless ``[7]``.
    """

    def __init__(
        self, *, carrying: bool = False, robot: Robot = GEN3, setup: Setup | None = None
    ) -> None:
        """Build the plant, with the cube out of the way.

        Args:
            carrying: the fingers stand `CUBE_EDGE` apart, and a cylinder about the closing axis
                stands for the cube between them: it contains the cube however that is turned
                between the pads, until `carry` says how it lies. Otherwise the hand is empty and
                open.
            robot: the arm with its hand; one of the Gen3 Lite has six joint angles, not seven.
            setup: another base pose, tool or surroundings; None is the shipped scene.

        Raises:
            ModelError: if ``robot`` is none, or the setup is wrong.
        """
        if not isinstance(robot, Robot):
            raise ModelError(f"robot: {robot!r}; valid: a models.scenes.robots.Robot")
        builder = DiagramBuilder()
        self.plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
        self._scene_graph = scene_graph
        if setup is None:
            add_models(self.plant, robot.station)
        else:
            assemble(self.plant, scene_graph, robot, setup)
        if not self.plant.HasModelInstanceNamed(CUBE):
            add_models(self.plant, "cube.sdf")
        if not self.plant.HasModelInstanceNamed(GRIPPER):
            robot = robot.without_fingers()
        self.robot = robot
        self._tcp = self.plant.GetFrameByName("tcp")
        self.arm_instance = self.plant.GetModelInstanceByName(ARM)
        self.cube = self.plant.GetBodyByName("cube", self.plant.GetModelInstanceByName(CUBE))
        self.hand_instance = hand = (
            self.plant.GetModelInstanceByName(GRIPPER)
            if robot.finger_joints
            else self._tcp.body().model_instance()
        )
        self.inspector = scene_graph.model_inspector()
        self._filter = scene_graph.collision_filter_manager()
        self.carried: GeometryId | None = None
        if carrying:
            if setup is not None and setup.tool is not None:
                raise ModelError("carrying: a tool carries no cube; valid: a setup without a tool")
            self.carried = self._add_carried_cube()
        self.plant.Finalize()
        self._query_port = self.plant.get_geometry_query_input_port()
        fixed = [self.cube, *self.plant.GetBodiesWeldedTo(self.plant.world_body())]
        self._fixed = {body.index() for body in fixed}
        # Where the cube lies does not concern the robot.
        standing = self.plant.CollectRegisteredGeometries(fixed)
        self._filter.Apply(CollisionFilterDeclaration().ExcludeWithin(standing))
        arm_bodies = self.plant.GetBodyIndices(self.arm_instance)
        attached = {
            body.index()
            for index in arm_bodies
            if index not in self._fixed
            for body in self.plant.GetBodiesWeldedTo(self.plant.get_body(index))
        }
        self._robot = attached | set(arm_bodies) | set(self.plant.GetBodyIndices(hand))
        welded = self.plant.GetBodiesWeldedTo(self._tcp.body())
        self._hand = {body.index() for body in welded} | set(self.plant.GetBodyIndices(hand))

        joints = [self.plant.GetJointByName(name, self.arm_instance) for name in robot.joints]
        self.arm_index = np.array([joint.position_start() for joint in joints])
        self.lower = np.array([joint.position_lower_limits()[0] for joint in joints])
        self.upper = np.array([joint.position_upper_limits()[0] for joint in joints])
        self.limits = JointLimits(robot.joints, self.lower, self.upper)
        self.velocity_limit = np.array([joint.velocity_upper_limits()[0] for joint in joints])
        self.continuous = np.isinf(self.lower)
        self._velocity_index = np.array([joint.velocity_start() for joint in joints])

        self._diagram = builder.Build()
        self._root = self._diagram.CreateDefaultContext()
        self.context = self.plant.GetMyMutableContextFromRoot(self._root)
        self.place_cube(None)
        for index in self.plant.GetJointIndices(self.cube.model_instance()):
            self.plant.get_joint(index).Lock(self.context)
        self.open_to(CUBE_EDGE if carrying else robot.max_opening)

    def open_to(self, width: float) -> None:
        """Stand the fingers ``width`` [m] apart."""
        angles = self.robot.finger_positions(finite_number(width, "width", valid="metres"))
        for name, angle in zip(self.robot.finger_joints, angles, strict=True):
            joint = self.plant.GetJointByName(name, self.hand_instance)
            joint.Unlock(self.context)
            joint.set_angle(self.context, angle)
            joint.Lock(self.context)

    def place_cube(self, X_WO: RigidTransform | None) -> None:
        """Put the cube, as an obstacle, at ``X_WO``; None takes it out of the way."""
        X_WO = _AWAY if X_WO is None else finite_pose(X_WO, "X_WO")
        self.plant.SetFreeBodyPose(self.context, self.cube, X_WO)

    def carry(self, X_GO: RigidTransform) -> None:
        """Have the carried cube lie in the hand at ``X_GO``, in place of all its turns at once.

        Raises:
            ModelError: if the hand of this scene is empty, or the pose is none.
        """
        if self.carried is None:
            raise ModelError("carry: the hand is empty; valid: a scene made with carrying=True")
        graph = self._scene_graph
        context = graph.GetMyMutableContextFromRoot(self._root)
        graph.ChangeShape(
            context,
            self.plant.get_source_id(),
            self.carried,
            Box(CUBE_EDGE, CUBE_EDGE, CUBE_EDGE),
            self._tcp.GetFixedPoseInBodyFrame() @ finite_pose(X_GO, "X_GO"),
        )
        # A shape that changes forgets what it may touch.
        graph.collision_filter_manager(context).Apply(self._touching_fingers(self.carried))

    def forward(self, q: np.ndarray) -> RigidTransform:
        """X_WG at joint angles ``q [7]`` [rad]."""
        self._set(q)
        return self._tcp.CalcPoseInWorld(self.context)

    def clearance(self, q: np.ndarray, limit: float = 0.05) -> Clearance:
        """Smallest signed distance [m] at ``q [7]`` between any two bodies that may collide."""
        pairs = self._pairs(q, limit)
        if not pairs:
            return Clearance(limit, None)
        nearest = min(pairs, key=lambda pair: pair.distance)
        names = [self._body(i).scoped_name().get_full() for i in (nearest.id_A, nearest.id_B)]
        return Clearance(nearest.distance, (names[0], names[1]))

    def is_free(self, q: np.ndarray, margin: float = MARGIN) -> bool:
        """Whether every distance at ``q [7]`` is above ``margin`` [m]."""
        return not self._pairs(q, margin)

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        """``[6, 7]``: G's angular and linear velocity in the world [rad/s, m/s] per joint rate."""
        self._set(q)
        world = self.plant.world_frame()
        J = self.plant.CalcJacobianSpatialVelocity(
            self.context, JacobianWrtVariable.kV, self._tcp, np.zeros(3), world, world
        )
        return J[:, self._velocity_index]

    def error(self, q: np.ndarray, X_WG: RigidTransform) -> tuple[float, float]:
        """Position [m] and rotation [rad] error of ``q [7]`` against ``X_WG``."""
        X = self.forward(q)
        finite_pose(X_WG, "X_WG")
        skew = X_WG.rotation().matrix().T @ X.rotation().matrix()
        sine = np.linalg.norm(skew - skew.T) / (2.0 * np.sqrt(2.0))
        angle = np.arctan2(sine, (np.trace(skew) - 1.0) / 2.0)
        return float(np.linalg.norm(X.translation() - X_WG.translation())), float(angle)

    def within_limits(self, q: np.ndarray) -> bool:
        """Whether ``q [7]`` respects the position limits, within a rounding."""
        q = self.require_posture(q)
        # The common case first: this is asked of every answer.
        if (q >= self.lower).all() and (q <= self.upper).all():
            return True
        return not self.limits.beyond(q).any()

    def require_posture(self, q: ArrayLike, name: str = "q") -> Array:
        """Give joint angles ``[7]`` [rad] back as float64.

        Raises:
            ModelError: if they are of another number, or not finite real numbers.
        """
        return finite_vector(q, len(self.arm_index), name)

    def wind(self, q: np.ndarray, towards: np.ndarray) -> np.ndarray:
        """``q [..., 7]`` with its endless joints within half a turn of ``towards``."""
        n_joints = len(self.arm_index)
        q, towards = (
            finite_array(q, (n_joints,), "q"),
            finite_array(towards, (n_joints,), "towards"),
        )
        turns = np.round((q - towards) / (2.0 * np.pi))
        return np.where(self.continuous, q - 2.0 * np.pi * turns, q)

    def hand_is_blocked(self, q: np.ndarray, margin: float) -> bool:
        """Whether hand and furniture are too near: then they are at any ``q`` of this pose."""
        return any(
            (a in self._hand and b in self._fixed) or (b in self._hand and a in self._fixed)
            for a, b in (
                (self._body(pair.id_A).index(), self._body(pair.id_B).index())
                for pair in self._pairs(q, margin)
            )
        )

    def is_robots(self, name: str) -> bool:
        """Whether a body, by its scoped name, is arm, hand, or welded to what these move."""
        names = (self.plant.get_body(i).scoped_name().get_full() for i in self._robot)
        return name in names

    def _add_carried_cube(self) -> GeometryId:
        """Weld a cylinder that contains the cube, however turned, between the fingers."""
        X_GC = RigidTransform(RotationMatrix.MakeXRotation(np.pi / 2))
        carried = self.plant.RegisterCollisionGeometry(
            self._tcp.body(),
            self._tcp.GetFixedPoseInBodyFrame() @ X_GC,
            Cylinder(radius=CUBE_EDGE / np.sqrt(2.0), length=CUBE_EDGE),
            "carried_cube",
            CoulombFriction(0.0, 0.0),
        )
        self._filter.Apply(self._touching_fingers(carried))
        return carried

    def _touching_fingers(self, carried: GeometryId) -> CollisionFilterDeclaration:
        """What lets the carried cube touch the hand."""
        hand = self.plant.GetBodyIndices(self.hand_instance)
        fingers = self.plant.CollectRegisteredGeometries([self.plant.get_body(i) for i in hand])
        return CollisionFilterDeclaration().ExcludeBetween(GeometrySet(carried), fingers)

    def _pairs(self, q: np.ndarray, limit: float) -> list[SignedDistancePair]:
        self._set(q)
        if not (isinstance(limit, float) and limit == np.inf):
            limit = finite_number(limit, "limit of distances", valid="metres")
        query = self._query_port.Eval(self.context)
        return query.ComputeSignedDistancePairwiseClosestPoints(limit)

    def _set(self, q: np.ndarray) -> None:
        self.plant.SetPositions(self.context, self.arm_instance, self.require_posture(q))

    def _body(self, geometry: GeometryId) -> RigidBody:
        return self.plant.GetBodyFromFrameId(self.inspector.GetFrameId(geometry))
