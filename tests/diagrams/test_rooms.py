"""The front door of diagrams: a map that is complete, a light import, and trials that lead in."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import diagrams
import diagrams.falls
import diagrams.trials
from diagrams.station import Station

FOLDER = Path(diagrams.__file__).parent


@pytest.mark.parametrize(
    "package", [diagrams, diagrams.falls, diagrams.trials], ids=lambda p: p.__name__
)
def test_the_map_names_every_room_once(package):
    folder = Path(package.__file__).parent
    rooms = {path.stem for path in folder.iterdir() if path.suffix == ".py" or path.is_dir()}
    lines = [line for line in package.__doc__.splitlines() if line.startswith("* ")]
    named = [name for line in lines for name in re.findall(r"`(\w+)`", line.split(":")[0])]
    assert sorted(named) == sorted(rooms - {"__init__", "__pycache__"})


def test_the_front_door_hands_on_the_station_and_is_light():
    assert diagrams.__all__ == ["Station"]
    assert diagrams.Station is Station
    with pytest.raises(AttributeError, match="Statoin"):
        _ = diagrams.Statoin
    code = "import sys, diagrams; sys.exit('pydrake' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_no_controller_imports_trials(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert not f"{node.module}.".startswith("diagrams.trials.")
            assert node.module != "diagrams" or "trials" not in {name.name for name in node.names}
        elif isinstance(node, ast.Import):
            assert not [a.name for a in node.names if a.name.startswith("diagrams.trials")]
