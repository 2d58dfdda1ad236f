"""What a file says, as named values: all that counts in it, and nothing that does not.

How hard a zip was pressed does not count, nor which work a checkpoint belongs to (it is refused by
that name if it is another), nor which model files a map was made from (likewise).
"""

import json
import re
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from irl.npz import read_npz
from irl.tensor_file import from_bytes

Content = dict[str, Any]

_INCIDENTAL = re.compile(r"task\.json: files\..*|.*: checkpoint\.(content\.identity\..*|digest)")
_MODEL_FILES = re.compile(r"(?<=model files )[0-9a-f]{64}")


def content(folder: Path) -> Content:
    """Every value in the files of a folder, by file and place."""
    found: Content = {}
    for path in sorted(folder.iterdir()):
        read = _READERS.get(path.suffix, _tensors)
        found |= {f"{path.name}: {place}": value for place, value in read(path).items()}
    return {place: value for place, value in found.items() if not _INCIDENTAL.fullmatch(place)}


def differences(found: Content, wanted: Content) -> list[str]:
    """Where two contents differ; trained numbers may, by what processors and libraries do."""
    pairs = {place: (found.get(place), wanted.get(place)) for place in (*found, *wanted)}
    return [
        f"{place}: {one!r:.80} instead of {other!r:.80}"
        for place, (one, other) in pairs.items()
        if not _alike(one, other)
    ]


def _alike(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        if (one.dtype, one.shape) != (other.dtype, other.shape):
            return False
        if one.dtype.kind == "f":
            return bool(np.allclose(one, other, rtol=1e-5, atol=1e-7, equal_nan=True))
        return bool((one == other).all())
    return type(one) is type(other) and one == other


def _flat(value: Any, place: str = "") -> Content:
    """A JSON value: objects by path, lists and plain values as they are."""
    if isinstance(value, str) and value.startswith("{"):  # JSON within JSON
        value = json.loads(value)
    if not isinstance(value, dict):
        return {place: value}
    named = [_flat(item, f"{place}.{name}" if place else name) for name, item in value.items()]
    return {name: item for part in named for name, item in part.items()}


def _tensors(path: Path) -> Content:
    arrays, metadata = from_bytes(path.read_bytes())
    return {**arrays, **_flat(metadata)}


def _json(path: Path) -> Content:
    return _flat(json.loads(path.read_text(encoding="utf-8")))


def _csv(path: Path) -> Content:
    lines = path.read_text(encoding="utf-8").splitlines()
    return {f"line {n}": _MODEL_FILES.sub("…", line) for n, line in enumerate(lines, start=1)}


def _npz(path: Path) -> Content:
    hashes = {"model_files", "map_sha256"}
    return {name: a.dtype if name in hashes else a for name, a in read_npz(path).items()}


def _database(path: Path) -> Content:
    with closing(
        sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
    ) as db:
        found = {"version": db.execute("PRAGMA user_version").fetchone()}
        for (table,) in db.execute(
            "SELECT name FROM sqlite_master WHERE type = 'table'"
        ).fetchall():
            columns = db.execute(f"PRAGMA table_info({table})").fetchall()
            rows = db.execute(f"SELECT * FROM {table}").fetchall()
            for number, name, *kind in columns:
                found[f"{table}.{name}"] = (kind, [row[number] for row in rows])
    return found


_READERS = {".npz": _npz, ".json": _json, ".csv": _csv, ".db": _database}
