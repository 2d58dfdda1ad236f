"""The reachability command on a tiny workspace, as a person runs it: killed, resumed, changed."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from experiments.reachability import story, workspace_run
from experiments.reachability.workspace_run import Plan, compute, read_map, write_map
from irl.errors import InputError
from irl.npz import read_npz, write_npz
from models.errors import ModelError
from models.maps.workspace import Grid

GRID = Grid((0.4, -0.1, 0.5), (0.7, 0.1, 0.6), 0.1)
PLAN = Plan(GRID, chunk=100)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    the_map, _ = compute(PLAN, folder / "chunks", workers=1)
    write_map(the_map, PLAN.margin, folder / "map.npz")
    return (folder / "map.npz").read_bytes()


def test_command_leaves_map_pictures_and_result(tmp_path, command):
    done = command(
        "reachability", "--grid", "workspace", "--audit", 10, "--spacing", 0.1,
        "--low", 0.4, -0.1, 0.5, "--high", 0.7, 0.1, 0.6, "--out", tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {
        *("config.yaml", "result.json", "map.csv"),
        *("workspace.npz", "workspace.png", "workspace.html"),
    }
    result = json.loads((tmp_path / "result.json").read_text())
    the_map = read_map(tmp_path / "workspace.npz")
    assert result["total"] == GRID.total == sum(result["failures"].values()) + result["reachable"]
    assert result["reachable"] == the_map.reachable.sum() == sum(result["by_orientation"].values())
    assert result["solves_per_s"] > 0
    assert result["audit"]["rejected"] == result["audit"]["missed"] == 0


RUN = """
import sys, time
from pathlib import Path
from experiments.reachability import story, workspace_run
from models.maps.workspace import Grid

decide = workspace_run.decide_chunk
def slowly(*arguments):
    time.sleep(0.3)
    return decide(*arguments)

if __name__ == "__main__":
    workspace_run.decide_chunk = slowly
    plan = workspace_run.Plan(Grid((0.4, -0.1, 0.5), (0.7, 0.1, 0.6), 0.1), chunk=100)
    workspace_run.compute(plan, Path(sys.argv[1]), 1)
"""


def test_a_killed_run_resumes_to_the_same_bytes_with_any_number_of_workers(tmp_path, whole):
    chunks = tmp_path / "chunks"
    process = subprocess.Popen([sys.executable, "-c", RUN, str(chunks)], stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 120
    while not list(chunks.glob("[0-9]*.npz")) and time.monotonic() < deadline:
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    kept = {path.name: path.stat().st_mtime_ns for path in chunks.glob("[0-9]*.npz")}
    assert 0 < len(kept) < len(PLAN.spans())

    the_map, _ = compute(PLAN, chunks, workers=2)
    write_map(the_map, PLAN.margin, tmp_path / "map.npz")
    assert (tmp_path / "map.npz").read_bytes() == whole
    # What was there was not done again.
    assert {name: (chunks / name).stat().st_mtime_ns for name in kept} == kept


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"grid": Grid(GRID.low, GRID.high, 0.05)}, "spacing"),
        ({"margin": 0.004}, "margin"),
        ({}, "model_files"),
    ],
)
def test_another_plan_or_model_is_not_resumed(tmp_path, monkeypatch, change, field):
    workspace_run._open(PLAN, tmp_path)
    workspace_run._open(PLAN, tmp_path)
    if not change:
        monkeypatch.setattr(workspace_run, "description_hash", lambda: "0" * 64)
    other = Plan(**{"grid": GRID, "chunk": 100, **change})
    with pytest.raises(InputError, match=rf"run.json: kept by other work.* {field} "):
        compute(other, tmp_path, workers=1)


def test_a_map_of_other_models_or_with_a_field_missing_is_refused(tmp_path, whole):
    path = tmp_path / "map.npz"
    path.write_bytes(whole)
    arrays = read_npz(path)
    write_npz(path, {**arrays, "model_files": np.array("0" * 64)})
    with pytest.raises(ModelError, match="model_files"):
        read_map(path)
    del arrays["q"]
    write_npz(path, arrays)
    with pytest.raises(InputError, match="field 'q' is missing"):
        read_map(path)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--workers", "0"], "--workers"),
        (["--margin", "0.5"], "--margin"),
        (["--audit", "-1"], "--audit"),
        (["--spacing", "0"], "--spacing"),
        (["--low", "2", "0", "0"], "--low"),
    ],
)
def test_mistakes_are_told_in_one_line_and_leave_nothing(refused, arguments, word):
    assert word in refused(story, "--grid", "workspace", *arguments)
