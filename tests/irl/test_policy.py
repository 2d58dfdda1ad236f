import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest

from irl.errors import InputError
from irl.policy import Policy, load_policy, save_policy
from irl.tensor_file import from_bytes, to_bytes

HASH = "ab" * 32


@pytest.fixture
def policy() -> Policy:
    mask = np.array([[True, True, False], [False, True, True], [False, False, False]])
    q = np.array([[0.5, 0.5, 9.0], [9.0, -0.2, 0.1], [9.0, 9.0, 9.0]])
    weights = {"layer.0": np.arange(6, dtype=np.float32).reshape(2, 3)}
    return Policy.from_q(q, mask, weights=weights, task_hash=HASH, algorithm="fa_mlirl", seed=3)


def test_argmax_is_over_feasible_actions_and_ties_go_low(policy):
    assert policy.action.tolist() == [0, 2, -1]
    assert policy.action.dtype == np.int64
    assert policy.q.dtype == np.float32
    assert np.isneginf(policy.q[2]).all()


def test_an_avoided_action_is_taken_only_for_want_of_another():
    mask = np.array([[False, True, True], [True, True, False]])
    q = np.array([[0.0, -np.inf, -np.inf], [-np.inf, -0.5, 0.0]])
    assert Policy.from_q(q, mask).action.tolist() == [1, 1]


def wanted(q, mask):
    """The first feasible action of highest value, number by number, in exact arithmetic."""
    found = []
    for values, feasible in zip(q, mask, strict=True):
        ranked = [(-Fraction(v), a) for a, v in enumerate(values.tolist()) if feasible[a]]
        found.append(min(ranked)[1] if ranked else -1)
    return found


@pytest.mark.parametrize("offset", [0.0, 1e9, -1e9, 3e15])
@pytest.mark.parametrize("scale", [1e-60, 1e-9, 1.0, 1e30, 1e60, 1e300])
def test_the_file_acts_as_the_values_do_whatever_their_scale_and_offset(tmp_path, scale, offset):
    rng = np.random.default_rng(0)
    q = rng.normal(size=(200, 5)) * scale + offset
    q[:40] = np.round(q[:40] / scale) * scale  # ties
    mask = rng.random(q.shape) < 0.7
    mask[:3] = False
    policy = Policy.from_q(q, mask)
    assert policy.action.tolist() == wanted(q, mask)
    save_policy(policy, tmp_path / "p.safetensors")
    read = load_policy(tmp_path / "p.safetensors")
    np.testing.assert_array_equal(read.action, policy.action)
    acting = mask.any(axis=1)
    np.testing.assert_array_equal(read.q.argmax(axis=1)[acting], policy.action[acting])
    np.testing.assert_array_equal(np.isfinite(read.q), mask)


def test_what_is_kept_says_which_avoided_action_is_taken():
    mask = np.array([[False, True, True]])
    policy = Policy.from_q(np.array([[0.0, -np.inf, -np.inf]]), mask)
    assert policy.q.argmax(axis=1).tolist() == policy.action.tolist() == [1]


def test_what_float32_tells_apart_is_kept_as_it_is():
    q = np.random.default_rng(0).normal(size=(50, 4))
    kept = Policy.from_q(q, np.ones(q.shape, bool)).q
    np.testing.assert_array_equal(kept, q.astype(np.float32))


def test_nan_and_disagreeing_shapes_are_refused():
    with pytest.raises(InputError, match="NaN"):
        Policy.from_q(np.array([[np.inf]]), np.array([[True]]))
    with pytest.raises(InputError, match="NaN"):
        Policy.from_q(np.array([[np.nan]]), np.array([[True]]))
    assert Policy.from_q(np.array([[np.nan, 0]]), np.array([[False, True]])).action.tolist() == [1]
    with pytest.raises(InputError, match="agree"):
        Policy.from_q(np.zeros((2, 2)), np.ones((2, 3), dtype=bool))


def test_round_trip_is_exact(policy, tmp_path):
    save_policy(policy, tmp_path / "p.safetensors")
    read = load_policy(tmp_path / "p.safetensors", task_hash=HASH)
    np.testing.assert_array_equal(read.action, policy.action)
    np.testing.assert_array_equal(read.q, policy.q)
    np.testing.assert_array_equal(read.weights["layer.0"], policy.weights["layer.0"])
    assert (read.task_hash, read.algorithm, read.seed) == (HASH, "fa_mlirl", 3)
    assert [path.name for path in tmp_path.iterdir()] == ["p.safetensors"]


