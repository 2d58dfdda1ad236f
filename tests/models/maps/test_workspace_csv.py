"""The workspace map's CSV file says what the map says, row by row."""

import csv

import numpy as np
import pytest

from models.errors import ModelError
from models.inverse_kinematics.solution import Failure
from models.maps import reachability_csv
from models.maps.workspace import FAILURES, REACHABLE, Decisions, Grid
from models.maps.workspace_csv import COLUMNS, write_map
from models.maps.workspace_map import WorkspaceMap
from models.scenes.parsing import description_hash
from models.scenes.planning_scene import MARGIN
from models.task.spaces import GRIPPER_ANGLES

GRID = Grid((0.3, -0.1, 0.525), (0.4, 0.1, 0.625), 0.1)


@pytest.fixture(scope="module")
def the_map():
    """Every reason in turn, random numbers for the reachable poses."""
    rng = np.random.default_rng(0)
    reason = (np.arange(GRID.total) % (1 + len(FAILURES))).astype(np.uint8)
    count = (reason == REACHABLE).sum()
    q = rng.uniform(-np.pi, np.pi, (count, 7)).astype(np.float32)
    q[0] = 1e-6 * q[0]
    return WorkspaceMap(GRID, Decisions(reason, q, rng.uniform(0, 0.02, count).astype(np.float32)))


def test_every_row_is_the_maps_entry(the_map, tmp_path):
    path = tmp_path / "map.csv"
    write_map(the_map, MARGIN, path)
    title, *lines = path.read_text().splitlines()
    assert title.endswith(f"model files {description_hash()}")
    for words in ("low 0.3 -0.1 0.525", "high 0.4 0.1 0.625", "spacing 0.1", f"margin {MARGIN}"):
        assert words in title
    rows = list(csv.DictReader(lines))
    assert tuple(rows[0]) == COLUMNS
    assert set(COLUMNS) < set(reachability_csv.COLUMNS)
    p_WG, gripper = GRID.poses(0, GRID.total)
    for row, p, g in zip(rows, p_WG, gripper, strict=True):
        entry = the_map.find(p, int(g))
        assert [float(row[name]) for name in "xyz"] == p.tolist()
        angles = [float(row[name]) for name in ("roll", "pitch", "yaw")]
        assert (int(row["gripper"]), angles) == (g, list(GRIPPER_ANGLES[g]))
        numbers = [row[name] for name in (*reachability_csv.JOINTS, "clearance")]
        if entry.failure is None:
            assert (row["value"], row["failure"]) == ("1", "")
            np.testing.assert_array_equal(np.float32(numbers), [*entry.q, entry.clearance])
        else:
            assert (row["value"], Failure(row["failure"])) == ("0", entry.failure)
            assert set(numbers) == {""}


def test_it_is_not_taken_for_the_tasks_map(the_map, tmp_path):
    path = tmp_path / "map.csv"
    write_map(the_map, MARGIN, path)
    with pytest.raises(ModelError, match="line 1"):
        reachability_csv.read_map(path)
