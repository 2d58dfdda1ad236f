"""Plants of scenes that differ from the shipped ones: the robot's directives with a `Setup`."""

from collections.abc import Callable
from functools import partial
from typing import Any

from pydrake.geometry import CollisionFilterDeclaration, HalfSpace, Role, SceneGraph, Shape
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import (
    FlattenModelDirectives,
    LoadModelDirectives,
    ModelDirective,
    Parser,
    ProcessModelDirectives,
)
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, Frame, RigidBody, SpatialInertia

from models.errors import ModelError
from models.scenes.parsing import ARM, GRIPPER, PACKAGE, TOOL, strict_parser, url_of
from models.scenes.robots import Robot
from models.scenes.setup import FLANGE, HAND, Setup, Tool, rigid, shape_of

_FURNITURE = f"{PACKAGE}/furniture.dmd.yaml"


def assemble(plant: MultibodyPlant, scene_graph: SceneGraph, robot: Robot, setup: Setup) -> None:
    """Add a robot and what its setup says to a plant before `Finalize`.

    Raises:
        ModelError: if a field of the setup, or a file that it names, is wrong.
    """
    if not isinstance(setup, Setup):
        raise ModelError(f"setup: {type(setup).__name__}; valid: a models.scenes.setup.Setup")
    parser = strict_parser(plant)
    for name, folder in setup.packages.items():
        _guarded(f"packages: {name}", partial(parser.package_map().Add, name, str(folder)))
    _add_robot(plant, scene_graph, parser, robot, setup)
    for i, obstacle in enumerate(setup.obstacles):
        place = f"obstacles[{i}] {obstacle.name!r}"
        if not obstacle.name or plant.HasModelInstanceNamed(obstacle.name):
            raise ModelError(f"{place}: no name, or one that is taken; valid: a name of its own")
        body = _add_body(plant, obstacle.name, shape_of(obstacle, place))
        plant.WeldFrames(plant.world_frame(), body.body_frame(), rigid(obstacle.pose, place))
    for file in setup.directives:
        _guarded(f"directives: {file}", partial(_process, parser, file))
    _require_distances(plant, scene_graph)


def _require_distances(plant: MultibodyPlant, scene_graph: SceneGraph) -> None:
    """Refuse shapes that files may bring and Drake measures no distances from."""
    inspector = scene_graph.model_inspector()
    for shape in inspector.GetAllGeometryIds(Role.kProximity):
        if isinstance(inspector.GetShape(shape), HalfSpace):
            body = plant.GetBodyFromFrameId(inspector.GetFrameId(shape)).scoped_name().get_full()
            raise ModelError(
                f"{body}: a half space or plane, from which distances are not measured; valid: "
                "any other shape, such as a large box"
            )


def _add_robot(
    plant: MultibodyPlant, scene_graph: SceneGraph, parser: Parser, robot: Robot, setup: Setup
) -> None:
    """The robot's own directives, but for what the setup has in their place."""
    packages, tool = parser.package_map(), setup.tool
    station = LoadModelDirectives(packages.ResolveUrl(url_of(robot.station, own=True)))
    if not setup.furniture:
        station.directives = [d for d in station.directives if not _is_furniture(d)]
    directives = FlattenModelDirectives(station, packages).directives
    _, base = _weld_of(directives, ARM)
    touching: list[str] = []
    if setup.base is not None:
        directives = [d for d in directives if d.add_weld is None or d.add_weld.child != base]
    if tool is not None:
        if tool.on not in (FLANGE, HAND):
            raise ModelError(f"tool: on {tool.on!r}; valid: {FLANGE}, {HAND}")
        where = _weld_of(directives, GRIPPER)[tool.on == HAND]
        directives = [d for d in directives if not _is_tcp(d)]
    if tool is not None and tool.on == FLANGE:
        groups = [d.add_collision_filter_group for d in directives if _is_gripper(d)]
        members = [link for group in groups if group for link in group.members]
        touching = [link for link in members if link.startswith(f"{ARM}::")]
        directives = [d for d in directives if not _is_gripper(d)]
    station.directives = directives
    ProcessModelDirectives(station, parser)
    if setup.base is not None:
        X_WB = rigid(setup.base, "base")
        plant.WeldFrames(plant.world_frame(), _frame(plant, base), X_WB)
    if tool is not None:
        body = _add_tool(plant, parser, tool, where)
        # What may touch the gripper may touch what is in its place.
        both = [body, *(_frame(plant, link).body() for link in touching)]
        apart = CollisionFilterDeclaration()
        apart.ExcludeWithin(plant.CollectRegisteredGeometries(both))
        scene_graph.collision_filter_manager().Apply(apart)


