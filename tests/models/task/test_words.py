"""Words for states, actions and clusters: no two alike, and true of the geometry."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from models.errors import ModelError
from models.rotations import rotation_z
from models.scenes.parsing import DESCRIPTION
from models.task import clusters, spaces, words
from models.task.spaces import LOST, POSITIONS, R_WG, R_WO, Action, Kind, State

NORMALS = {
    "red": [1, 0, 0],
    "orange": [-1, 0, 0],
    "green": [0, 1, 0],
    "blue": [0, -1, 0],
    "yellow": [0, 0, 1],
    "violet": [0, 0, -1],
}
"""Outward normal of each face in the cube's frame."""
AZIMUTH = {
    "front": 0,
    "front left": 45,
    "left": 90,
    "back left": 135,
    "back": 180,
    "back right": -135,
    "right": -90,
    "front right": -45,
}
"""Degrees from +x, away from the robot, towards +y, its left."""


def heading(way):
    angle = np.radians(AZIMUTH[way])
    return np.array([np.cos(angle), np.sin(angle), 0.0])


@pytest.fixture(scope="module")
def states():
    return [words.describe_state(index) for index in range(spaces.N_STATES + 1)]


def test_no_two_states_or_actions_have_the_same_words(states):
    assert len(set(states)) == 15_985
    assert len({words.describe_action(index) for index in range(spaces.N_ACTIONS)}) == 55
    assert len({words.describe_orientation(o) for o in range(48)}) == 48
    assert len({words.describe_gripper(g) for g in range(18)}) == 18
    assert len({words.describe_position(p) for p in range(18)}) == 18


def test_known_states_and_actions():
    assert words.describe_state(LOST) == "lost"
    goal = "on the table, back; yellow face up, red to the front"
    assert words.describe_state(spaces.GOAL_STATE) == goal
    held = "held, back right, upper layer; hand tilted, front right; "
    assert words.describe_state(State(1, 17, 9).index).startswith(held + "red face up, ")
    assert words.describe_state(State(8, 3).index).startswith("on the table, centre; yellow face")
    said = {
        Action(Kind.GRASP, 4): "grasp: hand level, front right",
        Action(Kind.TRANSLATE, 17): "carry: front left, upper layer",
        Action(Kind.ROTATE, 11): "turn: hand from above, turned 45°",
        Action(Kind.DROP): "drop",
    }
    for action, expected in said.items():
        assert words.describe_action(action.index) == expected


