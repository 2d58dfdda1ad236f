import os

import pytest

from irl.errors import InputError
from irl.formats import read_csv, read_json, write_csv, write_json


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


@pytest.mark.parametrize("read", [read_csv, read_json])
def test_missing_files_are_named(tmp_path, read):
    with pytest.raises(InputError, match=r"none: no such file"):
        read(tmp_path / "none")


@pytest.mark.parametrize("text", ['{"a": 1, "a": 2}', '{"a": {"b": 1, "c": 2, "b": 1}}'])
def test_a_name_that_an_object_has_twice_is_refused(tmp_path, text):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(InputError, match=r"a\.json: not valid JSON \(the name '[ab]' occurs twice"):
        read_json(tmp_path / "a.json")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
@pytest.mark.parametrize("read", [read_json, read_csv])
def test_a_pipe_is_refused_and_not_waited_for(tmp_path, read):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="pipe: not a file"):
        read(tmp_path / "pipe")
