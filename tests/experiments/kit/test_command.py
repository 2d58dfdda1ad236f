import json
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import yaml
from matplotlib.image import imread

from experiments.kit.command import Output, execute
from irl.errors import InputError


@dataclass(frozen=True)
class Config:
    """A command for tests."""

    size: int = 3
    """A number."""
    shape: Literal["round", "square"] = "round"
    """One of two words."""
    out: Path = Path("out")
    """Folder of the results."""


def succeed(config, output):
    with output.file("table.csv") as path:
        path.write_text("a\n")
    return {"size": np.int64(config.size), "values": np.arange(2)}


def fail(config, output):
    raise InputError("task.json: field 'gamma' is -1; wanted 0 to 1")


def test_leaves_the_effective_configuration_and_the_result(tmp_path):
    execute(Config, succeed, ["--size", "5", "--out", str(tmp_path / "a/b")])
    folder = tmp_path / "a/b"
    assert yaml.safe_load((folder / "config.yaml").read_text()) == {
        "size": 5,
        "shape": "round",
        "out": str(folder),
    }
    assert json.loads((folder / "result.json").read_text()) == {"size": 5, "values": [0, 1]}
    assert sorted(p.name for p in folder.iterdir()) == ["config.yaml", "result.json", "table.csv"]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--sise", "5"], ["--sise", "--size"]),
        (["--size", "five"], ["size", "five"]),
        (["--shape", "oval"], ["oval", "round", "square"]),
    ],
)
def test_a_bad_option_is_one_line_with_the_valid_choices(tmp_path, capsys, arguments, named):
    with pytest.raises(SystemExit) as stop:
        execute(Config, succeed, [*arguments, "--out", str(tmp_path / "out")])
    assert stop.value.code == 2
    message = capsys.readouterr().err.strip()
    assert "\n" not in message
    assert message.startswith("error: ")
    assert all(word in message for word in named)
    assert not (tmp_path / "out").exists()


def test_bad_input_leaves_nothing_behind(tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        execute(Config, fail, ["--out", str(tmp_path / "new/out")])
    assert stop.value.code == 2
    assert capsys.readouterr().err == "error: task.json: field 'gamma' is -1; wanted 0 to 1\n"
    assert list(tmp_path.iterdir()) == []


def test_an_unwritable_folder_is_found_before_any_work(tmp_path, capsys):
    blocker = tmp_path / "file"
    blocker.write_text("not a folder")
    worked = []
    with pytest.raises(SystemExit) as stop:
        execute(Config, lambda c, o: worked.append(1) or {}, ["--out", str(blocker / "out")])
    assert stop.value.code == 2
    assert not worked
    message = capsys.readouterr().err
    assert "--out" in message
    assert message.count("\n") == 1


def test_a_file_is_whole_or_absent(tmp_path):
    output = Output(tmp_path, None)
    with pytest.raises(RuntimeError), output.file("plot.png") as path:
        path.write_text("half")
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


def test_a_figure_is_saved_and_needs_no_display(tmp_path):
    with Output(tmp_path, None).figure("plot.png") as figure:
        figure.set_size_inches(3, 2)
        figure.subplots().plot([0, 1])
    assert [path.name for path in tmp_path.iterdir()] == ["plot.png"]
    assert imread(tmp_path / "plot.png").shape[:2] == (240, 360)


def test_a_figure_that_fails_leaves_no_file(tmp_path):
    with pytest.raises(RuntimeError), Output(tmp_path, None).figure("plot.png"):
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["demo", "gridworld", "reachability", "simulate", "transitions"])
def test_every_command_explains_itself(command, name):
    shown = command(name, "--help")
    assert shown.returncode == 0
    assert shown.stdout.startswith(f"usage: python -m experiments.{name} ")