@pytest.mark.parametrize("orientation", range(48))
def test_the_named_faces_look_where_they_are_said_to(orientation):
    said = re.fullmatch(
        r"(\w+) face up, (\w+) to the (.+)", words.describe_orientation(orientation)
    )
    up, other, way = said.groups()
    R = R_WO[orientation]
    np.testing.assert_allclose(R @ NORMALS[up], [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(R @ NORMALS[other], heading(way), atol=1e-9)
    aligned = spaces.ORIENTATION_ANGLES[orientation, 2] % 90 == 0
    assert way == ("front" if aligned else "front left")


def test_faces_have_the_colours_of_the_description():
    shown = {}
    for visual in ET.parse(DESCRIPTION / "cube.sdf").iter("visual"):
        if visual.get("name").startswith("face"):
            p = np.array(visual.findtext("pose").split(), dtype=float)[:3]
            colour = np.array(visual.findtext("material/diffuse").split(), dtype=float)[:3]
            shown[tuple(np.rint(p / 0.0198))] = colour
    plain = {
        "red": (1, 0, 0),
        "orange": (1, 0.5, 0),
        "green": (0, 0.6, 0),
        "blue": (0, 0.3, 1),
        "yellow": (1, 0.9, 0),
        "violet": (0.5, 0.2, 0.7),
    }
    for name, normal in NORMALS.items():
        colour = shown[tuple(normal)]
        nearest = min(plain, key=lambda other: np.linalg.norm(colour - plain[other]))
        assert nearest == name


@pytest.mark.parametrize("gripper", range(18))
def test_the_hand_points_where_it_is_said_to(gripper):
    approach, camera = R_WG[gripper, :, 2], -R_WG[gripper, :, 0]
    said = words.describe_gripper(gripper)
    if above := re.fullmatch(r"hand from above, turned (\d+)°", said):
        np.testing.assert_allclose(approach, [0, 0, -1], atol=1e-9)
        turned = np.radians(float(above[1]))
        np.testing.assert_allclose(camera, [np.cos(turned), -np.sin(turned), 0], atol=1e-9)
        return
    slope, way = re.fullmatch(r"hand (level|tilted), (.+)", said).groups()
    assert (slope == "tilted") == (approach[2] < -0.4)
    level = approach[:2] / np.linalg.norm(approach[:2])
    # Table 4.2 tilts front left and front right at 35.3° of azimuth, not 45°.
    assert level @ heading(way)[:2] > np.cos(np.radians(10))


@pytest.mark.parametrize("position", range(18))
def test_places_are_where_they_are_said_to_be(position):
    column, layer = words.describe_position(position).split(", ")
    x, y, z = POSITIONS[position]
    assert ("front" in column, "back" in column) == (x == 0.6, x == 0.5)
    assert ("left" in column, "right" in column) == (y == 0.1, y == -0.1)
    assert (column == "centre") == (x == 0.55 and y == 0)
    assert layer == ("upper layer" if z == 0.6 else "lower layer")


def test_every_cluster_has_words_of_its_own():
    found = clusters.clusters()
    assert list(words.CLUSTERS) == list(found)
    assert len({words.describe_cluster(name) for name in found}) == len(found)


@pytest.mark.parametrize(
    ("cluster", "in_common"),
    [
        ("not_grasped", "on the table, "),
        ("grasped", "held, "),
        ("gripper_down", "hand from above"),
        ("gripper_front", "hand level, front;"),
        ("gripper_right", "hand level, right;"),
        ("gripper_left", "hand level, left;"),
        ("object_z_vertical", "(yellow|violet) face up"),
        ("object_x_vertical", "(red|orange) face up"),
        ("object_y_vertical", "(green|blue) face up"),
        ("back_limit", "(held|on the table), back"),
        ("front_limit", "(held|on the table), front"),
        ("right_limit", "^[^;]* right[,;]"),
        ("left_limit", "^[^;]* left[,;]"),
        ("upper_limit", "upper layer"),
        ("under_limit", "(on the table|lower layer)"),
        ("center", ", centre[,;]"),
    ],
)
def test_exactly_the_states_of_a_cluster_have_its_words_in_common(states, cluster, in_common):
    have = [index for index, said in enumerate(states) if re.search(in_common, said)]
    np.testing.assert_array_equal(have, clusters.clusters()[cluster])


@pytest.mark.parametrize("cluster", ["object_z_0", "object_z_45", "object_z_90", "object_z_135"])
def test_the_cube_is_turned_as_its_cluster_says(cluster):
    said = re.fullmatch(r".* (\d+)° or (\d+)° on the level", words.describe_cluster(cluster))
    orientations = spaces.decode_states(clusters.clusters()[cluster]).orientation
    for orientation in np.unique(orientations):
        unturned = R_WO[8 * (orientation // 8)]
        turns = [rotation_z(np.radians(float(angle))) @ unturned for angle in said.groups()]
        assert any(np.allclose(R_WO[orientation], turned) for turned in turns)


@pytest.mark.parametrize(
    ("describe", "said"),
    [
        (lambda: words.describe_state(LOST + 1), "state index 15985 is out of range"),
        (lambda: words.describe_action(-1), "action index -1 is out of range 0…54"),
        (lambda: words.describe_orientation(48), "orientation 48 is out of range 0…47"),
        (lambda: words.describe_gripper(-1), "gripper -1 is out of range 0…17"),
        (lambda: words.describe_position(18), "position 18 is out of range 0…17"),
        (lambda: words.describe_cluster("up"), "no cluster 'up'; valid: not_grasped, grasped"),
    ],
)
def test_what_does_not_exist_is_refused(describe, said):
    with pytest.raises(ModelError, match=said):
        describe()
