"""What a URDF cannot say: groups of joints, named postures, pairs of links never compared."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping

import numpy as np

from models.export.merged import Merged, child, parent
from models.export.urdf import document


def to_srdf(robot: Merged, arm: str, postures: Mapping[str, np.ndarray]) -> str:
    """The robot's SRDF, as MoveIt and pinocchio read it.

    Args:
        robot: the robot.
        arm: which of its parts the postures are of.
        postures: joint angles ``[n]`` [rad] by name.
    """
    root = ET.Element("robot", name=robot.name)
    for part, joints in robot.parts.items():
        group = ET.SubElement(root, "group", name=part)
        for joint in joints:
            ET.SubElement(group, "joint", name=joint)
    for name, q in postures.items():
        state = ET.SubElement(root, "group_state", name=name, group=arm)
        for joint, angle in zip(robot.parts[arm], q.tolist(), strict=True):
            ET.SubElement(state, "joint", name=joint, value=repr(angle))
    moved = {child(j): parent(j) for j in robot.joints}
    (hand,) = [part for part in robot.parts if part != arm]
    first = next(j for j in robot.joints if j.attrib["name"] == robot.parts[hand][0])
    wrist = moved[parent(first)]
    ET.SubElement(root, "end_effector", name=hand, parent_link=wrist, group=hand)
    adjacent = robot.link_pairs()
    for pair in robot.unpaired:
        reason = "Adjacent" if pair in adjacent else "User"
        ET.SubElement(root, "disable_collisions", link1=pair[0], link2=pair[1], reason=reason)
    return document(root)
