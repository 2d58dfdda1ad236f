"""The page that shows the station to whoever builds on it: its table of ports, its examples."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.systems.framework import PortDataType

import diagrams
from diagrams.station import Station
from models.scenes.planning_scene import HOME

ROOT = Path(__file__).resolve().parents[2]
PAGE = (Path(diagrams.__file__).parent / "station.md").read_text(encoding="utf-8")
START = RigidTransform([0.5, 0.0, 0.52])


@pytest.fixture(scope="module")
def station():
    return Station()


def ports(station):
    """Name → (in or out, type) of every port there is, as the page writes it."""
    root = station.CreateDefaultContext()
    station.initialize(root, X_WO=START)
    station.GetInputPort("arm.position_command").FixValue(root, HOME)
    station.GetInputPort("gripper.position_command").FixValue(root, [0.085])
    nothing = Value[list[ExternallyAppliedSpatialForce]]()
    station.GetInputPort("spatial_forces").FixValue(root, nothing)

    def kind(port):
        if port.get_data_type() == PortDataType.kVectorValued:
            return f"vector of {port.size()}"
        return type(port.Eval(root)).__name__.rstrip("_")

    inputs = [station.get_input_port(i) for i in range(station.num_input_ports())]
    outputs = [station.get_output_port(i) for i in range(station.num_output_ports())]
    return {
        **{port.get_name(): ("in", kind(port)) for port in inputs},
        **{port.get_name(): ("out", kind(port)) for port in outputs},
    }


def test_the_table_of_ports_is_that_of_the_station(station):
    rows = re.findall(r"^\| `([\w.]+)` \| (in|out) \| ([\w ]+) \| (.+) \|$", PAGE, re.MULTILINE)
    assert {name: (way, kind) for name, way, kind, _ in rows} == ports(station)
    # Units stand beside whatever has one.
    unitless = {"arm.limited_samples", "task.state", "query_object"}
    assert {name for name, *_, text in rows if not re.search(r"\[[\w/ ,]+\]", text)} == unitless


def test_the_docstring_draws_every_port(station):
    for name in ports(station):
        assert re.search(rf"(?<![\w.]){re.escape(name)}(?![\w.])", Station.__doc__), name


def example(section, folder):
    """What the examples print, up to the end of one section, as a program of its own."""
    until = PAGE.index(f"## {section}")
    until += re.search(r"^```\n", PAGE[until:], re.MULTILINE).end()
    blocks = re.findall(r"^```python\n(.*?)^```", PAGE[:until], re.DOTALL | re.MULTILINE)
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(blocks)],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_the_examples_run(tmp_path):
    grasped, picture, hand = example("Sliders", tmp_path)
    held, newton_metres = re.fullmatch(r"held: (\w+) - joint 2 carries (\S+) N m", grasped).groups()
    assert held == "True"
    assert 15.0 < float(newton_metres) < 39.0
    assert picture == "the picture is (270, 480, 4) uint8"
    assert hand == "the hand is at [0.45, 0.0, 0.7]"
    assert list(tmp_path.iterdir()) == []
