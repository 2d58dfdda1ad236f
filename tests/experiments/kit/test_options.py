"""Options are read from what a person typed, and mistakes named as they were typed."""

import importlib
import io
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import pytest
import tyro

from experiments import demo
from experiments.kit.options import OptionError, name_option, parse
from experiments.transitions import story as transitions
from irl.choices import Limits, Settings

ROOT = Path(__file__).parents[3]


@dataclass
class Training:
    """How to train."""

    step: float = 0.1
    """Size of a step."""
    learn_beta: bool = False
    """Whether to learn β."""


@dataclass
class Learn:
    """Learn something."""

    first: Training = field(default_factory=Training)
    """At first."""
    later: Training = field(default_factory=Training)
    """Later."""
    budget: int = 3
    """How many queries."""


@dataclass
class Play:
    """Play it."""

    step: float = 0.1
    """Of time."""


BOTH = Annotated[Learn, tyro.conf.subcommand("learn")] | Annotated[Play, 0]


@pytest.mark.parametrize(
    ("message", "named"),
    [
        ("budget: must be ≥ 0, is -1", "--budget: must be ≥ 0, is -1"),
        ("budget must be ≥ 0", "--budget must be ≥ 0"),
        ("learning: budget is -1; give more", "--budget is -1; give more"),
        ("later: budget: must be ≥ 0", "--budget: must be ≥ 0"),
        ("step: must be > 0", "step: must be > 0"),  # either could be meant
        ("map.csv: budget is -1", "map.csv: budget is -1"),
        ("budget goes where it will", "budget goes where it will"),
    ],
)
def test_a_message_names_the_option_if_one_alone_can_be_meant(message, named):
    assert name_option(message, Learn) == named


def test_the_group_that_a_message_comes_from_tells_equal_names_apart():
    assert name_option("learn_beta: no", Learn, "later") == "--later.learn-beta: no"


def test_of_equal_names_the_one_nearest_to_the_top_is_meant():
    assert name_option("step: must be > 0", BOTH) == "--step: must be > 0"


@pytest.mark.parametrize(
    ("story", "arguments", "told"),
    [
        (demo, ["--seed", "five"], "--seed: 'five' is not a whole number;"),
        (demo, ["--seeds", "5"], "Unrecognized options: --seeds, 5; perhaps you meant --seed;"),
        (demo, ["--starts"], "Missing value for argument '--starts'. Expected 1 value;"),
        (demo, ["--learning.active.budget", "-1"], "--learning.active.budget: must be ≥ 0, is -1;"),
        (demo, ["--learning.active.refine.step", "x"], "--learning.active.refine.step: 'x' is not"),
        (demo, ["--learning.active.initial.optimizer", "a"], "--learning.active.initial.optimizer"),
        (transitions, [], "a subcommand is missing, one of run, status, export,"),
        (transitions, ["rum"], "Unrecognized options: rum; available subcommands: run, status,"),
        (transitions, ["run", "--plan.least", "0"], "--plan.block 4, least 0, most 48; give"),
        (transitions, ["run", "--hours", "x"], "--hours: 'x' is not"),
    ],
)
def test_what_cannot_be_read_is_told_once_by_option(story, arguments, told):
    with pytest.raises(OptionError) as caught:
        parse(story.Config, arguments)
    message = str(caught.value)
    assert message.startswith(told)
    assert "\n" not in message
    assert message.count(told) == 1
    assert message.endswith(" --help")


@pytest.mark.parametrize("arguments", [["--sise", "5"], ["--learning.active.batch", "0"]])
def test_the_program_is_named_as_it_was_called(command, arguments):
    done = command("demo", *arguments)
    assert (done.returncode, done.stdout) == (2, "")
    (line,) = done.stderr.splitlines()
    assert line.startswith("error: ")
    assert arguments[0] in line
    assert line.endswith("for help: python -m experiments.demo --help")


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        *[(name, []) for name in ("bench", "complexity", "demo", "gridworld", "own_task")],
        *[(name, []) for name in ("reachability", "sailing", "simulate", "toy_text")],
        *[("transitions", [check]) for check in ("run", "status", "export", "validate", "rules")],
        *[("transitions", [check]) for check in ("sensitivity", "releases")],
    ],
)
def test_every_option_is_explained(capsys, monkeypatch, name, arguments):
    monkeypatch.setenv("COLUMNS", "100")
    folder = ROOT / "experiments" / name
    story = importlib.import_module(f"experiments.{name}{'.story' if folder.is_dir() else ''}")
    with pytest.raises(SystemExit) as stop:
        parse(story.Config, [*arguments, "--help"])
    assert not stop.value.code
    text = " ".join(capsys.readouterr().out.replace("│", " ").split())
    options = re.split(r" (?=--[a-z])", text.partition("show this help message and exit")[2])[1:]
    assert any(option.startswith("--out PATH") for option in options)
    for option in options:
        # Its name, of a switch its other name, and a sentence before the default.
        assert re.search(r"^--\S+,$|[A-Z].*[.)] ?\(default: ", option), option


@dataclass(frozen=True)
class Checked(Settings):
    """Settings that check themselves."""

    batch: Annotated[int, Limits(1)] = 1
    """How many."""


@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
def test_a_refusal_of_the_settings_themselves_names_the_option(monkeypatch, encoding):
    # Where frames cannot be written, the parser draws its rules with hyphens.
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(io.BytesIO(), encoding=encoding))
    with pytest.raises(OptionError, match=r"^--batch: must be ≥ 1, is 0; for help: "):
        parse(Checked, ["--batch", "0"])
