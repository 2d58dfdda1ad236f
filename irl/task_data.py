"""A task on disk: the task data directory, its files read and written as a whole.

Import `TaskData` and what it is made of from here; ``irl.task`` defines them.
``task.json`` records the SHA-256 of every other file, so its own hash names the whole task.
"""

import tempfile
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.files import sha256
from irl.formats import read_csv, read_json, write_csv, write_json
from irl.generalisation import Generalisation
from irl.npz import read_npz, write_npz
from irl.task import EVIDENCE, TaskData, Transitions

__all__ = [
    "EVIDENCE",
    "FILES",
    "SCHEMA_VERSION",
    "Generalisation",
    "TaskData",
    "Transitions",
    "load_task",
    "require_replaceable",
    "save_task",
]

SCHEMA_VERSION = 1
FILES = (
    "states.csv",
    "actions.csv",
    "features.npz",
    "transitions.npz",
    "clusters.json",
    "state_preferences.json",
    "generalisation.npz",
    "demonstrations.csv",
)
_REQUIRED = {
    "schema_version": int,
    "name": str,
    "n_states": int,
    "n_actions": int,
    "goal_states": list,
    "start_states": list,
    "gamma": float,
    "files": dict,
    "provenance": dict,
}
_OPTIONAL = {"fixed_vr": dict, "generalisation_rules": list}
_KINDS = {
    int: "an integer",
    float: "a number",
    str: "a string",
    list: "a list",
    dict: "an object",
}


def save_task(task: TaskData, folder: Path) -> str:
    """Write a task data directory, whole or not at all; an older one there is replaced.

    Returns:
        The task's hash.

    Raises:
        InputError: if ``folder`` exists and holds anything but task data.
        OSError: if it cannot be written.
    """
    folder = Path(folder)
    require_replaceable(folder)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{folder.name}.", dir=folder.parent) as holder:
        new, old = Path(holder) / "new", Path(holder) / "old"
        new.mkdir()
        _write_files(task, new)
        task_hash = sha256(new / "task.json")
        if folder.exists():
            folder.rename(old)
        try:
            new.rename(folder)
        except OSError:
            if old.exists():
                old.rename(folder)
            raise
    return task_hash


def require_replaceable(folder: Path) -> None:
    """Refuse a folder that ``save_task`` would not write to; ask before work that ends in it.

    Raises:
        InputError: if ``folder`` exists and holds anything but task data.
    """
    folder = Path(folder)
    if folder.exists() and not _is_replaceable(folder):
        raise InputError(
            f"{folder}: exists and is not a task data directory alone, so it is not overwritten; "
            "name another folder"
        )


def _is_replaceable(folder: Path) -> bool:
    """Tell whether nothing but task data, or nothing at all, would be lost."""
    if not folder.is_dir():
        return False
    found = {path.name for path in folder.iterdir()}
    return not found or ("task.json" in found and found <= {"task.json", *FILES})


def _write_files(task: TaskData, folder: Path) -> None:
    for file, rows in (("states.csv", task.states), ("actions.csv", task.actions)):
        header = ["index", *rows[0]]
        write_csv(folder / file, header, ([k, *row.values()] for k, row in enumerate(rows)))
    write_npz(folder / "features.npz", task.features)
    t, g = task.transitions, task.generalisation
    write_npz(folder / "transitions.npz", {f.name: getattr(t, f.name) for f in fields(t)})
    write_npz(
        folder / "generalisation.npz",
        {"state": g.state, "action": g.action, "group": g.group, "rule": g.rule},
    )
    write_json(folder / "clusters.json", {k: v.tolist() for k, v in task.clusters.items()})
    preferences = {"preferred": task.preferred.tolist(), "avoided": task.avoided.tolist()}
    write_json(folder / "state_preferences.json", preferences)
    task.demonstrations.save(folder / "demonstrations.csv")
    head = {
        "schema_version": SCHEMA_VERSION,
        "name": task.name,
        "n_states": task.n_states,
        "n_actions": task.n_actions,
        "goal_states": task.goal_states.tolist(),
        "start_states": task.start_states.tolist(),
        "gamma": task.gamma,
        "fixed_vr": {str(state): value for state, value in task.fixed_vr.items()},
        "generalisation_rules": g.rule_names,
        "provenance": task.provenance,
        "files": {file: sha256(folder / file) for file in FILES},
    }
    write_json(folder / "task.json", head)


