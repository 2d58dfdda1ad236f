"""Forward and inverse kinematics of the Gen3 with its 2F-85, and its distance to everything.

One `PlanningScene` holds a plant with the robot, box and table; the arm's seven joint angles
are the only freedom, the fingers stand at a given opening, and the cube is absent, an obstacle
at a given pose, or carried. Drake's optimiser proposes configurations; forward kinematics,
joint limits and the distance query, evaluated afresh, decide.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from pydrake.geometry import CollisionFilterDeclaration, Cylinder, GeometrySet
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.solvers import SnoptSolver, SolverOptions
from pydrake.systems.framework import DiagramBuilder

from models import gripper
from models.scene import ARM, GRIPPER, add_models

HOME = np.array([0.0, 0.26, np.pi, -2.27, 0.0, 0.96, np.pi / 2])
"""The vendor's home posture [rad]: elbow up, gripper before the robot."""

POSITION_TOLERANCE = 1e-5
"""Largest position error of an answer [m]."""
ANGLE_TOLERANCE = 1e-5
"""Largest rotation error of an answer [rad]."""

_AWAY = RigidTransform([0.0, 0.0, -5.0])
# Points fixed in G whose coincidence with their targets fixes the whole pose; well apart, so
# that the optimiser's feasibility tolerance bounds the angle as tightly as the position.
_LANDMARKS = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.5, 0.0]])


class Failure(StrEnum):
    """Why no configuration is returned; none of them proves that none exists."""

    NOT_FOUND = "not found"
    COLLISION = "collision"


@dataclass(frozen=True)
class Clearance:
    """The smallest signed distance.

    Attributes:
        distance: metres; capped at the limit of the query.
        bodies: the two bodies' scoped names, None if nothing is nearer than the limit.
    """

    distance: float
    bodies: tuple[str, str] | None


@dataclass(frozen=True)
class IkSolution:
    """The answer to one inverse-kinematics question.

    Attributes:
        q: joint angles ``[7]`` [rad], None if there is no answer.
        clearance: clearance of ``q``, or of the best rejected candidate.
        failure: None on success.
        attempts: starting points tried.
    """

    q: np.ndarray | None
    clearance: Clearance | None
    failure: Failure | None
    attempts: int


