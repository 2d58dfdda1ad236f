"""Damaged and hostile input: refused in one line, or whole; never a traceback, never a lie.

Seeded: number ``k`` is the same damage on every machine. What is accepted is looked at here, with
no code of the packages: its parts must not contradict one another.
"""

import csv
import hashlib
import io
import json
import math
import shutil
import zipfile
from collections import Counter
from dataclasses import fields, is_dataclass
from itertools import pairwise

import numpy as np
import pytest

from experiments.grasping.learning import _read_curve
from experiments.kit.command import execute
from experiments.own_task import workshop
from irl import checkpoint
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.policy import Policy, load_policy, save_policy
from irl.task_data import load_task, save_task
from irl.tensor_file import from_bytes, to_bytes
from tests.experiments.bent import HOSTILE, bent_arrays, bent_bytes, bent_file, bent_json, pick
from tests.experiments.kit.test_options import COMMANDS, numbers, story_of

QUICK, ALL = 240, 2000


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Everything undamaged: a task with demonstrations, a policy, a checkpoint, a curve."""
    folder = tmp_path_factory.mktemp("whole")
    task = workshop(parts=3, worn_out=2)
    shown = [[(0, 0), (int(task.model.P[0].indices[0]), 1)], [(1, 2)]]
    object.__setattr__(task, "demonstrations", Demonstrations.from_trajectories(shown))
    object.__setattr__(task, "fixed_vr", {3: -1.0})
    save_task(task, folder / "task")
    task = load_task(folder / "task")
    q = np.random.default_rng(0).normal(size=task.model.mask.shape)
    weights = {"0.0.weight": np.arange(4.0, dtype=np.float32)}
    policy = Policy.from_q(q, task.model.mask, weights=weights, task_hash=task.task_hash)
    save_policy(policy, folder / "policy.safetensors")
    arrays = {"w": np.arange(5.0), "n": np.arange(3)}
    checkpoint.save(folder / "work.checkpoint", arrays, {"done": 3}, {"seed": 1})
    curve = {"query": 0, "demonstrated": 60, "success": 0.5, "accuracy_optimal_all": 0.25}
    (folder / "curve.json").write_text(json.dumps({"points": [curve, curve | {"query": 1}]}))
    return folder


def strictly(text):
    """JSON whose objects have every key once."""

    def once(pairs):
        assert len(dict(pairs)) == len(pairs)
        return dict(pairs)

    return json.loads(text, object_pairs_hook=once)


def arrays_of(path):
    with zipfile.ZipFile(path) as archive:
        assert len(set(archive.namelist())) == len(archive.namelist())
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def rows_of(path):
    return list(csv.DictReader(io.StringIO(path.read_bytes().decode(), newline="")))


def task_agrees(folder):
    """Assert all that the files of a task say of each other."""
    head = strictly((folder / "task.json").read_text())
    for name, digest in head["files"].items():
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == digest
    n, m = head["n_states"], head["n_actions"]
    assert 0 <= head["gamma"] < 1
    for file, count in (("states.csv", n), ("actions.csv", m)):
        assert [row["index"] for row in rows_of(folder / file)] == [str(k) for k in range(count)]
    t = arrays_of(folder / "transitions.npz")
    assert len({column.shape for column in t.values()}) == 1
    assert (t["probability"] > 0).all() and (t["count"] >= 0).all() and (t["evidence"] < 3).all()
    total, moves = Counter(), set()
    for s, a, s2, p in zip(*(t[k] for k in ("state", "action", "next_state", "probability"))):  # noqa: B905
        assert 0 <= s < n and 0 <= a < m and 0 <= s2 < n
        assert (s, a, s2) not in moves
        moves.add((s, a, s2))
        total[s, a] += p
    assert all(abs(p - 1) < 1e-8 for p in total.values())
    for array in arrays_of(folder / "features.npz").values():
        assert array.ndim == 2 and len(array) == n and array.shape[1] > 0
        assert np.isfinite(array).all()
    preferences = strictly((folder / "state_preferences.json").read_text())
    assert not set(preferences["preferred"]) & set(preferences["avoided"])
    clusters = strictly((folder / "clusters.json").read_text())
    for states in (head["goal_states"], head["start_states"], *clusters.values()):
        assert states
    sets = [head["goal_states"], head["start_states"], *clusters.values(), *preferences.values()]
    for states in sets:
        assert len(set(states)) == len(states) and all(0 <= s < n for s in states)
    for state, value in head.get("fixed_vr", {}).items():
        assert 0 <= int(state) < n and math.isfinite(value)
    demonstrations_agree(folder / "demonstrations.csv", total, moves)


def demonstrations_agree(path, pairs, moves):
    """Assert that steps occur once, that all can be done, and that a run goes where it can."""
    run = {}
    for row in rows_of(path):
        at = int(row["trajectory"]), int(row["step"])
        assert at not in run
        run[at] = int(row["state"]), int(row["action"] or -1)
        assert row["action"] == "" or run[at] in pairs
    for (trajectory, step), (state, action) in run.items():
        after = run.get((trajectory, step + 1))
        assert after is None or action < 0 or (state, action, after[0]) in moves


def try_task(whole, folder, rng):
    shutil.copytree(whole / "task", folder)
    names = sorted(path.name for path in folder.iterdir())
    name = pick(rng, [*names, *["task.json", "transitions.npz", "demonstrations.csv"] * 2])
    (folder / name).write_bytes(bent_file(name, (folder / name).read_bytes(), rng))
    if name != "task.json" and rng.random() < 0.8:  # so that what is inside is looked at
        head = json.loads((folder / "task.json").read_text())
        head["files"][name] = hashlib.sha256((folder / name).read_bytes()).hexdigest()
        (folder / "task.json").write_text(json.dumps(head))
    load_task(folder)
    task_agrees(folder)


def write_bent(path, data, rng, share, bend):
    """Write tensors damaged in a share of cases by the byte, else as ``bend`` does; if it could."""
    try:
        by_byte = rng.random() < share
        path.write_bytes(bent_bytes(data, rng) if by_byte else to_bytes(*bend(*from_bytes(data))))
    except InputError:  # a type that the format does not have
        return False
    return True


def try_policy(whole, folder, rng):
    """With its digest what is inside cannot differ; without, as of old, it must fit the task."""
    folder.mkdir()
    data, path = (whole / "policy.safetensors").read_bytes(), folder / "p.safetensors"
    saved, told = from_bytes(data)

    def bend(arrays, metadata):
        if rng.random() < 0.6:
            del metadata["digest"]
        if rng.random() < 0.2:
            metadata[pick(rng, sorted(metadata))] = str(pick(rng, HOSTILE))
        return bent_arrays(arrays, rng), metadata

    if rng.random() < 0.3:
        path.write_bytes(with_a_bit_turned(data, rng))
    elif not write_bent(path, data, rng, 0.4, bend):
        return
    task = load_task(whole / "task")
    mask = task.model.mask
    policy = load_policy(path, task.task_hash, mask)
    found, metadata = from_bytes(path.read_bytes())
    if "digest" in metadata:
        assert metadata == told
        assert {k: (v.dtype, v.shape, v.tobytes()) for k, v in found.items()} == {
            k: (v.dtype, v.shape, v.tobytes()) for k, v in saved.items()
        }
    assert policy.q.shape == mask.shape and policy.action.shape == mask.shape[:1]
    for state, action in enumerate(policy.action.tolist()):
        feasible = np.flatnonzero(mask[state]).tolist()
        assert action in feasible if feasible else action == -1
        assert action < 0 or policy.q[state, action] == policy.q[state].max()
    assert policy.task_hash == task.task_hash


def with_a_bit_turned(data, rng):
    """Tensors in which a bit of an array is turned: the file still parses."""
    header = 8 + int.from_bytes(data[:8], "little")
    at = int(rng.integers(header, len(data)))
    turned = data[:at] + bytes([data[at] ^ (1 << int(rng.integers(8)))]) + data[at + 1 :]
    assert from_bytes(turned)[0].keys() == from_bytes(data)[0].keys()
    return turned


def try_checkpoint(whole, folder, rng):
    folder.mkdir()
    data, path = (whole / "work.checkpoint").read_bytes(), folder / "work.checkpoint"

    def bend(arrays, metadata):
        if rng.random() < 0.5:
            metadata["checkpoint"] = bent_json(metadata["checkpoint"], rng)
            return arrays, metadata
        return bent_arrays(arrays, rng), metadata

    if not write_bent(path, data, rng, 0.5, bend):
        return
    arrays, state = checkpoint.load(path, {"seed": 1})
    assert state == {"done": 3}
    assert {name: array.tolist() for name, array in arrays.items()} == {
        "w": [0.0, 1.0, 2.0, 3.0, 4.0],
        "n": [0, 1, 2],
    }


def try_demonstrations(whole, folder, rng):
    folder.mkdir()
    text, path = (whole / "task" / "demonstrations.csv").read_bytes(), folder / "shown.csv"
    path.write_bytes(bent_file("shown.csv", text, rng))
    task = load_task(whole / "task")
    Demonstrations.load(path).check(task.model, str(path))
    t = task.transitions
    pairs = set(zip(t.state.tolist(), t.action.tolist(), strict=True))
    moves = zip(t.state.tolist(), t.action.tolist(), t.next_state.tolist(), strict=True)
    demonstrations_agree(path, pairs, set(moves))


def try_curve(whole, folder, rng):
    folder.mkdir()
    path = folder / "curve.json"
    path.write_bytes(bent_file("curve.json", (whole / "curve.json").read_bytes(), rng))
    curve = _read_curve(path)
    strictly(path.read_text())
    assert all(0 <= p.success <= 1 and 0 <= p.accuracy_optimal_all <= 1 for p in curve)
    assert all(a.query < b.query for a, b in pairwise(curve))


def try_options(_, folder, rng):
    """Numbers out of place; what is taken is finite and can be counted."""
    name, arguments = pick(rng, [command for command in COMMANDS if command[0] != "docs"])
    given = list(arguments)
    for option, _, count in [pick(rng, list(numbers(name, arguments))) for _ in range(2)]:
        value = pick(rng, [v for v in HOSTILE if not isinstance(v, (list, dict))])
        given += [f"--{option}", *[str(value)] * max(0, count + int(rng.integers(-1, 2)))]
    taken = []

    def main(config, output):
        taken.append(config)
        return {}

    try:
        execute(story_of(name).Config, main, [*given, "--out", str(folder)])
    except SystemExit as stop:
        raise InputError("refused") if stop.code == 2 else AssertionError(given) from None

    def values(config):
        for field in fields(config):
            value = getattr(config, field.name)
            yield from values(value) if is_dataclass(value) else [value]

    for value in values(taken[0]):
        for number in value if isinstance(value, tuple) else [value]:
            if isinstance(number, (int, float)):
                assert math.isfinite(number) and abs(number) < 2**63


TRIES = [try_task, try_policy, try_checkpoint, try_demonstrations, try_curve, try_options]
WEIGHTS = [5, 3, 3, 3, 1, 5]


@pytest.mark.parametrize("number", [pytest.param(QUICK), pytest.param(ALL, marks=pytest.mark.soak)])
def test_damage_is_refused_in_one_line_or_is_none(whole, tmp_path, capsys, number):
    plan = [attempt for attempt, n in zip(TRIES, WEIGHTS, strict=True) for _ in range(n)]
    refused, taken, wrong = Counter(), Counter(), []
    for k in range(number):
        attempt, folder = plan[k % len(plan)], tmp_path / str(k)
        try:
            attempt(whole, folder, np.random.default_rng([11, k]))
            taken[attempt.__name__] += 1
        except InputError as error:
            refused[attempt.__name__] += 1
            if "\n" in str(error):
                wrong.append((k, attempt.__name__, "more than a line", str(error)))
        except Exception as error:
            wrong.append((k, attempt.__name__, type(error).__name__, str(error)[:200]))
        said = capsys.readouterr().err
        if said.count("\n") > 1 or (said and not said.startswith("error: ")):
            wrong.append((k, attempt.__name__, "said", said[:300]))
        shutil.rmtree(folder, ignore_errors=True)
    with capsys.disabled():
        print(f"\n{number} damaged: {dict(refused)} refused, {dict(taken)} taken")
    kinds = {case[1:3]: case for case in wrong}
    assert not wrong, f"{len(wrong)} of {number}, of each kind one: {list(kinds.values())}"
    assert all(refused[attempt.__name__] > taken[attempt.__name__] for attempt in TRIES)
