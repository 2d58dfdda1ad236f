"""The Gen3 Lite's reachability map as a CSV file; the Gen3's is in `reachability_csv`.

The first line names the model files from which the map was computed and its seed; a map made
from others is refused. Then one row a pose: position [m], roll, pitch, yaw of Table 4.2
[degrees], gripper orientation, value 0, 1 or 2, joint angles [rad], clearance [m] with the two
bodies, the failure, and how many solutions there are and respect the limits.
"""

import csv
import io
from pathlib import Path

import numpy as np

from models.errors import ModelError
from models.inverse_kinematics.solution import Failure
from models.maps.lite import NONE, VALUES, Entry
from models.scenes.parsing import description_hash
from models.scenes.planning_scene import Clearance
from models.scenes.robots import GEN3_LITE
from models.task.spaces import GRIPPER_ANGLES, N_GRIPPERS
from models.texts import read_text

JOINTS = tuple(f"q{i}" for i in range(1, 7))
COLUMNS = (
    *("x", "y", "z", "roll", "pitch", "yaw", "gripper", "value", *JOINTS),
    *("clearance", "body_a", "body_b", "failure", "solutions", "within_limits"),
)


def write_map(entries: list[Entry], seed: int, path: Path) -> None:
    """Write a map; reading it gives the same numbers to the last bit."""
    text = io.StringIO()
    text.write(_title(seed) + "\n")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    table.writerows(_row(entry) for entry in entries)
    path.write_text(text.getvalue(), encoding="utf-8")


def read_map(path: Path) -> list[Entry]:
    """Read a map that `write_map` wrote.

    Raises:
        ModelError: if the file is missing, malformed, or made from other model files.
    """
    title, *lines = read_text(path, "a reachability map").splitlines() or [""]
    if title.split(", ")[::2] != _title(0).split(", ")[::2]:
        raise ModelError(f"{path}, line 1: valid: '{_title(0)}', any seed - build the map again")
    rows = list(csv.reader(lines))
    if not rows or tuple(rows[0]) != COLUMNS:
        raise ModelError(f"{path}, line 2: valid columns: {','.join(COLUMNS)}")
    return [_entry(row, f"{path}, line {number}") for number, row in enumerate(rows[1:], start=3)]


def _title(seed: int) -> str:
    return f"# reachability map of gen3_lite, seed {seed}, model files " + description_hash(
        GEN3_LITE.files
    )


def _row(entry: Entry) -> list[str]:
    clearance = entry.clearance or Clearance(np.nan, None)
    return [
        *(repr(value) for value in entry.p_WG.tolist()),
        *(f"{angle:g}" for angle in GRIPPER_ANGLES[entry.gripper]),
        *(str(entry.gripper), str(entry.value)),
        *([""] * 6 if entry.q is None else map(repr, entry.q.tolist())),
        "" if entry.clearance is None else repr(float(clearance.distance)),
        *(clearance.bodies or ("", "")),
        "" if entry.failure is None else entry.failure.value,
        *(str(entry.solutions), str(entry.within_limits)),
    ]


def _entry(row: list[str], where: str) -> Entry:
    if len(row) != len(COLUMNS):
        raise ModelError(f"{where}: {len(row)} fields; valid: {len(COLUMNS)}")
    fields = dict(zip(COLUMNS, row, strict=True))

    def number(name: str) -> float:
        try:
            value = float(fields[name])
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            raise ModelError(f"{where}, {name}: '{fields[name]}'; valid: a finite number")
        return value

    def member(name: str, valid: range | tuple[int, ...]) -> int:
        if number(name) not in valid:
            raise ModelError(f"{where}, {name}: {fields[name]}; valid: {valid[0]}…{valid[-1]}")
        return int(number(name))

    gripper, value = member("gripper", range(N_GRIPPERS)), member("value", VALUES)
    q = clearance = failure = None
    if value == NONE:
        try:
            failure = Failure(fields["failure"])
        except ValueError:
            valid = ", ".join(Failure)
            raise ModelError(f"{where}, failure: '{fields['failure']}'; valid: {valid}") from None
    else:
        q = np.array([number(name) for name in JOINTS])
    if fields["clearance"]:
        bodies = (fields["body_a"], fields["body_b"])
        clearance = Clearance(number("clearance"), bodies if all(bodies) else None)
    p_WG = np.array([number(name) for name in "xyz"])
    counts = member("solutions", range(17)), member("within_limits", range(17))
    return Entry(p_WG, gripper, value, q, clearance, failure, *counts)
