import io
import json
import struct
import zipfile

import numpy as np
import pytest

from irl import npz
from irl.errors import InputError
from irl.npz import read_npz, write_npz


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
    with pytest.raises(InputError, match=r"b\.npz: field 'x': cannot be read"):
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
    with pytest.raises(InputError, match="field 'x': cannot be read"):
        read_npz(tmp_path / "a.npz")


def zipped(path, *members):
    """A zip file of (name, bytes), names repeated or not."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members:
            archive.writestr(name, data)
    return path


def npy(array=None, header=None):
    """The bytes of an npy file, with a header of one's own if wanted."""
    data = io.BytesIO()
    np.lib.format.write_array(data, np.arange(3.0) if array is None else array)
    if header is None:
        return data.getvalue()
    text = header.encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + np.arange(3.0).tobytes()


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_a_name_that_is_there_twice_is_refused(tmp_path):
    path = zipped(tmp_path / "a.npz", ("x.npy", npy()), ("x.npy", npy(np.zeros(3))))
    with pytest.raises(InputError, match=r"a\.npz: field 'x': cannot be read \(it is there twice"):
        read_npz(path)


@pytest.mark.parametrize("name", ["../evil.npy", "a/b.npy", "x.txt", ".npy"])
def test_a_member_that_is_no_array_beside_the_others_is_refused(tmp_path, name):
    with pytest.raises(InputError, match=r"a\.npz: field .*no name of an array"):
        read_npz(zipped(tmp_path / "a.npz", (name, npy())))


def test_names_need_not_be_pythons(tmp_path):
    write_npz(tmp_path / "a.npz", {"two words": np.arange(2), "γ-1": np.arange(3)})
    assert read_npz(tmp_path / "a.npz").keys() == {"two words", "γ-1"}


@pytest.mark.parametrize(
    "header",
    [
        "",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (3,)",  # unclosed
        "{'descr': '<f8', 'fortran_order': False, 'shape': (3,), 'more': 1}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (4,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (-3,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000000000,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999999,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': 3}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (3.0,)}",
        "{'descr': 'nonsense', 'fortran_order': False, 'shape': (3,)}",
        "{'descr': '|O', 'fortran_order': False, 'shape': (3,)}",
        "{'descr': 5, 'fortran_order': False, 'shape': (3,)}",
        "{'descr': '<f8', 'fortran_order': 'maybe', 'shape': (3,)}",
        "[" * 300,
        "\x00",
        "'" * 3,
    ],
)
def test_a_header_that_cannot_be_is_refused_by_field(tmp_path, header):
    path = zipped(tmp_path / "a.npz", ("x.npy", npy(header=header)))
    with pytest.raises(InputError, match=r"a\.npz: field 'x': cannot be read"):
        read_npz(path)


def test_what_would_unpack_to_too_much_is_refused_before_it_does(tmp_path, monkeypatch):
    path = zipped(tmp_path / "a.npz", ("x.npy", npy(np.zeros(100_000))))
    assert path.stat().st_size < 10_000
    monkeypatch.setattr(npz, "LARGEST", 799_999)
    monkeypatch.setattr(zipfile.ZipFile, "read", lambda *_: pytest.fail("was unpacked"))
    with pytest.raises(InputError, match=r"would unpack to 800128 bytes, the most is 799999"):
        read_npz(path)


@pytest.mark.parametrize("seed", range(40))
def test_random_damage_is_refused_or_leaves_the_arrays_as_they_are(tmp_path, seed):
    rng = np.random.default_rng(seed)
    arrays = {"a": np.arange(50), "b": rng.random((4, 5)).astype(np.float32)}
    path = tmp_path / "a.npz"
    write_npz(path, arrays)
    content = bytearray(path.read_bytes())
    for place in rng.integers(len(content), size=rng.integers(1, 6)):
        content[place] ^= int(rng.integers(1, 256))
    path.write_bytes(bytes(content[: rng.integers(len(content) // 2, len(content) + 1)]))
    try:
        read = read_npz(path)
    except InputError as error:
        assert "a.npz" in str(error)
        assert "\n" not in str(error)
    else:  # what zip files say of dates and systems means nothing
        assert json.dumps({k: v.tolist() for k, v in sorted(read.items())}) == json.dumps(
            {k: v.tolist() for k, v in sorted(arrays.items())}
        )


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"none: no such file"):
        read_npz(tmp_path / "none")
