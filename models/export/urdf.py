"""A robot as plain URDF: what urdfdom, and every reader that is stricter than Drake, understands.

``<capsule>`` is not of URDF 1.0, and readers refuse it or drop the shape. A cylinder with two
spheres is the same set of points.
"""

import xml.etree.ElementTree as ET

from pydrake.math import RigidTransform

from models.export.merged import Merged, copies, origin, words

INTERFACE = "hardware_interface/PositionJointInterface"


def to_urdf(robot: Merged) -> str:
    """The robot as one ``<robot>``, its root the arm's base; frame ``tcp`` is a link of its own."""
    root = ET.Element("robot", name=robot.name)
    root.extend(copies(robot.materials))
    for link in copies(robot.links):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            _split_capsule(link, shape)
        root.append(link)
    root.extend(copies(robot.joints))
    following = {j.attrib["name"] for j in robot.joints if j.find("mimic") is not None}
    for name in robot.actuated:
        if name not in following:  # nobody commands a joint that mimics another
            root.append(_transmission(name))
    return document(root)


def document(root: ET.Element) -> str:
    """XML with a declaration and indented lines."""
    ET.indent(root)
    return f'<?xml version="1.0"?>\n{ET.tostring(root, encoding="unicode")}\n'


def _split_capsule(link: ET.Element, shape: ET.Element) -> None:
    """Replace a visual or collision element's capsule by a cylinder between two spheres."""
    capsule = shape.find("geometry/capsule")
    if capsule is None:
        return
    radius, length = capsule.attrib["radius"], capsule.attrib["length"]
    place = list(link).index(shape)
    link.remove(shape)
    middle = origin(shape)
    given = shape.find("origin")
    turned = {} if given is None or "rpy" not in given.attrib else {"rpy": given.attrib["rpy"]}
    pieces: list[tuple[float, str, dict[str, str]]] = [
        (0.0, "cylinder", {"radius": radius, "length": length}),
        (-float(length) / 2, "sphere", {"radius": radius}),
        (float(length) / 2, "sphere", {"radius": radius}),
    ]
    for offset, kind, attributes in pieces:
        piece = ET.Element(shape.tag)
        X = middle @ RigidTransform([0.0, 0.0, offset])
        ET.SubElement(piece, "origin", {"xyz": words(X.translation()), **turned})
        ET.SubElement(ET.SubElement(piece, "geometry"), kind, attributes)
        piece.extend(copies(shape.findall("material")))
        link.insert(place, piece)
        place += 1


def _transmission(joint: str) -> ET.Element:
    """A transmission in the manner of ros_control, without reduction."""
    element = ET.Element("transmission", name=f"{joint}_transmission")
    ET.SubElement(element, "type").text = "transmission_interface/SimpleTransmission"
    led = ET.SubElement(element, "joint", name=joint)
    ET.SubElement(led, "hardwareInterface").text = INTERFACE
    motor = ET.SubElement(element, "actuator", name=f"{joint}_motor")
    ET.SubElement(motor, "mechanicalReduction").text = "1"
    return element
