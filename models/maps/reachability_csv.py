"""The reachability map as a CSV file, in the manner of the thesis (5.8).

The first line names the model files from which the map was computed and its seed; a map made
from others is refused. Then one row a pose: position [m], roll, pitch, yaw of Table 4.2
[degrees], gripper orientation, what the pose is for, 1 or 0, joint angles [rad], clearance [m]
with the two bodies, the failure, and the starting points tried. What does not apply is empty.
"""

import csv
import io
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np

from models.errors import ModelError
from models.inverse_kinematics.solution import Failure
from models.maps.gripper_poses import Layer, pose_key
from models.maps.pose_solver import Entry
from models.maps.reachability import ReachabilityMap
from models.scenes.parsing import description_hash
from models.scenes.planning_scene import Clearance
from models.task.spaces import GRIPPER_ANGLES, N_GRIPPERS
from models.texts import read_text

T = TypeVar("T")

JOINTS = tuple(f"q{i}" for i in range(1, 8))
COLUMNS = (
    *("x", "y", "z", "roll", "pitch", "yaw", "gripper", "layer", "value", *JOINTS),
    *("clearance", "body_a", "body_b", "failure", "attempts"),
)
_TITLE = "# reachability map"


def write_map(reachability: ReachabilityMap, path: Path) -> None:
    """Write a map; reading it gives the same numbers to the last bit."""
    text = io.StringIO()
    text.write(f"{_TITLE}, seed {reachability.seed}, model files {description_hash()}\n")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    table.writerows(_row(entry) for entry in reachability.entries)
    path.write_text(text.getvalue(), encoding="utf-8")


def read_map(path: Path) -> ReachabilityMap:
    """Read a map that `write_map` wrote.

    Raises:
        ModelError: if the file is missing, malformed, or made from other model files.
    """
    lines = read_text(path, "a reachability map").splitlines()
    seed = _check_title(path, lines[0] if lines else "")
    rows = list(csv.reader(lines[1:]))
    if not rows or tuple(rows[0]) != COLUMNS:
        raise ModelError(f"{path}, line 2: valid columns: {','.join(COLUMNS)}")
    reachability = ReachabilityMap(seed=seed)
    for number, row in enumerate(rows[1:], start=3):
        entry = _entry(row, f"{path}, line {number}")
        if reachability.find(entry.p_WG, entry.gripper) is not None:
            raise ModelError(f"{path}, line {number}, x: this pose occurs before; valid: once each")
        reachability.add(entry)
    return reachability


def _check_title(path: Path, line: str) -> int:
    """The seed, from a first line that names the present model files."""
    parts = [part.split() for part in line.split(",")]
    if not line.startswith(_TITLE) or [len(part) for part in parts] != [3, 2, 3]:
        raise ModelError(f"{path}, line 1: valid: '{_TITLE}, seed N, model files SHA-256'")
    if parts[2][2] != description_hash():
        raise ModelError(
            f"{path}, line 1, model files: {parts[2][2][:12]}… are not the present ones; "
            f"valid: {description_hash()[:12]}… - build the map again"
        )
    return _parse(int, parts[1][1], f"{path}, line 1, seed", "an integer")


def _row(entry: Entry) -> list[str]:
    clearance = entry.clearance or Clearance(np.nan, None)
    return [
        *(repr(value) for value in entry.p_WG.tolist()),
        *(f"{angle:g}" for angle in GRIPPER_ANGLES[entry.gripper]),
        *(str(entry.gripper), entry.layer.value, str(entry.value)),
        *([""] * 7 if entry.q is None else map(repr, entry.q.tolist())),
        "" if entry.clearance is None else repr(float(clearance.distance)),
        *(clearance.bodies or ("", "")),
        *("" if entry.failure is None else entry.failure.value, str(entry.attempts)),
    ]


def _entry(row: list[str], where: str) -> Entry:
    if len(row) != len(COLUMNS):
        raise ModelError(f"{where}: {len(row)} fields; valid: {len(COLUMNS)}")
    fields = dict(zip(COLUMNS, row, strict=True))

    def parse(name: str, convert: Callable[[str], T], valid: str) -> T:
        return _parse(convert, fields[name], f"{where}, {name}", valid)

    p_WG = np.array([parse(name, _finite, "metres") for name in "xyz"])
    gripper = parse("gripper", int, f"0…{N_GRIPPERS - 1}")
    try:
        pose_key(p_WG, gripper)
    except ModelError as error:
        raise ModelError(f"{where}, gripper: {error}") from None
    for name, angle in zip(("roll", "pitch", "yaw"), GRIPPER_ANGLES[gripper], strict=True):
        if parse(name, _finite, "degrees") != angle:
            raise ModelError(f"{where}, {name}: {fields[name]}; valid for {gripper}: {angle:g}")
    layer = parse("layer", Layer, ", ".join(Layer))
    value = parse("value", int, "0, 1")
    q = failure = clearance = None
    if value == 1:
        q = np.array([parse(name, _finite, "radians") for name in JOINTS])
    elif value == 0:
        failure = parse("failure", Failure, ", ".join(Failure))
    else:
        raise ModelError(f"{where}, value: {value}; valid: 0, 1")
    if fields["clearance"]:
        bodies = (fields["body_a"], fields["body_b"])
        distance = parse("clearance", _finite, "metres")
        clearance = Clearance(distance, bodies if all(bodies) else None)
    attempts = parse("attempts", int, "an integer")
    return Entry(layer, p_WG, gripper, q, clearance, failure, attempts)


def _finite(text: str) -> float:
    value = float(text)
    if not np.isfinite(value):
        raise ValueError(text)
    return value


def _parse(convert: Callable[[str], T], text: str, where: str, valid: str) -> T:
    try:
        return convert(text)
    except ValueError:
        raise ModelError(f"{where}: '{text}'; valid: {valid}") from None
