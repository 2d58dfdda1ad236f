"""A robot as MJCF, MuJoCo's own language: capsules, couplers between fingers, pairs left out."""

import xml.etree.ElementTree as ET

import numpy as np
from pydrake.math import RigidTransform

from models.errors import ModelError
from models.export.merged import Merged, child, numbers, origin, parent, words
from models.export.urdf import document

CLASSES = {
    "visual": {"contype": "0", "conaffinity": "0", "group": "2"},
    "collision": {"group": "3"},
}
"""Attributes of all shapes of a kind."""
FRICTION = ".//{http://drake.mit.edu}mu_dynamic"


def to_mjcf(robot: Merged) -> str:
    """The robot on its base at the world's origin, a torque motor on every actuated joint.

    A link that is only a frame, such as ``tcp``, is a site. MuJoCo's own rule for which neighbours
    it compares is switched off: what is left out is listed, pair by pair.
    """
    root = ET.Element("mujoco", model=robot.name)
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    ET.SubElement(ET.SubElement(root, "option"), "flag", filterparent="disable")
    default = ET.SubElement(root, "default")
    for name, attributes in CLASSES.items():
        ET.SubElement(ET.SubElement(default, "default", {"class": name}), "geom", attributes)
    asset = ET.SubElement(root, "asset")
    for material in robot.materials:
        color = material.find("color")
        if color is not None:
            ET.SubElement(
                asset, "material", name=material.attrib["name"], rgba=color.attrib["rgba"]
            )
    _add_body(robot, robot.links[0], None, ET.SubElement(root, "worldbody"))
    contact = ET.SubElement(root, "contact")
    for a, b in robot.unpaired:
        ET.SubElement(contact, "exclude", body1=a, body2=b)
    equality = ET.SubElement(root, "equality")
    for joint in robot.joints:
        mimic = joint.find("mimic")
        if mimic is not None:
            line = [float(mimic.get("offset", 0)), float(mimic.get("multiplier", 1)), 0, 0, 0]
            names = {"joint1": joint.attrib["name"], "joint2": mimic.attrib["joint"]}
            ET.SubElement(equality, "joint", names, polycoef=words(line))
    actuator = ET.SubElement(root, "actuator")
    for joint in robot.joints:
        if joint.attrib["name"] in robot.actuated:
            effort = float(_need(joint, "limit").attrib["effort"])
            name = joint.attrib["name"]
            ET.SubElement(
                actuator, "motor", name=name, joint=name, ctrlrange=words([-effort, effort])
            )
    return document(root)


def _add_body(robot: Merged, link: ET.Element, led: ET.Element | None, into: ET.Element) -> None:
    """Add a link, that joint ``led`` carries, and all that it carries."""
    name = link.attrib["name"]
    carried = [joint for joint in robot.joints if parent(joint) == name]
    X_PL = RigidTransform() if led is None else origin(led)
    if not len(link) and not carried:
        ET.SubElement(into, "site", {"name": name, **_placed(X_PL)})
        return
    body = ET.SubElement(into, "body", {"name": name, **_placed(X_PL)})
    if (inertial := link.find("inertial")) is not None:
        body.append(_inertial(inertial))
    if led is not None and led.attrib["type"] != "fixed":
        body.append(_joint(led))
    for kind in CLASSES:
        body.extend(_geom(shape) for shape in link.findall(kind))
    links = {other.attrib["name"]: other for other in robot.links}
    for joint in carried:
        _add_body(robot, links[child(joint)], joint, body)


def _placed(X: RigidTransform) -> dict[str, str]:
    return {"pos": words(X.translation()), "quat": words(X.rotation().ToQuaternion().wxyz())}


def _inertial(inertial: ET.Element) -> ET.Element:
    X, given = origin(inertial), _need(inertial, "inertia").attrib
    xx, xy, xz, yy, yz, zz = (
        float(given[key]) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    R = X.rotation().matrix()
    matrix = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
    six = matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    mass = _need(inertial, "mass").attrib["value"]
    return ET.Element("inertial", pos=words(X.translation()), mass=mass, fullinertia=words(six))


def _joint(joint: ET.Element) -> ET.Element:
    kinds = {"revolute": "hinge", "continuous": "hinge", "prismatic": "slide"}
    kind, name = joint.attrib["type"], joint.attrib["name"]
    if kind not in kinds:
        raise ModelError(f"joint {name} is {kind}; valid: fixed, {', '.join(kinds)}")
    axis = _need(joint, "axis").attrib["xyz"]
    element = ET.Element("joint", name=name, type=kinds[kind], axis=axis)
    if kind != "continuous":
        limit = _need(joint, "limit").attrib
        element.set("range", f"{limit['lower']} {limit['upper']}")
    return element


def _geom(shape: ET.Element) -> ET.Element:
    (kind,) = _need(shape, "geometry")
    element = ET.Element("geom", {**_named(shape), "class": shape.tag, "type": kind.tag})
    given = kind.attrib
    if kind.tag == "box":
        size = list(numbers(given["size"]) / 2)
    elif kind.tag == "sphere":
        size = [float(given["radius"])]
    elif kind.tag in ("cylinder", "capsule"):
        size = [float(given["radius"]), float(given["length"]) / 2]
    else:
        raise ModelError(f"shape {kind.tag}; valid: box, sphere, cylinder, capsule")
    element.set("size", words(size))
    for key, value in _placed(origin(shape)).items():
        element.set(key, value)
    if (material := shape.find("material")) is not None:
        element.set("material", material.attrib["name"])
    if (friction := shape.find(FRICTION)) is not None:
        element.set("friction", friction.attrib["value"])
    return element


def _named(shape: ET.Element) -> dict[str, str]:
    return {"name": shape.attrib["name"]} if "name" in shape.attrib else {}


def _need(element: ET.Element, tag: str) -> ET.Element:
    found = element.find(tag)
    if found is None:
        raise ModelError(f"{element.tag} {element.get('name', '')} has no <{tag}>; valid: with one")
    return found
