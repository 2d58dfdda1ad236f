"""The built wheel, in an environment of its own: what a reader pastes runs, in an empty folder."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.experiments.teach.page.conftest import Teaching, Window, chromium

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ("pyproject.toml", "README.md", "LICENSE", "irl", "models", "diagrams", "experiments")
# The blocks of a page go together, each in the README stands by itself.
PAGES = ("experiments/own_task.md", "experiments/own_data.md")

pytestmark = pytest.mark.soak


def blocks(page: str) -> list[str]:
    text = (ROOT / page).read_text(encoding="utf-8")
    return re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


EXAMPLES = {f"README.md, {n}": code for n, code in enumerate(blocks("README.md"), start=1)}
EXAMPLES |= {page: "\n".join(blocks(page)) for page in PAGES}
TABLE = (ROOT / "README.md").read_text(encoding="utf-8").split("| command | story |", 1)[-1]
FIRST_COLUMN = re.findall(r"^\| (`[^|]*) \|", TABLE.split("\n\n", 1)[0], re.MULTILINE)
COMMANDS = sorted(
    name
    for name in set(re.findall(r"`([a-z_]+)", " ".join(FIRST_COLUMN)))
    if (ROOT / f"experiments/{name}.py").exists() or (ROOT / "experiments" / name).is_dir()
)
TINY = [
    *("--learning.demonstrations", "60", "--learning.active.initial.iterations", "30"),
    *("--learning.active.refine.iterations", "5", "--learning.active.budget", "2"),
    *("--starts", "1", "--max-actions", "1"),
]


def call(*command: str | Path, folder: Path) -> str:
    """What a program prints, started in a folder, with no way to the checkout."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    done = subprocess.run(
        [*map(str, command)],
        cwd=folder,
        env=environment | {"OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
        timeout=900,
    )
    assert done.returncode == 0, f"{command}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}"
    return done.stdout


@pytest.fixture(scope="module")
def python(tmp_path_factory):
    """The interpreter of an environment that holds the wheel and what it needs, as pinned."""
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    source.mkdir()
    for name in SOURCES:
        one = ROOT / name
        leave = shutil.ignore_patterns("__pycache__")
        (
            shutil.copytree(one, source / name, ignore=leave)
            if one.is_dir()
            else shutil.copy(one, source)
        )
    call(sys.executable, "-m", "pip", "wheel", "--no-deps", "-w", folder, source, folder=folder)
    (wheel,) = folder.glob("active_advice_irl-*.whl")
    call(sys.executable, "-m", "venv", folder / "env", folder=folder)
    python = folder / "env/bin/python"
    pinned = ("-c", ROOT / "constraints.txt")
    call(python, "-m", "pip", "install", *pinned, f"{wheel}[gym,teach]", folder=folder)
    return python


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_pasted_into_an_empty_folder_runs(name, python, tmp_path):
    printed = call(python, "-c", EXAMPLES[name], folder=tmp_path)
    assert printed.strip()


def test_the_figures_that_the_readme_prints_come_out(python, tmp_path):
    (tmp_path / "one").mkdir()
    learnt = call(python, "-c", EXAMPLES["README.md, 1"], folder=tmp_path / "one")
    assert float(learnt) > 0.97
    assert not list((tmp_path / "one").iterdir())


def test_the_commands_of_the_readme_are_installed(python, tmp_path):
    assert len(COMMANDS) >= 10
    for name in COMMANDS:
        assert "usage" in call(python, "-m", f"experiments.{name}", "--help", folder=tmp_path)
    call(python, "-m", "experiments.tutorial", folder=tmp_path)
    call(python, "-m", "models", "gen3", "--export", "robot", folder=tmp_path)
    assert list((tmp_path / "robot").glob("*.urdf"))


def test_the_demo_learns_and_plays_outside_of_a_checkout(python, tmp_path):
    call(python, "-m", "experiments.demo", *TINY, folder=tmp_path)
    left = {path.name for path in (tmp_path / "out/demo").iterdir()}
    assert {"policy.safetensors", "result.json", "recording.html"} <= left


def test_the_page_teaches_the_robot_outside_of_a_checkout(python, tmp_path):
    with chromium() as browser:
        lesson = Teaching(tmp_path, python=python, root=tmp_path).start()
        one = Window(browser, lesson.url)
        one.page.frame_locator("iframe").locator("canvas").first.wait_for()
        one.press("ArrowRight")
        one.wait_for(
            "() => document.querySelector('[data-teach=question]').dataset.chosen !== undefined"
        )
        token = one.asked("token")
        one.press("Enter")
        one.wait_for_another(token)
        assert len(lesson.events("answered")) == 1
        assert not one.errors
        assert not one.abroad
        lesson.stop()
