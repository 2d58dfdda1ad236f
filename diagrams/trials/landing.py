"""How a cube that was let go falls, lands and comes to rest, and the hand withdraws.

A blow on the table lasts a millisecond, and whether the cube tumbles depends on it: this asks for
a thousand times the accuracy that the grip needs. So cube and table are simulated in a scene of
their own, and of the hand what the cube may meet: its shapes, which open and rise as they would.
They are too heavy for the cube to hinder.

The table has no edge here. How far a cube goes is what a class of pairs shares; whether that ends
beyond the edge of the real one differs from cell to cell, and is for `counts` to say.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import (
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    CollisionFilterDeclaration,
    GeometrySet,
    HalfSpace,
    ProximityProperties,
)
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.multibody.tree import FixedOffsetFrame, PrismaticJoint, SpatialInertia, UnitInertia
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import Context, DiagramBuilder

from diagrams.contact import set_cube_mass, set_friction, set_restitution, use_grasp_contact
from diagrams.faults import simulating
from diagrams.gripper_controller import KNUCKLE_SPEED
from diagrams.trials.references import SPEED
from models.scenes import gripper
from models.scenes.parsing import CUBE, add_models
from models.task.spaces import CUBE_EDGE, TABLE_TOP

LONGEST_STEP = 0.005
"""Of the integrator [s]."""
LOOK = 0.3
"""A cube at rest is looked at for so long [s]."""
AT_REST = 1e-4
"""How far it moves meanwhile at most, its turn counted at an edge's length [m]."""
_OPEN = float(gripper.knuckle_angle(gripper.MAX_OPENING))
_HEAVY = SpatialInertia(1e6, np.zeros(3), UnitInertia(1.0, 1.0, 1.0))
_FINGERS = [
    f"{side}_{part}"
    for side in ("left", "right")
    for part in ("outer_knuckle", "inner_knuckle", "inner_finger")
]


@dataclass(frozen=True)
class Release:
    """A hand, and the cube between its fingers.

    Attributes:
        X_WB: pose of the hand's base.
        knuckle: angle of both knuckles [rad].
        opens: whether the fingers go on to open, at their speed; else they stay as they are.
        X_WO: pose of the cube.
        V_WO: its spatial velocity.
    """

    X_WB: RigidTransform
    knuckle: float
    opens: bool
    X_WO: RigidTransform
    V_WO: SpatialVelocity