class PlanningScene:
    """Robot, box and table for kinematics and distance queries; no dynamics."""

    def __init__(self, *, carrying: bool = False, width: float | None = None) -> None:
        """Build the plant.

        Args:
            carrying: a cylinder about the closing axis stands for the cube in the hand: it
                contains the cube however that is turned between the pads.
            width: opening of the fingers [m]; default 40 mm when carrying, else open.
        """
        builder = DiagramBuilder()
        self.plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
        add_models(self.plant, "station.dmd.yaml")
        tcp = self.plant.GetFrameByName("tcp")
        if carrying:
            X_GC = RigidTransform(RotationMatrix.MakeXRotation(np.pi / 2))
            carried = self.plant.RegisterCollisionGeometry(
                tcp.body(),
                tcp.GetFixedPoseInBodyFrame() @ X_GC,
                Cylinder(radius=0.02 * np.sqrt(2.0), length=0.04),
                "carried_cube",
                CoulombFriction(0.0, 0.0),
            )
            hand = self.plant.GetBodyIndices(self.plant.GetModelInstanceByName(GRIPPER))
            fingers = self.plant.CollectRegisteredGeometries(
                [self.plant.get_body(index) for index in hand]
            )
            scene_graph.collision_filter_manager().Apply(
                CollisionFilterDeclaration().ExcludeBetween(GeometrySet(carried), fingers)
            )
        self.plant.Finalize()
        self._diagram = builder.Build()
        self._root = self._diagram.CreateDefaultContext()
        self.context = self.plant.GetMyMutableContextFromRoot(self._root)
        self._query_port = self.plant.get_geometry_query_input_port()
        self._inspector = scene_graph.model_inspector()
        self._arm = self.plant.GetModelInstanceByName(ARM)
        self._cube = self.plant.GetBodyByName("cube")
        self._tcp = tcp

        joints = [self.plant.GetJointByName(f"joint_{i}", self._arm) for i in range(1, 8)]
        self._arm_index = np.array([joint.position_start() for joint in joints])
        self.lower = np.array([joint.position_lower_limits()[0] for joint in joints])
        self.upper = np.array([joint.position_upper_limits()[0] for joint in joints])
        self.velocity_limit = np.array([joint.velocity_upper_limits()[0] for joint in joints])

        hand = self.plant.GetModelInstanceByName(GRIPPER)
        width = (0.04 if carrying else gripper.MAX_OPENING) if width is None else width
        angles = gripper.joint_positions(float(gripper.knuckle_angle(width)))
        for name, angle in zip(gripper.JOINTS, angles, strict=True):
            joint = self.plant.GetJointByName(name, hand)
            joint.set_angle(self.context, angle)
            joint.Lock(self.context)
        for index in self.plant.GetJointIndices(self.plant.GetModelInstanceByName("cube")):
            self.plant.get_joint(index).Lock(self.context)
        self.place_cube(None)

    def place_cube(self, X_WO: RigidTransform | None) -> None:
        """Put the cube, as an obstacle, at ``X_WO``; None takes it out of the way."""
        self.plant.SetFreeBodyPose(self.context, self._cube, X_WO or _AWAY)

    def forward(self, q: np.ndarray) -> RigidTransform:
        """X_WG at joint angles ``q [7]`` [rad]."""
        self._set(q)
        return self._tcp.CalcPoseInWorld(self.context)

    def clearance(self, q: np.ndarray, limit: float = 0.05) -> Clearance:
        """Smallest signed distance [m] at ``q [7]`` between any two bodies that may collide."""
        self._set(q)
        query = self._query_port.Eval(self.context)
        pairs = query.ComputeSignedDistancePairwiseClosestPoints(limit)
        if not pairs:
            return Clearance(limit, None)
        nearest = min(pairs, key=lambda pair: pair.distance)
        return Clearance(nearest.distance, (self._name(nearest.id_A), self._name(nearest.id_B)))

    def is_free(self, q: np.ndarray, margin: float) -> bool:
        """Whether every distance at ``q [7]`` is above ``margin`` [m]."""
        self._set(q)
        query = self._query_port.Eval(self.context)
        return not query.ComputeSignedDistancePairwiseClosestPoints(margin)

    def error(self, q: np.ndarray, X_WG: RigidTransform) -> tuple[float, float]:
        """Position [m] and rotation [rad] error of ``q`` against ``X_WG``, by forward kinematics."""
        X = self.forward(q)
        skew = X_WG.rotation().matrix().T @ X.rotation().matrix()
        sine = np.linalg.norm(skew - skew.T) / (2.0 * np.sqrt(2.0))
        angle = np.arctan2(sine, (np.trace(skew) - 1.0) / 2.0)
        return float(np.linalg.norm(X.translation() - X_WG.translation())), float(angle)

    def within_limits(self, q: np.ndarray) -> bool:
        """Whether ``q [7]`` respects the position limits."""
        return bool((q >= self.lower).all() and (q <= self.upper).all())

    def solve(
        self,
        X_WG: RigidTransform,
        *,
        seed: np.ndarray = HOME,
        margin: float = 0.005,
        attempts: int = 20,
        rng: np.random.Generator | None = None,
    ) -> IkSolution:
        """Find joint angles that reach ``X_WG`` with every distance above ``margin``.

        Args:
            X_WG: wanted pose of the tool centre point.
            seed: ``[7]`` [rad]; the answer is drawn towards it.
            margin: smallest allowed distance [m].
            attempts: starting points; the first is ``seed``, the others need ``rng``.
            rng: source of the further starting points; None tries ``seed`` only.
        """
        best: Clearance | None = None
        starts = attempts if rng is not None else 1
        for attempt in range(starts):
            start = seed
            if attempt and rng is not None:
                start = seed + rng.normal(0.0, min(0.3 * attempt, 1.5), 7)
                start = np.clip(start, self.lower, self.upper)
            # Few poses need the distance constraint, which costs ten times the rest.
            for with_margin in (False, True):
                q = self._optimise(X_WG, start, seed, margin if with_margin else None)
                if q is None:
                    break
                start = q
                clearance = self.clearance(q)
                if clearance.distance >= margin:
                    return IkSolution(q, clearance, None, attempt + 1)
                if best is None or clearance.distance > best.distance:
                    best = clearance
        failure = Failure.NOT_FOUND if best is None else Failure.COLLISION
        return IkSolution(None, best, failure, starts)

    def _set(self, q: np.ndarray) -> None:
        self.plant.SetPositions(self.context, self._arm, q)

    def _name(self, geometry_id) -> str:
        body = self.plant.GetBodyFromFrameId(self._inspector.GetFrameId(geometry_id))
        return body.scoped_name().get_full()

    def _optimise(
        self, X_WG: RigidTransform, start: np.ndarray, seed: np.ndarray, margin: float | None
    ) -> np.ndarray | None:
        """Run SNOPT once; return its answer only if forward kinematics and limits confirm it."""
        ik = InverseKinematics(self.plant, self.context)
        for p_GL in _LANDMARKS:
            p_WL = X_WG @ p_GL
            ik.AddPositionConstraint(self._tcp, p_GL, self.plant.world_frame(), p_WL, p_WL)
        if margin is not None:
            ik.AddMinimumDistanceLowerBoundConstraint(margin + 1e-4, 0.03)
        program, variables = ik.prog(), ik.q()
        program.AddQuadraticErrorCost(np.eye(7), seed, variables[self._arm_index])
        guess = self.plant.GetPositions(self.context).copy()
        guess[self._arm_index] = start
        result = SnoptSolver().Solve(program, guess, _OPTIONS)
        q = result.GetSolution(variables)[self._arm_index]
        # SNOPT may step over a bound by its tolerance.
        q = np.clip(q, self.lower, self.upper)
        position, angle = self.error(q, X_WG)
        if position > POSITION_TOLERANCE or angle > ANGLE_TOLERANCE or not self.within_limits(q):
            return None
        return q


_OPTIONS = SolverOptions()
_OPTIONS.SetOption(SnoptSolver.id(), "Major feasibility tolerance", 1e-8)
_OPTIONS.SetOption(SnoptSolver.id(), "Major iterations limit", 200)
