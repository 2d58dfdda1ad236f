import json

import numpy as np
import pytest

from irl.checkpoint import Checkpoint, fingerprint, load, restore_rng, rng_state, save
from irl.errors import InputError
from irl.tensor_file import from_bytes, to_bytes

ARRAYS = {"weights": np.arange(6.0).reshape(2, 3), "none": np.zeros(0, dtype=np.int64)}
STATE = {"done": 3, "name": "β"}
IDENTITY = {"step": 0.1, "hidden": (3, 4), "problem": "a" * 64}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.safetensors"


def test_everything_comes_back(path):
    save(path, ARRAYS, STATE, IDENTITY)
    arrays, state = load(path, IDENTITY)
    assert state == STATE
    assert arrays.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        assert arrays[name].dtype == array.dtype
        np.testing.assert_array_equal(arrays[name], array)


def test_equal_content_gives_equal_bytes_and_nothing_else_is_left(path):
    save(path, ARRAYS, STATE, IDENTITY)
    first = path.read_bytes()
    save(path, dict(reversed(ARRAYS.items())), STATE, IDENTITY)
    assert path.read_bytes() == first
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_a_transposed_array_keeps_its_values(path):
    save(path, {"t": ARRAYS["weights"].T}, {}, {})
    np.testing.assert_array_equal(load(path, {})[0]["t"], ARRAYS["weights"].T)


@pytest.mark.parametrize(
    "kind", [np.random.PCG64, np.random.MT19937, np.random.Philox, np.random.SFC64]
)
def test_random_numbers_go_on_where_they_were(kind):
    rng = np.random.Generator(kind(7))
    rng.integers(10, size=3, dtype=np.int32)  # leaves half a word over
    state = json.loads(json.dumps(rng_state(rng)))
    expected = rng.random(5), rng.integers(10, size=5, dtype=np.int32)
    other = np.random.Generator(kind(0))
    restore_rng(other, state)
    np.testing.assert_array_equal((other.random(5), other.integers(10, size=5)), expected)


def test_other_work_is_refused_by_what_differs(path):
    save(path, ARRAYS, STATE, IDENTITY)
    with pytest.raises(InputError) as told:
        load(path, IDENTITY | {"step": 0.2, "problem": "b" * 64, "new": None, "seed": 1})
    message = str(told.value)
    assert str(path) in message
    assert "step (0.1 there, 0.2 here)" in message
    assert "problem" in message
    assert "seed" in message
    assert "hidden" not in message
    assert "\n" not in message


def test_any_damage_is_noticed(path):
    save(path, ARRAYS, STATE, IDENTITY)
    whole = path.read_bytes()
    for position in range(len(whole)):
        broken = bytearray(whole)
        broken[position] ^= 0x11
        path.write_bytes(broken)
        with pytest.raises(InputError, match=r"run\.safetensors"):
            load(path, IDENTITY)
    for size in (0, 7, 8, 100, len(whole) - 1):
        path.write_bytes(whole[:size])
        with pytest.raises(InputError, match=r"run\.safetensors"):
            load(path, IDENTITY)


def test_what_is_no_checkpoint_is_refused(path):
    with pytest.raises(InputError, match="no such checkpoint"):
        load(path, {})
    path.write_bytes(to_bytes({"weights": np.zeros(2)}, {}))
    with pytest.raises(InputError, match="not a readable checkpoint"):
        load(path, {})
    path.write_bytes(to_bytes({"weights": np.zeros(2)}, {"checkpoint": "[1, 2]"}))
    with pytest.raises(InputError, match="not a readable checkpoint"):
        load(path, {})
    header = json.dumps({"schema_version": 99, "content": "", "digest": ""})
    path.write_bytes(to_bytes({"weights": np.zeros(2)}, {"checkpoint": header}))
    with pytest.raises(InputError, match="schema_version"):
        load(path, {})


def test_a_failed_save_leaves_the_last_one(path):
    save(path, ARRAYS, STATE, IDENTITY)
    with pytest.raises(TypeError):
        save(path, ARRAYS, {"done": object()}, IDENTITY)
    assert load(path, IDENTITY)[1] == STATE


def test_fingerprints_tell_values_types_and_shapes_apart():
    a = np.arange(6)
    others = [a + 1, a.astype(np.int32), a.reshape(2, 3), a.reshape(3, 2).T, np.zeros((0, 2))]
    prints = [fingerprint(a), *(fingerprint(other) for other in others), fingerprint(a, a)]
    assert len(set(prints)) == len(prints)
    assert fingerprint(a.reshape(2, 3).T) == fingerprint(a.reshape(2, 3).T.copy())


def test_interval_is_positive(path):
    with pytest.raises(InputError, match="every"):
        Checkpoint(path, 0)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda h: h | {"content": 5}, "does not match its digest"),
        (lambda h: h | {"content": [1]}, "does not match its digest"),
        (lambda h: h | {"schema_version": True}, "'schema_version' is True"),
        (lambda h: [h], "not a readable checkpoint"),
    ],
)
def test_a_header_that_says_something_else_is_refused(tmp_path, change, told):
    path = tmp_path / "c"
    save(path, {"a": np.arange(2)}, {}, {})
    arrays, metadata = from_bytes(path.read_bytes())
    header = json.dumps(change(json.loads(metadata["checkpoint"])))
    path.write_bytes(to_bytes(arrays, {"checkpoint": header}))
    with pytest.raises(InputError, match=told):
        load(path, {})


def test_a_nest_in_a_header_is_refused(tmp_path):
    path = tmp_path / "c"
    path.write_bytes(to_bytes({}, {"checkpoint": "[" * 100_000}))
    with pytest.raises(InputError, match="not a readable checkpoint"):
        load(path, {})
