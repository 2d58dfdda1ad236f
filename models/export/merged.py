"""Arm and gripper as one tree of links and joints, with the pairs that are never compared.

The elements are those of `models/description`: URDF as Drake reads it, capsules included. The
directives add what is between the files: the weld of the gripper, and frame ``tcp``.
"""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Role
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import LoadModelDirectives
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import DiagramBuilder

from models.errors import ModelError
from models.scenes.parsing import DESCRIPTION, PACKAGE, add_models

Array = NDArray[np.float64]
Pair = tuple[str, str]


@dataclass(frozen=True)
class Merged:
    """A robot of several description files.

    Attributes:
        name: what the robot is called.
        materials: ``<material>`` elements with their colours.
        links: ``<link>`` elements, the root first.
        joints: ``<joint>`` elements, in the order of the files.
        actuated: names of the joints that have a motor.
        parts: joints by model instance, such as ``arm`` and ``gripper``; fixed ones are left out.
        unpaired: links, in order of name, whose shapes are never compared with each other.
    """

    name: str
    materials: tuple[ET.Element, ...]
    links: tuple[ET.Element, ...]
    joints: tuple[ET.Element, ...]
    actuated: tuple[str, ...]
    parts: dict[str, tuple[str, ...]]
    unpaired: tuple[Pair, ...]

    def link_pairs(self) -> set[Pair]:
        """Pairs of links, in order of name, that a joint connects."""
        return {_sorted(parent(joint), child(joint)) for joint in self.joints}


def merge(directives: str) -> Merged:
    """Read a robot's directives, such as ``gen3_2f85.dmd.yaml``, and the files that they name.

    Raises:
        ModelError: if a directive is none of those that are understood here, or a name is taken
            twice.
    """
    links: list[ET.Element] = []
    joints: list[ET.Element] = []
    materials: dict[str, ET.Element] = {}
    actuated: list[str] = []
    parts: dict[str, tuple[str, ...]] = {}
    for directive in LoadModelDirectives(str(DESCRIPTION / directives)).directives:
        if model := directive.add_model:
            root = ET.parse(DESCRIPTION / model.file.removeprefix(f"{PACKAGE}/")).getroot()
            links += root.findall("link")
            joints += root.findall("joint")
            materials |= {m.attrib["name"]: m for m in root.findall("material")}
            actuated += [j.attrib["name"] for j in root.findall("transmission/joint")]
            moving = [
                j.attrib["name"] for j in root.findall("joint") if j.attrib["type"] != "fixed"
            ]
            parts[model.name] = tuple(moving)
        elif weld := directive.add_weld:
            joints.append(_fixed(weld.parent, weld.child, _pose(weld.X_PC)))
        elif frame := directive.add_frame:
            links.append(ET.Element("link", name=frame.name))
            joints.append(_fixed(frame.X_PF.base_frame, frame.name, _pose(frame.X_PF)))
        elif not directive.add_collision_filter_group:  # of these, Drake tells what follows
            raise ModelError(
                f"{directives}: a directive that cannot be exported; valid: add_model, add_weld, "
                "add_frame, add_collision_filter_group"
            )
    _require_unique(directives, [link.attrib["name"] for link in links])
    _require_unique(directives, [joint.attrib["name"] for joint in joints])
    return Merged(
        name=directives.removesuffix(".dmd.yaml"),
        materials=tuple(materials.values()),
        links=tuple(links),
        joints=tuple(joints),
        actuated=tuple(actuated),
        parts=parts,
        unpaired=_unpaired(directives),
    )


def parent(joint: ET.Element) -> str:
    """Name of a joint's parent link."""
    return _link_of(joint, "parent")


def child(joint: ET.Element) -> str:
    """Name of a joint's child link."""
    return _link_of(joint, "child")


def origin(element: ET.Element) -> RigidTransform:
    """Pose that an element's ``<origin>`` gives; none of it is the identity."""
    found = element.find("origin")
    attributes = {} if found is None else found.attrib
    xyz, rpy = (numbers(attributes.get(key, "0 0 0")) for key in ("xyz", "rpy"))
    return RigidTransform(RollPitchYaw(rpy), xyz)


def numbers(text: str) -> Array:
    """Numbers of an attribute, as an array."""
    return np.array([float(word) for word in text.split()])


def words(values: Sequence[float] | Array) -> str:
    """Numbers as an attribute has them; reading them gives the same bits."""
    return " ".join(repr(float(value) + 0.0) for value in values)


def copies(elements: Sequence[ET.Element]) -> list[ET.Element]:
    """Elements that may be changed, without what only Drake understands."""
    result = [ET.fromstring(ET.tostring(element)) for element in elements]
    for element in result:
        for inner in list(element.iter()):
            for drakes in [e for e in inner if e.tag.startswith("{")]:
                inner.remove(drakes)
    return result


def _link_of(joint: ET.Element, which: str) -> str:
    element = joint.find(which)
    if element is None:
        raise ModelError(f"joint {joint.get('name')} has no <{which}>; valid: a link's name there")
    return element.attrib["link"]


def _fixed(parent_frame: str, child_frame: str, X_PC: RigidTransform) -> ET.Element:
    """A fixed joint, called after its child; frames may be scoped by their model."""
    names = [name.rpartition("::")[2] for name in (parent_frame, child_frame)]
    joint = ET.Element("joint", name=f"{names[1]}_weld", type="fixed")
    ET.SubElement(joint, "parent", link=names[0])
    ET.SubElement(joint, "child", link=names[1])
    rpy = RollPitchYaw(X_PC.rotation()).vector()
    ET.SubElement(joint, "origin", xyz=words(X_PC.translation()), rpy=words(rpy))
    return joint


def _pose(transform: Any) -> RigidTransform:
    return RigidTransform() if transform is None else transform.GetDeterministicValue()


def _sorted(a: str, b: str) -> Pair:
    return (a, b) if a < b else (b, a)


def _require_unique(directives: str, names: list[str]) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ModelError(f"{directives}: {', '.join(twice)} twice; valid: each name once")


def _unpaired(directives: str) -> tuple[Pair, ...]:
    """Pairs of links that Drake's collision filters leave out altogether."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    add_models(plant, directives)
    plant.Finalize()
    inspector = scene_graph.model_inspector()
    shapes = {}
    for i in range(1, plant.num_bodies()):
        frame = plant.GetBodyFrameIdOrThrow(BodyIndex(i))
        if found := inspector.GetGeometries(frame, Role.kProximity):
            shapes[plant.get_body(BodyIndex(i)).name()] = found
    pairs = {
        _sorted(a, b)
        for a, b in combinations(shapes, 2)
        if all(inspector.CollisionFiltered(x, y) for x in shapes[a] for y in shapes[b])
    }
    return tuple(sorted(pairs))
