import io
import zipfile

import numpy as np
import pytest

from irl.errors import InputError
from irl.formats import read_csv, read_json, read_npz, write_csv, write_json, write_npz


def test_npz_round_trip_keeps_values_types_and_shapes(tmp_path):
    arrays = {
        "b": np.arange(6, dtype=np.int32).reshape(2, 3),
        "a": np.array([0.1, -np.inf]),
        "none": np.zeros((0, 4), dtype=np.uint8),
    }
    write_npz(tmp_path / "a.npz", arrays)
    read = read_npz(tmp_path / "a.npz")
    assert set(read) == set(arrays)
    for name, array in arrays.items():
        np.testing.assert_array_equal(read[name], array)
        assert read[name].dtype == array.dtype
    # It is NumPy's own format.
    np.testing.assert_array_equal(np.load(tmp_path / "a.npz", allow_pickle=False)["b"], read["b"])


def test_equal_arrays_give_equal_bytes_however_they_lie_in_memory(tmp_path):
    table = np.arange(12.0).reshape(3, 4)
    write_npz(tmp_path / "1.npz", {"x": table, "y": np.arange(3)})
    write_npz(tmp_path / "2.npz", {"y": np.arange(3).astype(">i8"), "x": np.asfortranarray(table)})
    assert (tmp_path / "1.npz").read_bytes() == (tmp_path / "2.npz").read_bytes()


def test_nothing_is_pickled_or_unpickled(tmp_path):
    objects = np.array([{}], dtype=object)
    with pytest.raises(ValueError, match="allow_pickle=False"):
        write_npz(tmp_path / "a.npz", {"x": objects})
    np.savez(tmp_path / "b.npz", x=objects)
    with pytest.raises(InputError, match=r"b\.npz: field 'x' cannot be read"):
        read_npz(tmp_path / "b.npz")


@pytest.mark.parametrize("content", [b"", b"no zip", b"\x93NUMPY\x01\x00"])
def test_what_is_no_npz_is_refused(tmp_path, content):
    (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(InputError, match=r"a\.npz: cannot be read"):
        read_npz(tmp_path / "a.npz")


def test_a_flipped_byte_in_an_array_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        data = io.BytesIO()
        np.lib.format.write_array(data, np.arange(100))
        archive.writestr("x.npy", data.getvalue())
    content = bytearray((tmp_path / "a.npz").read_bytes())
    content[300] ^= 1
    (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(InputError, match="field 'x' cannot be read"):
        read_npz(tmp_path / "a.npz")


def test_csv_round_trip_keeps_awkward_text(tmp_path):
    rows = [["0", 'a "b", c'], ["1", "line\nbreak\r\n"], ["2", "γ"]]
    write_csv(tmp_path / "a.csv", ["index", "note"], rows)
    assert read_csv(tmp_path / "a.csv") == (["index", "note"], rows)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "first line must name the columns"),
        (b"a,a\n", "each once"),
        (b"a,b\n1,2\n1\n", "row 1 has 1 columns, the header has 2"),
        (b'a,b\n"1"x,2\n', "not valid CSV"),
        (b"a,\xff\n", "not UTF-8 text"),
    ],
)
def test_bad_csv_is_refused(tmp_path, content, words):
    (tmp_path / "a.csv").write_bytes(content)
    with pytest.raises(InputError, match=words):
        read_csv(tmp_path / "a.csv")


def test_json_round_trip_is_one_field_a_line(tmp_path):
    value = {"a": [1, 2], "γ": {"b": None}}
    write_json(tmp_path / "a.json", value)
    assert read_json(tmp_path / "a.json") == value
    assert (tmp_path / "a.json").read_text(encoding="utf-8").count("\n") == 4
    write_json(tmp_path / "b.json", {})
    assert read_json(tmp_path / "b.json") == {}


@pytest.mark.parametrize("content", ["", "{", '{"a": NaN}', "[" * 100_000])
def test_bad_json_is_refused(tmp_path, content):
    (tmp_path / "a.json").write_text(content)
    with pytest.raises(InputError, match=r"a\.json: not valid JSON") as refusal:
        read_json(tmp_path / "a.json")
    assert "\n" not in str(refusal.value)
    with pytest.raises(ValueError, match="JSON compliant"):
        write_json(tmp_path / "b.json", {"x": float("nan")})


@pytest.mark.parametrize("read", [read_csv, read_json, read_npz])
def test_missing_files_are_named(tmp_path, read):
    with pytest.raises(InputError, match=r"none: no such file"):
        read(tmp_path / "none")
