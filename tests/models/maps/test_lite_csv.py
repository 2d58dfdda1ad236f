"""The Gen3 Lite's map as a file: exact both ways, and refused by line and field if wrong."""

import numpy as np
import pytest

from models.errors import ModelError
from models.inverse_kinematics.solution import Failure
from models.maps.lite import NONE, NUMERICAL, POLYNOMIAL, Entry
from models.maps.lite_csv import COLUMNS, read_map, write_map
from models.scenes.planning_scene import Clearance

P, Q = np.array([0.55, -0.1, 0.6]), np.array([1 / 3, -2e-17, np.pi, 1e300, -0.0, np.e])
TABLE = Clearance(-0.01, ("table::table", "arm::forearm_link"))
ENTRIES = [
    Entry(P, 7, POLYNOMIAL, Q, Clearance(0.1 + 0.2, None), None, 8, 2),
    Entry(P + 0.01, 3, NONE, None, TABLE, Failure.COLLISION, 8, 2),
    Entry(-P, 12, NUMERICAL, -Q, TABLE, None, 0, 0),
    Entry(2 * P, 0, NONE, None, None, Failure.OUT_OF_REACH, 0, 0),
]


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "map.csv"
    write_map(ENTRIES, 5, path)
    return path


def test_file_holds_every_bit(file):
    for entry, wanted in zip(read_map(file), ENTRIES, strict=True):
        np.testing.assert_array_equal(entry.p_WG, wanted.p_WG)
        np.testing.assert_array_equal(entry.q, wanted.q)
        for name in ("gripper", "value", "clearance", "failure", "solutions", "within_limits"):
            assert getattr(entry, name) == getattr(wanted, name)


def test_a_map_that_was_read_is_written_alike(file, tmp_path):
    again = tmp_path / "again.csv"
    write_map(read_map(file), 5, again)
    assert again.read_bytes() == file.read_bytes()


@pytest.mark.parametrize(
    ("line", "column", "text", "message"),
    [
        (3, "x", "east", "line 3, x: 'east'; valid: a finite number"),
        (3, "q6", "", "line 3, q6: ''"),
        (3, "gripper", "18", "line 3, gripper: 18; valid: 0…17"),
        (3, "value", "3", "line 3, value: 3; valid: 0…2"),
        (4, "failure", "tired", "line 4, failure: 'tired'; valid: out of reach"),
        (4, "solutions", "17", "line 4, solutions: 17; valid: 0…16"),
        (4, "clearance", "near", "line 4, clearance: 'near'"),
    ],
)
def test_malformed_fields_are_named(file, edit_field, line, column, text, message):
    edit_field(file, COLUMNS, line, column, text)
    with pytest.raises(ModelError, match=message):
        read_map(file)


def test_other_files_are_refused(file, tmp_path):
    text = file.read_text()
    title, header, first, *_ = text.splitlines()
    for broken, message in (
        ("", "line 1"),
        (text.replace(title[-64:], "0" * 64), "line 1: .*build the map again"),
        (f"{title}\nx,y,z", "line 2: valid columns: x,y,z,roll"),
        (f"{title}\n{header}\n{first},1", "line 3: 21 fields; valid: 20"),
    ):
        file.write_text(broken)
        with pytest.raises(ModelError, match=message):
            read_map(file)
    with pytest.raises(ModelError, match=r"absent\.csv: cannot be read"):
        read_map(tmp_path / "absent.csv")