def load_task(folder: Path) -> TaskData:
    """Read a task data directory and check all of it.

    Raises:
        InputError: if the folder or a file is missing, damaged or not the one ``task.json``
            records, or a field is missing, unknown or invalid; the line names file and field.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: no such task data directory")
    head = _read_head(folder / "task.json")
    for file in FILES:
        if not (folder / file).is_file():
            raise InputError(f"{folder / file}: no such file, though task.json records it")
        if sha256(folder / file) != head["files"][file]:
            raise InputError(
                f"{folder / file}: not the file that task.json records (its SHA-256 differs); "
                "restore it, or export the task anew"
            )
    transitions = _read_columns(folder / "transitions.npz", [f.name for f in fields(Transitions)])
    groups = _read_columns(folder / "generalisation.npz", ["state", "action", "group", "rule"])
    preferences = _read_sets(folder / "state_preferences.json")
    _same_names(folder / "state_preferences.json", preferences, ["preferred", "avoided"])
    states = _read_rows(folder / "states.csv", head["n_states"])
    actions = _read_rows(folder / "actions.csv", head["n_actions"])
    clusters = _read_sets(folder / "clusters.json")
    demonstrations = Demonstrations.load(folder / "demonstrations.csv")
    features = read_npz(folder / "features.npz")
    try:
        return TaskData(
            name=head["name"],
            states=states,
            actions=actions,
            transitions=Transitions(**transitions),
            goal_states=head["goal_states"],
            start_states=head["start_states"],
            gamma=head["gamma"],
            features=features,
            clusters=clusters,
            preferred=preferences["preferred"],
            avoided=preferences["avoided"],
            generalisation=Generalisation(**groups, rule_names=head["generalisation_rules"]),
            demonstrations=demonstrations,
            fixed_vr=head["fixed_vr"],
            provenance=head["provenance"],
            task_hash=sha256(folder / "task.json"),
        )
    except InputError as error:
        # The task knows its files by name only.
        raise InputError(f"{folder}/{error}") from None


def _read_head(path: Path) -> dict[str, Any]:
    """Read ``task.json``, its fields checked and converted."""
    head: dict[str, Any] = {"fixed_vr": {}, "generalisation_rules": [], **_read_object(path)}
    # Asked first: of another version the other fields are unknown.
    version = head.get("schema_version")
    if type(version) is not int or version != SCHEMA_VERSION:
        raise InputError(
            f"{path}: field 'schema_version' is {version!r:.40}; supported: {SCHEMA_VERSION}"
        )
    _same_names(path, head, [*_REQUIRED, *_OPTIONAL])
    for name, kind in (_REQUIRED | _OPTIONAL).items():
        value = head[name]
        right = isinstance(value, (int, float) if kind is float else kind)
        if not right or isinstance(value, bool):
            raise InputError(f"{path}: field '{name}' must be {_KINDS[kind]}, is {value!r:.60}")
    _same_names(path, head["files"], FILES, "field 'files'")
    if not all(isinstance(rule, str) for rule in head["generalisation_rules"]):
        raise InputError(f"{path}: field 'generalisation_rules' must be a list of names")
    for name in ("goal_states", "start_states"):
        head[name] = _indices(path, name, head[name])
    fixed = {}
    for state, value in head["fixed_vr"].items():
        number = type(value) in (int, float) and abs(value) < 1e300
        index = state.isascii() and state.isdigit() and len(state) < 19
        if not (number and index and state == str(int(state))):  # "01" would be "1" once more
            raise InputError(
                f"{path}: field 'fixed_vr' must give numbers to state indices, "
                f"gives {value!r:.40} to {state!r:.40}"
            )
        fixed[int(state)] = float(value)
    return head | {"fixed_vr": fixed}


def _read_object(path: Path) -> dict[str, Any]:
    value = read_json(path)
    if not isinstance(value, dict):
        raise InputError(f"{path}: must hold a JSON object, holds {type(value).__name__}")
    return value


def _same_names(path: Path, found: Any, wanted: Any, place: str = "field") -> None:
    for name in wanted:
        if name not in found:
            raise InputError(f"{path}: {place} '{name}' is missing")
    for name in found:
        if name not in wanted:
            raise InputError(f"{path}: {place} {name!r} is unknown; valid: {', '.join(wanted)}")


def _indices(path: Path, name: str, values: Any) -> np.ndarray:
    # NumPy would cut 1.5 to 1 and take true for 1, so types are asked one by one.
    if not isinstance(values, list) or any(type(value) is not int for value in values):
        raise InputError(f"{path}: field {name!r} must be a list of integers")
    try:
        return np.array(values, dtype=np.int64)
    except OverflowError:
        raise InputError(f"{path}: field {name!r} holds an integer out of range") from None


def _read_sets(path: Path) -> dict[str, np.ndarray]:
    return {name: _indices(path, name, values) for name, values in _read_object(path).items()}


def _read_columns(path: Path, names: list[str]) -> dict[str, np.ndarray]:
    columns = read_npz(path)
    _same_names(path, columns, names)
    return columns


def _read_rows(path: Path, n: int) -> list[dict[str, str]]:
    header, rows = read_csv(path)
    if header[0] != "index":
        raise InputError(f"{path}: the first column must be 'index', is {header[0]!r}")
    if len(rows) != n:
        raise InputError(f"{path}: {len(rows)} rows, but task.json counts {n}")
    for number, row in enumerate(rows):
        if row[0] != str(number):
            raise InputError(f"{path}: row {number}, field 'index' must be {number}, is {row[0]!r}")
    return [dict(zip(header[1:], row[1:], strict=True)) for row in rows]
