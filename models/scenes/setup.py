"""What a user's own cell differs in: where the arm's base is, its tool, what stands around it.

A `Setup` is made in Python, or read from YAML by Drake's own loader (`read_setup`); the fields are
the same. In YAML a pose is Drake's ``Transform``, in Python that or a ``RigidTransform``::

    base: {translation: [0, 0, 0.5], rotation: !Rpy {deg: [0, 0, 30]}}
    tool: {shape: cylinder, size: [0.01, 0.2], tcp: {translation: [0, 0, 0.1]}}
    obstacles:
    - {name: pole, shape: cylinder, size: [0.02, 0.8], pose: {translation: [0.4, 0.4, 0.9]}}
    directives: [package://my_cell/fence.dmd.yaml]
    packages: {my_cell: /home/me/my_cell}
"""

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from pathlib import Path

from pydrake.common.schema import Transform
from pydrake.common.yaml import yaml_dump, yaml_load, yaml_load_typed
from pydrake.geometry import Box, Capsule, Cylinder, Ellipsoid, Mesh, Shape, Sphere
from pydrake.math import RigidTransform

from models.arrays import finite_number
from models.errors import ModelError
from models.scenes.inputs import finite_pose
from models.texts import read_text

SHAPES: dict[str, tuple[Callable[..., Shape], tuple[str, ...]]] = {
    "box": (Box, ("length in x", "in y", "in z")),
    "sphere": (Sphere, ("radius",)),
    "cylinder": (Cylinder, ("radius", "length in z")),
    "capsule": (Capsule, ("radius", "length in z between the caps")),
    "ellipsoid": (Ellipsoid, ("half axis in x", "in y", "in z")),
}
"""Shapes by name, with what their ``size`` holds [m]. Beside them ``mesh``, which takes a file."""

FLANGE, HAND = "flange", "gripper"
"""Where a tool may be: in place of the gripper, or welded to the gripper's base."""


@dataclass
class Obstacle:
    """A body that stands still.

    Attributes:
        name: its own, by which verdicts name it.
        shape: one of `SHAPES`, or ``mesh``.
        size: its dimensions [m], as `SHAPES` lists them; of a mesh the scale, or nothing.
        pose: of the shape's centre in the world, or of a mesh's origin.
        file: of a mesh, by absolute path (.obj, .vtk or .gltf); its convex hull counts.
    """

    name: str = ""
    shape: str = ""
    size: list[float] = field(default_factory=list)
    pose: Transform = field(default_factory=Transform)
    file: str = ""


@dataclass
class Tool:
    """What the arm works with.

    Attributes:
        shape: one of `SHAPES`; or empty, and ``file`` says what the tool is.
        size: the shape's dimensions [m], as `SHAPES` lists them.
        file: a model file (URDF, SDF, MJCF), by absolute path or ``package://``.
        on: ``flange``, in place of the gripper; or ``gripper``, welded to the gripper's base.
        pose: of the shape's centre, or of the file's base link, in the link that it is welded to.
        tcp: the tool centre point in the tool's base link; its z is the approach.
    """

    shape: str = ""
    size: list[float] = field(default_factory=list)
    file: str = ""
    on: str = FLANGE
    pose: Transform = field(default_factory=Transform)
    tcp: Transform = field(default_factory=Transform)


@dataclass
class Setup:
    """A cell: what is not said is as in the shipped scene.

    Attributes:
        base: pose of the arm's base in the world.
        tool: what the arm works with in place of its gripper, or on it.
        obstacles: bodies that stand still.
        directives: Drake model directives of one's own, by absolute path or ``package://``; they
            are added last, and may weld to ``arm::…``, ``gripper::…``, ``tool::…`` and ``world``.
        packages: folders of packages that files name as ``package://NAME``.
        furniture: whether the shipped box and table are there.
    """

    base: Transform | None = None
    tool: Tool | None = None
    obstacles: list[Obstacle] = field(default_factory=list)
    directives: list[str] = field(default_factory=list)
    packages: dict[str, str] = field(default_factory=dict)
    furniture: bool = True


_FIELDS = ", ".join(each.name for each in fields(Setup))


def read_setup(path: str | Path) -> Setup:
    """Read a setup from a YAML file.

    Raises:
        ModelError: if the file cannot be read or is no YAML, or a field is unknown or of another
            type.
    """
    text = read_text(path, "a setup in YAML")
    try:
        every = yaml_load(data=text)
    except Exception as error:  # of many kinds
        raise ModelError(f"{path}: {' '.join(str(error).split())}") from None
    if not isinstance(every, dict):
        raise ModelError(f"{path}: {type(every).__name__}; valid: {_FIELDS}")
    setup = Setup()
    for name, value in every.items():
        if name not in _FIELDS.split(", "):
            raise ModelError(f"{path}: {name}; valid: {_FIELDS}")
        try:
            one = yaml_load_typed(schema=Setup, data=yaml_dump({name: value}))
        except Exception as error:  # Drake's loader raises many kinds
            reason = " ".join(str(error).split())
            raise ModelError(f"{path}: {name}: {reason}; valid: as in {__name__}") from None
        setattr(setup, name, getattr(one, name))
    return setup


def rigid(pose: Transform | RigidTransform, name: str) -> RigidTransform:
    """A pose as Drake computes with it.

    Raises:
        ModelError: if it is none, is a distribution, or is not finite.
    """
    if isinstance(pose, Transform):
        if not pose.IsDeterministic() or pose.base_frame:
            raise ModelError(f"{name}: {pose}; valid: one pose, without a base frame")
        pose = pose.GetDeterministicValue()
    return finite_pose(pose, name)


def shape_of(thing: Obstacle | Tool, name: str) -> Shape:
    """The shape that an obstacle or a tool says it has.

    Raises:
        ModelError: if its kind is unknown, or its size not so many numbers above 0.
    """
    size = [
        finite_number(x, f"{name}: size", above=0.0, valid="metres above 0") for x in thing.size
    ]
    if thing.shape == "mesh" and isinstance(thing, Obstacle):
        if not Path(thing.file).is_absolute() or not Path(thing.file).is_file():
            raise ModelError(f"{name}: file {thing.file!r}; valid: a mesh by its absolute path")
        if len(size) > 1:
            raise ModelError(f"{name}: size {thing.size}; valid: the scale of the mesh, or nothing")
        return Mesh(thing.file, *size)
    if thing.shape not in SHAPES:
        valid = ", ".join([*SHAPES, "mesh"] if isinstance(thing, Obstacle) else SHAPES)
        raise ModelError(f"{name}: shape {thing.shape!r}; valid: {valid}")
    kind, dimensions = SHAPES[thing.shape]
    if len(size) != len(dimensions):
        raise ModelError(f"{name}: size {thing.size}; valid: {', '.join(dimensions)} [m]")
    return kind(*size)