def test_the_safetensors_library_reads_a_policy_and_writes_one(policy, tmp_path):
    library = pytest.importorskip("safetensors.numpy")
    save_policy(policy, tmp_path / "p.safetensors")
    tensors = library.load_file(tmp_path / "p.safetensors")
    assert set(tensors) == {"action", "q", "weights.layer.0"}
    library.save_file(tensors, tmp_path / "theirs.safetensors", metadata())
    theirs = load_policy(tmp_path / "theirs.safetensors", task_hash=HASH)
    np.testing.assert_array_equal(theirs.q, policy.q)


def test_equal_policies_give_equal_bytes_in_every_process(tmp_path):
    code = (
        "import sys, numpy as np; from irl.policy import Policy, save_policy;"
        "save_policy(Policy.from_q(np.eye(3), np.eye(3) > 0, task_hash='t', algorithm='a',"
        "weights={'b': np.ones(2), 'a': np.ones(3)}), sys.argv[1])"
    )
    for name in "123":
        subprocess.run([sys.executable, "-c", code, str(tmp_path / name)], check=True)
    assert len({(tmp_path / name).read_bytes() for name in "123"}) == 1


def metadata(**changes):
    good = {"schema_version": "1", "task_hash": HASH, "algorithm": "x", "seed": "0"}
    return {key: value for key, value in (good | changes).items() if value is not None}


@pytest.mark.parametrize(
    ("changes", "meta", "words"),
    [
        ({"q": None}, metadata(), "field 'q' is missing"),
        ({"action": None}, metadata(), "field 'action' is missing"),
        ({"action": np.zeros(2, dtype=np.int32)}, metadata(), "'action' must be int64"),
        ({"q": np.zeros((2, 3))}, metadata(), "'q' must be float32"),
        ({"q": np.zeros(2, dtype=np.float32)}, metadata(), "'q' must be float32 with 2"),
        ({"q": np.zeros((3, 3), dtype=np.float32)}, metadata(), "one row per state"),
        ({"q": np.full((2, 3), np.nan, dtype=np.float32)}, metadata(), "'q' holds NaN"),
        ({"action": np.array([0, 3])}, metadata(), "'action' must lie in −1…2"),
        ({}, metadata(schema_version="2"), "'schema_version' is '2'; supported: '1'"),
        ({}, metadata(schema_version=None), "'schema_version' is None"),
        ({}, metadata(seed=None), "metadata field 'seed' is missing"),
        ({}, metadata(seed="x"), "field 'seed' must be an integer"),
        ({}, metadata(task_hash="cd" * 32), "another task"),
    ],
)
def test_a_bad_policy_is_refused_in_one_line(tmp_path, changes, meta, words):
    path = tmp_path / "p.safetensors"
    tensors = {"action": np.array([0, 1]), "q": np.zeros((2, 3), dtype=np.float32)} | changes
    path.write_bytes(to_bytes({k: v for k, v in tensors.items() if v is not None}, meta))
    with pytest.raises(InputError, match=words) as refusal:
        load_policy(path, task_hash=HASH)
    assert str(path) in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_policy_with_any_bit_of_its_arrays_turned_is_refused_by_file_and_field(policy, tmp_path):
    path = tmp_path / "p.safetensors"
    save_policy(policy, path)
    data = path.read_bytes()
    arrays = 8 + int.from_bytes(data[:8], "little")
    assert len(data) - arrays == sum(a.nbytes for a in from_bytes(data)[0].values())
    for at in range(arrays, len(data)):
        for bit in range(8):
            path.write_bytes(data[:at] + bytes([data[at] ^ (1 << bit)]) + data[at + 1 :])
            with pytest.raises(InputError, match=r"p\.safetensors: field 'digest' is not that of"):
                load_policy(path, mask=MASK)


