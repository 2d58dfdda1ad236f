"""Cube, table and the shapes of a hand, integrated with error control.

Of the hand there is what the cube may meet: its shapes, which move as they are told to. They are
too heavy for the cube to hinder.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np
from pydrake.geometry import (
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    CollisionFilterDeclaration,
    GeometryId,
    GeometrySet,
    HalfSpace,
    ProximityProperties,
)
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    CoulombFriction,
    MultibodyPlant,
)
from pydrake.multibody.tree import SpatialInertia, UniformGravityFieldElement, UnitInertia
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder

from diagrams.contact import set_cube_mass, set_friction, set_restitution, use_grasp_contact
from diagrams.faults import simulating
from models.scenes import gripper
from models.scenes.parsing import CUBE, add_models
from models.task.spaces import CUBE_EDGE, TABLE_TOP

ACCURACY = 1e-6
"""Of the integrator CENIC, while a cube falls, lands and comes to rest."""
LONGEST_STEP = 0.0047
"""Of the integrator [s]. No period is a multiple of it: what rounding would leave of one is a step
of 1e-16 s, after which velocities mean nothing."""
SETTLING = 1e-4
"""Accuracy that is enough for a cube that cannot get onto another face any more. Of 48 cubes
let go over the table each kept its face with it, and came to rest within 1.6 mm of where it does
without, 0.2 mm in the median, in half the processor time."""
AT_REST = 1e-4
"""How far a cube at rest moves at most while it is looked at (`travel`) [m]."""
_ENOUGH = 0.5
"""Of the energy that takes a cube over an edge; with less it stays on its face, even where its
contact has some of it as well."""
_CUBE = UnitInertia.SolidCube(CUBE_EDGE)
_BASE = SpatialInertia(1e6, np.zeros(3), UnitInertia(1.0, 1.0, 1.0))
_FINGER = SpatialInertia(1e3, np.zeros(3), UnitInertia(1.0, 1.0, 1.0))
_FINGERS = [
    f"{side}_{part}"
    for side in ("left", "right")
    for part in ("outer_knuckle", "inner_knuckle", "inner_finger")
]


class Hand(NamedTuple):
    """Where a hand is.

    Attributes:
        X_WB: pose of its base.
        knuckle: angle of both knuckles [rad].
    """

    X_WB: RigidTransform
    knuckle: float


class FallScene:
    """A diagram built once that serves any number of falls, each from a fresh context."""

    def __init__(self, *, edge: bool, accuracy: float = ACCURACY) -> None:
        """Build it.

        Args:
            edge: whether the table ends where the real one does, or nowhere.
            accuracy: of the integrator CENIC.
        """
        self.accuracy = accuracy
        builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        plant = self.plant
        use_grasp_contact(plant)
        add_models(plant, "robotiq_2f_85.urdf", "cube.sdf")
        hand = plant.GetModelInstanceByName("robotiq_2f_85")
        table = _add_table(plant) if edge else _add_plane(plant)
        plant.set_gravity_enabled(hand, False)
        for constraint in plant.GetConstraintIds():
            plant.RemoveConstraint(constraint)
        self.joints = [plant.GetJointByName(name, hand) for name in gripper.JOINTS]
        for joint in self.joints:
            joint.set_position_limits([-np.pi], [np.pi])
        plant.Finalize()
        self.cube = plant.GetBodyByName(CUBE)
        self.base = plant.GetBodyByName("base", hand)
        self.fingers = [plant.GetBodyByName(name, hand) for name in _FINGERS]
        bodies = (plant.get_body(index) for index in plant.GetBodyIndices(hand))
        shapes = [shape for body in bodies for shape in plant.GetCollisionGeometriesForBody(body)]
        only_the_cube = CollisionFilterDeclaration().ExcludeWithin(GeometrySet([*shapes, *table]))
        self.scene_graph.collision_filter_manager().Apply(only_the_cube)
        self.diagram = builder.Build()


class Fall:
    """One cube that falls in a scene, beside a hand that moves as it is told to."""

    def __init__(
        self,
        scene: FallScene,
        X_WO: RigidTransform,
        V_WO: SpatialVelocity,
        *,
        friction: float,
        mass: float,
        restitution: float,
        settles: bool = False,
    ) -> None:
        """Let go of it.

        Args:
            scene: where.
            X_WO: the cube's pose to begin with.
            V_WO: its spatial velocity.
            friction: coefficient, of everything.
            mass: of the cube [kg].
            restitution: of cube and table, as `set_restitution` takes it.
            settles: whether `SETTLING` is enough while the cube cannot turn over.

        Raises:
            SimulatorFault: if Drake cannot begin there.
        """
        self._scene, self._settles, self._turned_over = scene, settles, True
        with _quiet():
            self._simulator = Simulator(scene.diagram)
        root = self._simulator.get_mutable_context()
        plant = scene.plant
        self._context = plant.GetMyMutableContextFromRoot(root)
        set_friction(plant, scene.scene_graph, root, friction)
        set_restitution(plant, scene.scene_graph, root, restitution)
        set_cube_mass(plant, self._context, mass)
        scene.base.SetSpatialInertiaInBodyFrame(self._context, _BASE)
        for finger in scene.fingers:
            finger.SetSpatialInertiaInBodyFrame(self._context, _FINGER)
        plant.SetFreeBodyPose(self._context, scene.cube, X_WO)
        plant.SetFreeBodySpatialVelocity(context=self._context, body=scene.cube, V_JpJc=V_WO)
        ResetIntegratorFromFlags(self._simulator, "cenic", LONGEST_STEP)
        self._simulator.get_mutable_integrator().set_target_accuracy(scene.accuracy)
        with simulating():
            self._simulator.Initialize()

    def advance(self, seconds: float, hand: Hand, then: Hand) -> None:
        """Simulate on, while the hand goes evenly from one place to another.

        Raises:
            SimulatorFault: if Drake fails.
        """
        if seconds <= 0.0:
            return
        scene, context = self._scene, self._context
        turn = (then.X_WB.rotation() @ hand.X_WB.rotation().inverse()).ToAngleAxis()
        way = then.X_WB.translation() - hand.X_WB.translation()
        V_WB = SpatialVelocity(turn.axis() * turn.angle() / seconds, way / seconds)
        scene.plant.SetFreeBodyPose(context, scene.base, hand.X_WB)
        scene.plant.SetFreeBodySpatialVelocity(context=context, body=scene.base, V_JpJc=V_WB)
        if self._settles:
            # Twice, for in the midst of a blow a cube has neither height nor speed.
            could, self._turned_over = self._turned_over, self._can_turn_over()
            fine = could or self._turned_over
            accuracy = scene.accuracy if fine else max(scene.accuracy, SETTLING)
            self._simulator.get_mutable_integrator().set_target_accuracy(accuracy)
        rate = (then.knuckle - hand.knuckle) / seconds
        for joint, multiplier in zip(scene.joints, gripper.MULTIPLIERS, strict=True):
            joint.set_angle(context, hand.knuckle * multiplier)
            joint.set_angular_rate(context, rate * multiplier)
        with simulating():
            self._simulator.AdvanceTo(self._simulator.get_context().get_time() + seconds)

    def _can_turn_over(self) -> bool:
        """Whether the cube has most of the energy that takes it over an edge."""
        V_WO, turns = self.V_WO, _CUBE.get_moments()[0]
        speed, rate = (np.linalg.norm(v) for v in (V_WO.translational(), V_WO.rotational()))
        moves = (speed**2 + turns * rate**2) / 2 / UniformGravityFieldElement.kDefaultStrength
        height = self.X_WO.translation()[2] - TABLE_TOP - CUBE_EDGE / 2
        return bool(height + moves > _ENOUGH * (np.sqrt(2.0) - 1.0) * CUBE_EDGE / 2)

    @property
    def X_WO(self) -> RigidTransform:
        """Pose of the cube."""
        return self._scene.cube.EvalPoseInWorld(self._context)

    @property
    def V_WO(self) -> SpatialVelocity:
        """Spatial velocity of the cube."""
        return self._scene.cube.EvalSpatialVelocityInWorld(self._context)


def _add_table(plant: MultibodyPlant) -> list[GeometryId]:
    """Add what stands under and beside the cube, as in the station; its shapes."""
    add_models(plant, "furniture.dmd.yaml")
    bodies = (plant.GetBodyByName(name) for name in ("box", "table"))
    return [shape for body in bodies for shape in plant.GetCollisionGeometriesForBody(body)]


def _add_plane(plant: MultibodyPlant) -> list[GeometryId]:
    """Add a table without end; its shape."""
    material = ProximityProperties()
    AddRigidHydroelasticProperties(material)
    AddContactMaterial(friction=CoulombFriction(1.0, 1.0), properties=material)
    X_WT = RigidTransform([0.0, 0.0, TABLE_TOP])
    with _quiet():
        return [
            plant.RegisterCollisionGeometry(
                plant.world_body(), X_WT, HalfSpace(), "table", material
            )
        ]


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep back the warning that a half-space meets nothing deformable, which nothing is here."""
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        logger.setLevel(level)


def travel(before: RigidTransform, after: RigidTransform) -> float:
    """How far a cube moved between two poses, its turn counted at an edge's length [m]."""
    turn = (before.rotation().inverse() @ after.rotation()).ToAngleAxis().angle()
    return float(np.linalg.norm(after.translation() - before.translation())) + turn * CUBE_EDGE
