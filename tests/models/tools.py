"""Scenes with tools of one's own, welded to any link, and posts."""

from collections.abc import Callable
from unittest import mock

import numpy as np
from pydrake.geometry import Box, Capsule, Cylinder, Shape
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import Frame, RevoluteJoint, RigidBody, SpatialInertia

from models.scenes import planning_scene
from models.scenes.parsing import add_models
from models.scenes.planning_scene import PlanningScene

HAND, BRACELET, FOREARM = ("gripper", "base"), ("arm", "bracelet_link"), ("arm", "forearm_link")


def scene_with(add: Callable[[MultibodyPlant], None], **options) -> PlanningScene:
    """The shipped scene and what ``add`` puts into its plant."""

    def add_all(plant, *files):
        add_models(plant, *files)
        add(plant)

    with mock.patch.object(planning_scene, "add_models", add_all):
        return PlanningScene(**options)


def add_body(plant: MultibodyPlant, name: str, shape: Shape) -> RigidBody:
    """A body in a model of its own."""
    instance = plant.AddModelInstance(name)
    body = plant.AddRigidBody(name, instance, SpatialInertia.SolidSphereWithMass(0.1, 0.05))
    friction = CoulombFriction(0.5, 0.5)
    plant.RegisterCollisionGeometry(body, RigidTransform(), shape, f"{name}_shape", friction)
    return body


def link(plant: MultibodyPlant, where: tuple[str, str]) -> RigidBody:
    """A body of the robot."""
    return plant.GetBodyByName(where[1], plant.GetModelInstanceByName(where[0]))


def weld_tool(
    plant: MultibodyPlant,
    where: tuple[str, str],
    shape: Shape,
    X_LT: RigidTransform,
    *,
    outwards: bool = True,
) -> None:
    """Weld a tool to a link; not ``outwards``, the link counts as the weld's child."""
    tool = add_body(plant, f"tool_on_{where[1]}", shape).body_frame()
    frame = link(plant, where).body_frame()
    if outwards:
        plant.WeldFrames(frame, tool, X_LT)
    else:
        plant.WeldFrames(tool, frame, X_LT.inverse())


def hinged(plant: MultibodyPlant, parent: Frame) -> None:
    """A flap that a hinge of its own turns."""
    flap = add_body(plant, "flap", Box(0.03, 0.03, 0.10))
    plant.AddJoint(RevoluteJoint("hinge", parent, flap.body_frame(), [0.0, 0.0, 1.0]))


def random_tools(plant: MultibodyPlant, rng: np.random.Generator) -> None:
    """A rod on the hand, one on the bracelet, one on the forearm, and thin posts around the arm."""
    side = rng.choice([-1.0, 1.0], 3)
    forward = RigidTransform([side[0] * 0.09, 0.0, 0.15])
    weld_tool(plant, HAND, Box(0.02, 0.02, 0.30), forward)
    weld_tool(plant, BRACELET, Box(0.30, 0.02, 0.02), RigidTransform([side[1] * 0.22, 0.0, -0.05]))
    away = RigidTransform(RollPitchYaw(0.0, np.pi / 2, 0.0), [side[2] * 0.20, -0.12, 0.0])
    rod = rng.choice([Cylinder(0.015, 0.25), Capsule(0.015, 0.25)])
    weld_tool(plant, FOREARM, rod, away, outwards=rng.random() < 0.5)
    for i in range(6):
        angle, distance = rng.uniform(-np.pi, np.pi), rng.uniform(0.4, 0.9)
        height = rng.uniform(0.3, 1.0)
        post = add_body(plant, f"post_{i}", Box(0.02, 0.02, height))
        at = [distance * np.cos(angle), distance * np.sin(angle), 0.5 + height / 2]
        plant.WeldFrames(plant.world_frame(), post.body_frame(), RigidTransform(at))
