"""What `models` hands on, and that its map of the rooms is the territory."""

import importlib
import pkgutil
import re
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

import models
from models import __main__ as visualizer
from models.maps.gripper_poses import gripper_pose

ROOT = Path(__file__).parents[2]


def run(*arguments, **options):
    return subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, check=True, **options
    )


def test_names_load_on_first_use_and_errors_stay_light():
    code = """
import sys
import models.errors
assert not {"numpy", "pydrake", "numba"} & set(sys.modules)
import models
assert models.ModelError is models.errors.ModelError
from models import *
for name in models.__all__:
    assert globals()[name] is getattr(models, name), name
"""
    run("-c", code, cwd=ROOT)


def test_each_name_comes_from_the_module_that_defines_it():
    for name in set(models.__all__) - {"HOME", "GEN3", "GEN3_LITE"}:
        assert getattr(models, name).__module__.startswith("models."), name
    assert set(models.__all__) <= set(dir(models))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        models.nothing  # noqa: B018 - the look-up is what is tested


def test_the_map_names_every_room_and_module():
    found = {module.name for module in pkgutil.iter_modules(models.__path__)} - {"__main__"}
    assert set(re.findall(r"`models\.(\w+)`", models.__doc__)) == found


def test_every_room_names_its_modules():
    for room in pkgutil.iter_modules(models.__path__):
        package = importlib.import_module(f"models.{room.name}")
        if room.ispkg:
            found = {module.name for module in pkgutil.iter_modules(package.__path__)}
            assert found <= set(re.findall(r"`(\w+)`", package.__doc__)), room.name


def test_the_example_runs():
    """As the docstring of `models` has it."""
    example = models.__doc__.split("For example::\n")[1].split("``python")[0]
    names = {"X_WG": gripper_pose(np.array([0.55, 0.1, 0.6]), 10)}
    exec(textwrap.dedent(example), names)
    assert names["path"].shape == (2, 7)
    assert names["motion"].end_time() > 0.5


def test_the_readmes_ten_lines_run():
    """From a pose to a timed motion, which ends where the hand was wanted."""
    page = (ROOT / "README.md").read_text(encoding="utf-8")
    section = page.partition("## Use the robot alone\n")[2].partition("\n## ")[0]
    (code,) = re.findall(r"^```python\n(.*?)^```", section, re.DOTALL | re.MULTILINE)
    assert len(re.findall(r"^\S", code, re.MULTILINE)) <= 10
    names = {}
    exec(code, names)
    scene, motion, X_WG = (names[name] for name in ("scene", "motion", "X_WG"))
    end = motion.value(motion.end_time()).ravel()
    assert scene.forward(end).IsNearlyEqualTo(X_WG, 1e-5)
    for t in np.linspace(0.0, motion.end_time(), 200):
        assert scene.is_free(motion.value(t).ravel())
    assert motion.value(0.0).ravel() == pytest.approx(models.HOME)


@pytest.mark.parametrize(("robot", "alone"), list(visualizer.SCENES))
def test_every_robot_opens(robot, alone):
    visualizer.main([robot, "--loop-once", *["--alone"] * alone])


def test_a_robot_opens_from_any_folder(tmp_path):
    done = run("-m", "models", "--loop-once", cwd=tmp_path, env={"PYTHONPATH": str(ROOT)})
    assert "http://localhost" in done.stdout + done.stderr


def test_another_robot_is_refused(capsys):
    with pytest.raises(SystemExit):
        visualizer.main(["gen4"])
    assert "'gen3'" in capsys.readouterr().err