@pytest.mark.parametrize(
    ("arrays", "told"),
    [
        ({"q": np.zeros((3, 3), np.float32)}, {}),
        ({"action": np.array([1, 2, -1])}, {}),
        ({"weights.layer.0": np.zeros((2, 3), np.float32)}, {}),
        ({"weights.layer.1": np.zeros(3, np.float32)}, {}),
        ({}, {"task_hash": "cd" * 32}),
        ({}, {"seed": "4"}),
        ({}, {"digest": ""}),
    ],
)
def test_a_policy_that_is_not_what_was_saved_is_refused(policy, tmp_path, arrays, told):
    path = tmp_path / "p.safetensors"
    save_policy(policy, path)
    found, metadata = from_bytes(path.read_bytes())
    path.write_bytes(to_bytes(found | arrays, metadata | told))
    with pytest.raises(InputError, match="field 'digest' is not that of what the file holds"):
        load_policy(path)


def test_a_policy_from_before_there_were_digests_is_read(policy, tmp_path):
    path = tmp_path / "p.safetensors"
    save_policy(policy, path)
    found, metadata = from_bytes(path.read_bytes())
    del metadata["digest"]
    path.write_bytes(to_bytes(found, metadata))
    read = load_policy(path, HASH, MASK)
    np.testing.assert_array_equal(read.action, policy.action)
    np.testing.assert_array_equal(read.weights["layer.0"], policy.weights["layer.0"])


@pytest.mark.parametrize("kept", [0, 5, 40, -1])
def test_a_truncated_policy_is_refused(policy, tmp_path, kept):
    path = tmp_path / "p.safetensors"
    save_policy(policy, path)
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(InputError, match="not a readable policy file"):
        load_policy(path)


def test_a_missing_policy_is_named(tmp_path):
    with pytest.raises(InputError, match="no such policy file"):
        load_policy(tmp_path / "none.safetensors")


MASK = np.array([[True, True, False], [False, True, True], [False, False, False]])


def test_a_policy_fits_the_task_it_was_learnt_on(policy, tmp_path):
    save_policy(policy, tmp_path / "p.safetensors")
    assert load_policy(tmp_path / "p.safetensors", mask=MASK).action.tolist() == [0, 2, -1]


def test_avoided_actions_fit_where_there_is_nothing_else(tmp_path):
    mask = np.array([[False, True, True], [True, True, False]])
    q = np.array([[0.0, -np.inf, -np.inf], [-np.inf, -0.5, 0.0]])
    save_policy(Policy.from_q(q, mask), tmp_path / "p.safetensors")
    assert load_policy(tmp_path / "p.safetensors", mask=mask).action.tolist() == [1, 1]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda p: p.action.__setitem__(0, -1), "is -1 in state 0, though something is feasible"),
        (lambda p: p.action.__setitem__(0, 2), "is 2 in state 0, which is not feasible"),
        (lambda p: p.action.__setitem__(2, 1), "is 1 in state 2, where nothing is feasible"),
        (lambda p: p.action.__setitem__(1, 1), "is 1 in state 1, though field 'q' gives another"),
        (lambda p: p.q.__setitem__((0, 2), 1.0), "a value to action 2 in state 0, which is not"),
    ],
)
def test_a_policy_that_contradicts_the_task_or_itself_is_refused(policy, tmp_path, change, told):
    change(policy)
    save_policy(policy, tmp_path / "p.safetensors")
    with pytest.raises(InputError) as caught:
        load_policy(tmp_path / "p.safetensors", mask=MASK)
    assert told in str(caught.value)


@pytest.mark.parametrize("shape", [(2, 3), (4, 3), (3, 2), (3, 4)])
def test_a_policy_of_another_size_than_the_task_is_refused(policy, tmp_path, shape):
    save_policy(policy, tmp_path / "p.safetensors")
    with pytest.raises(InputError, match="'q' has 3 states and 3 actions, the task has"):
        load_policy(tmp_path / "p.safetensors", mask=np.ones(shape, dtype=bool))


def test_a_digest_whose_name_was_damaged_is_no_older_file(tmp_path):
    save_policy(Policy.from_q(np.eye(2), np.ones((2, 2), dtype=bool)), tmp_path / "p")
    told = (tmp_path / "p").read_bytes()
    (tmp_path / "p").write_bytes(told.replace(b'"digest"', b'"digezt"'))
    with pytest.raises(InputError, match="metadata field 'digezt' is unknown"):
        load_policy(tmp_path / "p")
