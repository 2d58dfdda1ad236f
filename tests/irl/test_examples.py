"""The examples that a reader copies: the README's Python, and the package's docstring."""

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


def section(title: str) -> str:
    """All Python of one section of the README, in order."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (body,) = re.findall(rf"^## {title}\n(.*?)(?=^## |\Z)", text, re.DOTALL | re.MULTILINE)
    blocks = re.findall(r"^```python\n(.*?)^```", body, re.DOTALL | re.MULTILINE)
    assert blocks
    return "\n".join(blocks)


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


def test_a_task_of_ones_own(tmp_path):
    printed = run(section("Bring your own task"), tmp_path)
    lines = {line.split()[0]: float(line.split()[1].rstrip("%")) for line in printed.splitlines()}
    assert lines.keys() == METHODS.keys()
    # Within 20 actions the demonstrator's own share is 95 %, and acting at random makes 5 %.
    assert min(lines.values()) > 50
    assert lines["fa_mlirl"] > 85
    assert (tmp_path / "workshop/task.json").is_file()


def test_gymnasium_in_the_readme(tmp_path):
    pytest.importorskip("gymnasium")
    printed = run(section("Use the learning library alone"), tmp_path)
    assert printed.startswith("-13.0 ")


def test_every_python_block_is_run_here():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    sections = ("Bring your own task", "Use the learning library alone")
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    assert "\n".join(blocks) == "\n".join(section(title) for title in sections)