class LandingScene:
    """A diagram built once that serves any number of falls, each from a fresh context."""

    def __init__(self, accuracy: float) -> None:
        """Build it.

        Args:
            accuracy: of the integrator CENIC.
        """
        self._accuracy = accuracy
        builder = DiagramBuilder()
        self._plant, self._scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        plant = self._plant
        use_grasp_contact(plant)
        add_models(plant, "robotiq_2f_85.urdf", "cube.sdf")
        self._hand = plant.GetModelInstanceByName("robotiq_2f_85")
        table = ProximityProperties()
        AddRigidHydroelasticProperties(table)
        AddContactMaterial(friction=CoulombFriction(1.0, 1.0), properties=table)
        X_WT = RigidTransform([0.0, 0.0, TABLE_TOP])
        with _quiet():  # a rigid half-space cannot meet what is deformable, which nothing is here
            shape = plant.RegisterCollisionGeometry(
                plant.world_body(), X_WT, HalfSpace(), "table", table
            )
        carriage = plant.AddRigidBody("carriage", self._hand, _HEAVY)
        self._lift = plant.AddJoint(
            PrismaticJoint("lift", plant.world_frame(), carriage.body_frame(), [0.0, 0.0, 1.0])
        )
        self._mount = plant.AddFrame(
            FixedOffsetFrame("mount", carriage.body_frame(), RigidTransform())
        )
        plant.WeldFrames(self._mount, plant.GetFrameByName("base", self._hand))
        plant.set_gravity_enabled(self._hand, False)
        for constraint in plant.GetConstraintIds():
            plant.RemoveConstraint(constraint)
        self._joints = [plant.GetJointByName(name, self._hand) for name in gripper.JOINTS]
        for joint in self._joints:
            joint.set_position_limits([-np.pi], [np.pi])
        plant.Finalize()
        self._cube = plant.GetBodyByName(CUBE)
        bodies = (plant.get_body(index) for index in plant.GetBodyIndices(self._hand))
        hand = [shape for body in bodies for shape in plant.GetCollisionGeometriesForBody(body)]
        only_the_cube = CollisionFilterDeclaration().ExcludeWithin(GeometrySet([*hand, shape]))
        self._scene_graph.collision_filter_manager().Apply(only_the_cube)
        self._diagram = builder.Build()

    def come_to_rest(
        self,
        release: Release,
        rise: float,
        limit: float,
        *,
        friction: float,
        mass: float,
        restitution: float,
    ) -> tuple[RigidTransform, SpatialVelocity]:
        """Simulate until the cube lies still, the hand has risen, and the cube lies still again.

        Args:
            release: what hand and cube do to begin with.
            rise: by how much the hand rises once the cube lies still [m].
            limit: longest time to wait until it does, each time [s].
            friction: coefficient, of everything.
            mass: of the cube [kg].
            restitution: of cube and table, as `set_restitution` takes it.

        Returns:
            The cube's pose and velocity in the end.

        Raises:
            SimulatorFault: if Drake fails.
        """
        simulator = Simulator(self._diagram)
        root = simulator.get_mutable_context()
        context = self._plant.GetMyMutableContextFromRoot(root)
        set_friction(self._plant, self._scene_graph, root, friction)
        set_restitution(self._plant, self._scene_graph, root, restitution)
        set_cube_mass(self._plant, context, mass)
        self._put(context, release)
        ResetIntegratorFromFlags(simulator, "cenic", LONGEST_STEP)
        simulator.get_mutable_integrator().set_target_accuracy(self._accuracy)
        with simulating():
            simulator.Initialize()
            if release.opens:
                simulator.AdvanceTo((release.knuckle - _OPEN) / KNUCKLE_SPEED)
                self._move_hand(context, _OPEN)
            self._wait(simulator, limit)
            if rise:
                self._move_hand(context, _OPEN, rising=SPEED)
                simulator.AdvanceTo(root.get_time() + rise / SPEED)
                self._move_hand(context, _OPEN)
                self._wait(simulator, limit)
        return (
            self._cube.EvalPoseInWorld(context),
            self._cube.EvalSpatialVelocityInWorld(context),
        )

    def _put(self, context: Context, release: Release) -> None:
        """Begin with what the release says."""
        plant = self._plant
        self._mount.SetPoseInParentFrame(context, release.X_WB)
        for name in _FINGERS:
            finger = plant.GetBodyByName(name, self._hand)
            finger.SetSpatialInertiaInBodyFrame(context, _HEAVY)
        self._move_hand(context, release.knuckle, opening=KNUCKLE_SPEED if release.opens else 0.0)
        plant.SetFreeBodyPose(context, self._cube, release.X_WO)
        plant.SetFreeBodySpatialVelocity(context=context, body=self._cube, V_JpJc=release.V_WO)

    def _move_hand(
        self, context: Context, knuckle: float, *, opening: float = 0.0, rising: float = 0.0
    ) -> None:
        """Put the fingers somewhere and move the hand on [rad, rad/s, m/s]."""
        for joint, multiplier in zip(self._joints, gripper.MULTIPLIERS, strict=True):
            joint.set_angle(context, knuckle * multiplier)
            joint.set_angular_rate(context, -opening * multiplier)
        self._lift.set_translation_rate(context, rising)

    def _wait(self, simulator: Simulator, limit: float) -> None:
        """Simulate on until the cube lies still, or for as long as the limit [s]."""
        root = simulator.get_context()
        context, deadline = self._plant.GetMyContextFromRoot(root), root.get_time() + limit
        moved = np.inf
        while moved > AT_REST and root.get_time() < deadline:
            before = self._cube.EvalPoseInWorld(context)
            simulator.AdvanceTo(root.get_time() + LOOK)
            moved = travel(before, self._cube.EvalPoseInWorld(context))


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep Drake's warnings back."""
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