def _add_tool(plant: MultibodyPlant, parser: Parser, tool: Tool, where: str) -> RigidBody:
    """Weld the tool on, and put frame ``tcp`` where it says."""
    if bool(tool.file) == bool(tool.shape):
        raise ModelError("tool: valid: either a shape or a file")
    if tool.shape:
        body = _add_body(plant, TOOL, shape_of(tool, "tool"))
    else:
        body = _guarded(f"tool: {tool.file}", partial(_parsed_tool, plant, parser, tool.file))
    X_PT, X_TG = rigid(tool.pose, "tool: pose"), rigid(tool.tcp, "tool: tcp")
    plant.WeldFrames(_frame(plant, where), body.body_frame(), X_PT)
    plant.AddFrame(FixedOffsetFrame("tcp", body.body_frame(), X_TG))
    return body


def _parsed_tool(plant: MultibodyPlant, parser: Parser, file: str) -> RigidBody:
    """The base link of a tool from a file."""
    (instance,) = parser.AddModels(url=url_of(file))
    bodies = [plant.get_body(index) for index in plant.GetBodyIndices(instance)]
    joints = [plant.get_joint(index) for index in plant.GetJointIndices(instance)]
    children = {joint.child_body().index() for joint in joints}
    bases = [body for body in bodies if body.index() not in children]
    if len(bases) != 1:
        raise RuntimeError(f"has {len(bases)} base links, wanted one")
    return bases[0]


def _add_body(plant: MultibodyPlant, name: str, shape: Shape) -> RigidBody:
    """A body of one shape in a model of its own, both of the same name."""
    inertia = SpatialInertia.SolidSphereWithMass(0.1, 0.05)  # of no account: nothing is driven
    body = plant.AddRigidBody(name, plant.AddModelInstance(name), inertia)
    plant.RegisterCollisionGeometry(
        body, RigidTransform(), shape, f"{name}_shape", CoulombFriction(0.5, 0.5)
    )
    return body


def _process(parser: Parser, file: str) -> None:
    directives = LoadModelDirectives(parser.package_map().ResolveUrl(url_of(file)))
    ProcessModelDirectives(directives, parser)


def _weld_of(directives: list[ModelDirective], model: str) -> tuple[str, str]:
    """Parent and child of the weld that fixes a model."""
    for directive in directives:
        weld = directive.add_weld
        if weld is not None and weld.child.startswith(f"{model}::"):
            return weld.parent, weld.child
    raise ModelError(f"the robot's directives weld no link of {model!r}; valid: add_weld, once")


def _is_gripper(directive: ModelDirective) -> bool:
    """Whether it adds the gripper, welds it, or speaks of its links."""
    model, weld = directive.add_model, directive.add_weld
    group = directive.add_collision_filter_group
    return (
        (model is not None and model.name == GRIPPER)
        or (weld is not None and weld.child.startswith(f"{GRIPPER}::"))
        or (group is not None and any(link.startswith(f"{GRIPPER}::") for link in group.members))
    )


def _is_tcp(directive: ModelDirective) -> bool:
    frame = directive.add_frame
    return frame is not None and frame.name.split("::")[-1] == "tcp"


def _is_furniture(directive: ModelDirective) -> bool:
    included = directive.add_directives
    return included is not None and included.file == _FURNITURE


def _frame(plant: MultibodyPlant, link: str) -> Frame:
    model, _, name = link.partition("::")
    return plant.GetFrameByName(name, plant.GetModelInstanceByName(model))


def _guarded(place: str, work: Callable[[], Any]) -> Any:
    """What ``work`` gives; what Drake says against it names the place in the setup."""
    try:
        return work()
    except (ModelError, RuntimeError, SystemExit) as error:
        raise ModelError(f"{place}: {' '.join(str(error).split())}") from None
