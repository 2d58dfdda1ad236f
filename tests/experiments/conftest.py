"""Commands run as a person runs them, and their refusals."""

import subprocess
import sys
from pathlib import Path

import pytest

from experiments.kit.command import execute

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def command():
    """``command("gridworld", "--sizes", 5)`` runs the program, and gives what it said."""

    def run(name, *arguments):
        return subprocess.run(
            [sys.executable, "-m", f"experiments.{name}", *map(str, arguments)],
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
        )

    return run


@pytest.fixture
def refused(capsys, tmp_path):
    """``refused(story, "--sizes", 8)`` runs it here; gives the one line that it ends in.

    A refusal says nothing else, and leaves no folder behind.
    """

    def run(story, *arguments):
        out = tmp_path / "refused"
        with pytest.raises(SystemExit) as stop:
            given = [*map(str, arguments)]
            elsewhere = [] if "--out" in given else ["--out", str(out)]
            execute(story.Config, story.main, [*given, *elsewhere])
        said = capsys.readouterr()
        assert stop.value.code == 2
        assert said.out == ""
        assert said.err.startswith("error: ")
        assert said.err.count("\n") == 1
        assert not out.exists()
        return said.err.strip()

    return run
