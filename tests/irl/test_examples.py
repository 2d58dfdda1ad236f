"""The examples that a reader copies: Python in the README and in pages, and irl's docstring."""

import doctest
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import irl
from irl.methods import METHODS

ROOT = Path(__file__).resolve().parents[2]


def blocks(page: str, section: str | None = None) -> str:
    """All Python of a page, or of one section of it, in order."""
    body = (ROOT / page).read_text(encoding="utf-8")
    if section is not None:
        found = re.findall(rf"^## {section}\n(.*?)(?=^## |\Z)", body, re.DOTALL | re.MULTILINE)
        (body,) = found
    python = re.findall(r"^```python\n(.*?)^```", body, re.DOTALL | re.MULTILINE)
    assert python
    return "\n".join(python)


def run(code: str, folder: Path) -> str:
    """What ``code`` prints, run as a program of its own in ``folder``."""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_packages_own_example():
    found = doctest.testmod(irl)
    assert found.attempted >= 10
    assert found.failed == 0


def test_the_method_in_ten_lines():
    code = blocks("README.md", "The method")
    assert len(code.partition("\n\nrng = ")[2].splitlines()) == 10
    # It names the shipped task by its place in a checkout, and leaves nothing there.
    assert float(run(code, ROOT)) > 0.97
    assert "within 20 actions, 1.0." in (ROOT / "README.md").read_text(encoding="utf-8")


def test_a_task_of_ones_own(tmp_path):
    printed = run(blocks("experiments/own_task.md"), tmp_path)
    cells = [line.replace("%", "").split() for line in printed.splitlines()]
    lines = {name: float(success) for name, success, *_ in cells}
    brittle = {name: float(success) for name, _, success, *_ in cells}
    assert lines.keys() == METHODS.keys()
    # Within 20 actions the demonstrator's own share is 95 %, and acting at random makes 5 %.
    assert min(lines.values()) > 50
    assert lines["fa_mlirl"] > 85
    # As the page says: copied choices are best where nothing changes, and worst where they do.
    assert lines["behaviour_cloning"] == max(lines.values())
    assert brittle["behaviour_cloning"] == min(brittle.values()) < 10
    assert brittle["planning"] > 90
    assert (tmp_path / "workshop/task.json").is_file()


def test_demonstrations_of_ones_own(tmp_path):
    printed = run(blocks("experiments/own_data.md"), tmp_path)
    action, inferred, priced, value, soft_regret, difference = printed.splitlines()
    assert action == inferred == "[1 1 1 2 0 0]"
    left, right, stay = map(float, priced.strip("[]").split())
    assert left == right < stay
    # 1 on entering room 3 and on every stay there, at a discount of 0.9: 1 / 0.1 from beside it.
    assert [float(number) for number in value.strip("[]").split()] == [8.1, 9, 10, 10, 10, 9]
    assert all(0 < float(number) < 0.5 for number in soft_regret.strip("[]").split())
    assert float(difference) == 0


def test_gymnasium_in_the_readme(tmp_path):
    pytest.importorskip("gymnasium")
    printed = run(blocks("README.md", "Use the learning library alone"), tmp_path)
    assert printed.startswith("-13.0 ")


def test_every_python_block_of_the_readme_is_run_here():
    # The robot's by tests/models/test_front_door.py.
    sections = ("The method", "Use the robot alone", "Use the learning library alone")
    assert blocks("README.md") == "\n".join(blocks("README.md", title) for title in sections)


def test_one_minute_of_teaching(tmp_path):
    found, asked = run(blocks("experiments/grasping.md"), tmp_path).splitlines()
    assert "carpet" in found
    assert asked.startswith("ask about")
