"""The form of a scenario's file, and how it is read: by Drake's loader of typed YAML."""

from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any, TypeAlias

import yaml
from pydrake.common.schema import Uniform
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed

from models.errors import ModelError

SHIPPED = Path(__file__).parent / "shipped"
"""A file each, named as the scenario is."""

Size: TypeAlias = float | Uniform
"""A number, or ``!Uniform { min: …, max: … }``, drawn for each episode anew."""


@dataclass
class Push:
    """A force on the free cube during the arm's first approach moves and turns it on the table."""

    distance: Size = 0.0
    """By how much [m], in a direction that keeps the cube in reach."""
    turn: Size = 0.0
    """By how much, about the vertical, one way or the other [deg]."""
    wait: Size = 0.3
    """From the arm's first motion until the force begins [s]."""
    seconds: float = 0.5
    """How long it acts [s]."""


@dataclass
class Slip:
    """The cube is moved in the hand, the grip weakened for that moment."""

    distance: Size = 0.0
    """By how much, along the pads [m]."""
    turn: Size = 0.0
    """By how much, about the closing axis, one way or the other [deg]."""
    wait: Size = 0.3
    """From when the cube is first lifted until it begins [s]."""
    seconds: float = 0.6
    """How long it takes [s]."""
    grip: float = 0.1
    """What is left of the grip's force meanwhile, a share of it."""


@dataclass
class Yank:
    """The cube is pulled out of the moving hand and put down on the table, in reach."""

    distance: Size = 0.08
    """How far it is pulled before it is lowered [m]."""
    wait: Size = 0.5
    """From the lifted cube's first motion until it begins, in a motion [s]."""
    seconds: float = 0.5
    """How long the pull takes [s]."""
    grip: float = 0.05
    """What is left of the grip's force meanwhile, a share of it."""


@dataclass
class Noise:
    """What is measured of the cube's pose is off, anew every so often."""

    position: float = 0.0
    """Root mean square distance from the truth [m]."""
    turn: float = 0.0
    """Root mean square angle of rotation from the truth [deg]."""
    period: float = 0.1
    """How long a measurement stands [s]."""


@dataclass
class WeakJoint:
    """A joint of the arm has less torque."""

    joint: int = 1
    """Which one, 1 to 7."""
    share: float = 1.0
    """How much of its torque it has."""


@dataclass
class Base:
    """The robot does not stand where its planner believes."""

    offset: Size = 0.0
    """How far off, in a drawn horizontal direction [m]."""
    turn: Size = 0.0
    """How far turned, about a drawn axis [deg]."""


@dataclass
class Distractor:
    """A second cube lies on the table, which nobody knows of."""

    distance: Size = 0.1
    """From the first one's centre to its own [m]; there is a place for it wherever that lies."""


@dataclass
class Scenario:
    """What goes otherwise than usual; what is left out goes as usual."""

    description: str = ""
    """In one sentence."""
    push: Push | None = None
    slip: Slip | None = None
    yank: Yank | None = None
    friction: Size | None = None
    """Coefficient of everything."""
    mass: Size | None = None
    """Of the cube [kg]."""
    noise: Noise | None = None
    delay: float | None = None
    """Of the commands to arm and gripper [s], a multiple of the station's step."""
    weak_joint: WeakJoint | None = None
    posture: bool = False
    """Whether the arm starts in another posture, drawn among those that are free."""
    base: Base | None = None
    distractor: Distractor | None = None

    def leads(self) -> bool:
        """Whether an unseen hand leads the cube somewhere."""
        return any((self.push, self.slip, self.yank))

    def text(self) -> str:
        """As YAML, everything that is not left out."""
        return yaml_dump_typed(self, schema=Scenario)


_RANGES: dict[str, tuple[float, float]] = {
    "push.distance": (0.0, 0.1),
    "slip.distance": (0.0, 0.02),
    "yank.distance": (0.05, 0.15),
    "push.turn": (0.0, 180.0),
    "slip.turn": (0.0, 45.0),
    "base.turn": (0.0, 10.0),
    "noise.turn": (0.0, 45.0),
    "noise.position": (0.0, 0.1),
    "noise.period": (0.0025, 10.0),
    "base.offset": (0.0, 0.05),
    "distractor.distance": (0.08, 0.18),
    "wait": (0.0, 60.0),
    "seconds": (0.1, 5.0),
    "grip": (0.0, 1.0),
    "weak_joint.joint": (1, 7),
    "weak_joint.share": (0.01, 1.0),
    "friction": (0.01, 2.0),
    "mass": (0.005, 5.0),
    "delay": (0.0, 1.0),
}
"""What sizes may be, by their place or, where that is not listed, by their field."""


def shipped_scenarios() -> list[str]:
    """Names of the scenarios that are shipped."""
    return sorted(path.stem for path in SHIPPED.glob("*.yaml"))


def load_scenario(name: str) -> Scenario:
    """Read a scenario.

    Args:
        name: of a shipped one, or a path to a file of the same form.

    Raises:
        ModelError: if there is none, or it is not of that form; names the file and the field.
    """
    path = SHIPPED / f"{name}.yaml"
    if not path.is_file():
        path = Path(name)
    if not path.is_file():
        raise ModelError(f"scenario {name}: valid: {', '.join(shipped_scenarios())}, or a file")
    return parse_scenario(path.read_text(encoding="utf-8"), str(path))


def parse_scenario(text: str, place: str) -> Scenario:
    """Read a scenario out of YAML that came from ``place``.

    Raises:
        ModelError: as `load_scenario`.
    """
    try:
        scenario = yaml_load_typed(schema=Scenario, data=text)
    except (RuntimeError, ValueError, TypeError, yaml.YAMLError) as error:
        raise ModelError(f"{place}: {' '.join(str(error).split())}") from None
    for field, value in _sizes(scenario):
        low, high = _RANGES.get(field) or _RANGES[field.rpartition(".")[2]]
        ends = (value.min, value.max) if isinstance(value, Uniform) else (value, value)
        if not low <= ends[0] <= ends[1] <= high:
            shown = f"{ends[0]:g} to {ends[1]:g}" if isinstance(value, Uniform) else f"{value:g}"
            raise ModelError(f"{place}: field '{field}' is {shown}; valid: {low:g} to {high:g}")
    return scenario


def _sizes(part: Any, prefix: str = "") -> list[tuple[str, Size]]:
    """Every number in a scenario, with its place in the file."""
    found: list[tuple[str, Size]] = []
    for field in fields(part):
        value = getattr(part, field.name)
        place = f"{prefix}{field.name}"
        if is_dataclass(value):
            found += _sizes(value, f"{place}.")
        elif isinstance(value, float | int | Uniform) and not isinstance(value, bool):
            found.append((place, value))
    return found
