"""The workspace map as a CSV file, in the manner of `reachability_csv`; to be read, not resumed.

The first line names the grid [m], the margin [m] and the model files. Then one row a pose, in the
grid's order: position [m], roll, pitch, yaw of Table 4.2 [degrees], gripper orientation, 1 or 0,
joint angles [rad], clearance [m], `CLEARANCE_LIMIT` standing for any larger one, and the failure.
What does not apply is empty. Joint angles and clearance have single precision; their text gives
the same numbers to the last bit.
"""

from pathlib import Path

import numpy as np

from models.maps.reachability_csv import JOINTS
from models.maps.workspace import FAILURES, REACHABLE
from models.maps.workspace_map import WorkspaceMap
from models.scenes.parsing import description_hash
from models.task.spaces import GRIPPER_ANGLES, N_GRIPPERS

COLUMNS = (
    *("x", "y", "z", "roll", "pitch", "yaw", "gripper", "value", *JOINTS),
    *("clearance", "failure"),
)


def write_map(the_map: WorkspaceMap, margin: float, path: Path) -> None:
    """Write a map made with a ``margin`` [m]; equal maps are equal bytes."""
    grid, decisions = the_map.grid, the_map.decisions
    title = (
        f"# workspace map, low {_words(grid.low)}, high {_words(grid.high)}, "
        f"spacing {grid.spacing!r}, margin {margin!r}, model files {description_hash()}"
    )
    # What differs from row to row is formatted by column, the rest once.
    x, y, z = (axis.astype(str).tolist() for axis in grid.axes())
    places = (f"{a},{b},{c}" for a in x for b in y for c in z)
    angles = [
        ",".join(f"{angle:g}" for angle in GRIPPER_ANGLES[gripper]) + f",{gripper}"
        for gripper in range(N_GRIPPERS)
    ]
    refused = [f"0,{',' * len(JOINTS)},{failure}" for failure in FAILURES]
    found = np.column_stack([decisions.q, decisions.clearance]).astype(str)
    solved = (f"1,{','.join(row)}," for row in found.tolist())
    answers = iter(
        next(solved) if reason == REACHABLE else refused[reason - 1]
        for reason in decisions.reason.tolist()
    )
    rows = (f"{place},{angle},{next(answers)}" for place in places for angle in angles)
    path.write_text("\n".join([title, ",".join(COLUMNS), *rows, ""]), encoding="utf-8")


def _words(corner: tuple[float, float, float]) -> str:
    return " ".join(f"{coordinate!r}" for coordinate in corner)
