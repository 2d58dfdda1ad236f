"""The map's file: exact both ways, and refused by line and field if wrong."""

import numpy as np
import pytest

from models.errors import ModelError
from models.inverse_kinematics.solution import Failure
from models.maps.gripper_poses import Layer
from models.maps.pose_solver import Entry
from models.maps.reachability import ReachabilityMap
from models.maps.reachability_csv import COLUMNS, read_map, write_map
from models.scenes.planning_scene import Clearance

ENTRIES = [
    Entry(
        Layer.CELL,
        np.array([0.55, -0.1, 0.6]),
        7,
        np.array([1 / 3, -2e-17, np.pi, 1e300, -0.0, 5.0, np.e]),
        Clearance(0.1 + 0.2, ("arm::bracelet_link", "table::table")),
        None,
        3,
    ),
    Entry(Layer.GRASP, np.array([0.5, 0.0, 0.52]), 0, None, None, Failure.NOT_FOUND, 30),
    Entry(Layer.VIA, np.array([0.5, 0.0, 0.75]), 12, np.zeros(7), Clearance(0.05, None), None, 0),
]


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "map.csv"
    write_map(ReachabilityMap(ENTRIES, seed=5), path)
    return path


def test_round_trip_is_exact(file, tmp_path):
    known = read_map(file)
    assert known.seed == 5
    for entry, wanted in zip(known.entries, ENTRIES, strict=True):
        np.testing.assert_array_equal(entry.p_WG, wanted.p_WG)
        assert (entry.q is None) == (wanted.q is None)
        if entry.q is not None:
            np.testing.assert_array_equal(entry.q, wanted.q)
        for name in ("layer", "gripper", "clearance", "failure", "attempts", "value"):
            assert getattr(entry, name) == getattr(wanted, name)
    again = tmp_path / "again.csv"
    write_map(known, again)
    assert again.read_bytes() == file.read_bytes()


def test_rows_read_as_in_the_thesis(file):
    lines = file.read_text().splitlines()
    assert lines[1].startswith("x,y,z,roll,pitch,yaw,gripper,layer,value,q1,")
    assert lines[2].startswith("0.55,-0.1,0.6,-135,45,125,7,cell,1,0.3333333333333333,")


@pytest.mark.parametrize(
    ("line", "column", "text", "message"),
    [
        (3, "x", "east", "line 3, x: 'east'; valid: metres"),
        (3, "z", "inf", "line 3, z: 'inf'"),
        (4, "gripper", "18", "line 4, gripper: .*0…17"),
        (4, "yaw", "10", "line 4, yaw: 10; valid for 0: 0"),
        (5, "layer", "attic", "line 5, layer: 'attic'; valid: cell, via, grasp, added"),
        (3, "value", "2", "line 3, value: 2; valid: 0, 1"),
        (3, "q7", "", "line 3, q7: ''; valid: radians"),
        (4, "failure", "tired", "line 4, failure: 'tired'; valid: out of reach"),
        (5, "attempts", "few", "line 5, attempts: 'few'"),
        (5, "clearance", "near", "line 5, clearance: 'near'"),
    ],
)
def test_malformed_fields_are_named(file, edit_field, line, column, text, message):
    edit_field(file, COLUMNS, line, column, text)
    with pytest.raises(ModelError, match=message) as caught:
        read_map(file)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_map_of_other_model_files_is_refused(file):
    text = file.read_text()
    first = text.splitlines()[0]
    file.write_text(text.replace(first, first[:-64] + "0" * 64))
    with pytest.raises(ModelError, match="line 1, model files: 000000000000… are not the present"):
        read_map(file)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1"),
        ("x,y,z\n", "line 1"),
    ],
)
def test_other_files_are_refused(tmp_path, text, message):
    path = tmp_path / "other.csv"
    path.write_text(text)
    with pytest.raises(ModelError, match=message):
        read_map(path)


def test_other_columns_missing_fields_and_repeated_poses_are_refused(file):
    lines = file.read_text().splitlines()
    for broken, message in (
        ([lines[0], "x,y,z", *lines[2:]], "line 2: valid columns: x,y,z,roll"),
        ([*lines[:2], "0.5,0.1"], "line 3: 2 fields; valid: 21"),
        ([*lines, lines[2]], "line 6, x: this pose occurs before"),
    ):
        file.write_text("\n".join(broken))
        with pytest.raises(ModelError, match=message):
            read_map(file)


def test_missing_file_is_named(tmp_path):
    with pytest.raises(ModelError, match=r"absent\.csv: cannot be read"):
        read_map(tmp_path / "absent.csv")
