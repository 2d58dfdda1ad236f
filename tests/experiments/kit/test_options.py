"""Options are read from what a person typed, and mistakes named as they were typed."""

import dataclasses
import importlib
import io
import re
import typing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import pytest
import tyro

from experiments import demo
from experiments.kit.command import execute
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
        *[(name, []) for name in ("noisy", "reachability", "sailing", "simulate", "toy_text")],
        *[("transitions", [check]) for check in ("run", "status", "export", "validate", "rules")],
        *[("transitions", [check]) for check in ("sensitivity", "releases")],
        *[("grasping", [lessons]) for lessons in ("rewards", "enough")],
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


COMMANDS = [
    *[(name, []) for name in ("bench", "complexity", "demo", "gridworld", "own_task", "docs")],
    *[(name, []) for name in ("noisy", "reachability", "sailing", "simulate", "toy_text")],
    *[("transitions", [check]) for check in ("run", "status", "export", "validate", "rules")],
    *[("transitions", [check]) for check in ("sensitivity", "releases")],
    *[("grasping", [lessons]) for lessons in ("rewards", "enough")],
]


def story_of(name):
    folder = ROOT / "experiments" / name
    return importlib.import_module(f"experiments.{name}{'.story' if folder.is_dir() else ''}")


def options_of(hint, above=""):
    """(option, its members' type, how many) of every option of a dataclass that takes numbers."""
    for each in dataclasses.fields(hint):
        kind = typing.get_type_hints(hint)[each.name]
        path = f"{above}{each.name.replace('_', '-')}"
        if dataclasses.is_dataclass(kind):
            yield from options_of(kind, f"{path}.")
            continue
        kinds = set(typing.get_args(kind)) or {kind}
        many = len([k for k in typing.get_args(kind) if k in (int, float)])
        for number in kinds & {int, float}:
            yield path, number, many if typing.get_origin(kind) is tuple else 1


def numbers(name, arguments):
    """Every option of a command that takes numbers."""
    config = story_of(name).Config
    for member in typing.get_args(config) or [config]:
        of = typing.get_args(member)[0] if typing.get_args(member) else member
        if not arguments or of.__name__.lower() == arguments[0]:
            yield from options_of(of)


@pytest.mark.parametrize(
    ("name", "arguments"), COMMANDS, ids=["-".join([n, *a]) for n, a in COMMANDS]
)
def test_no_number_is_taken_that_is_out_of_all_bounds(capsys, tmp_path, name, arguments):
    """Refused in one line that names the option, before the command does anything."""
    worked = []
    beyond = {int: ["1" + "0" * 30, "-1" + "0" * 30], float: ["inf", "nan", "-inf", "1e300"]}
    cases = [
        (option, count, value)
        for option, kind, count in numbers(name, arguments)
        for value in beyond[kind]
    ]
    for option, count, value in cases:
        given = [*arguments, f"--{option}", *[value] * count, "--out", str(tmp_path / "out")]
        with pytest.raises(SystemExit) as stop:
            execute(story_of(name).Config, lambda *_: worked.append(1) or {}, given)
        said = capsys.readouterr().err
        assert stop.value.code == 2, given
        assert said.count("\n") == 1, said
        # A plan's options are told together, for each bounds the next.
        together = "--plan." in f"--{option}" and option.rpartition(".")[2] in said
        assert said.startswith(f"error: --{option}") or together, said
    assert not worked
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("name", "given", "told"),
    [
        ("demo", ["--learning.active.query-beta", "inf"], "must be > 0 and ≤ 1e+09, is inf"),
        ("demo", ["--teacher.tolerance", "1e9"], "must be > 0 and < 1, is 1000000000.0"),
        ("demo", ["--teacher.action-cost", "-1"], "must be ≥ 0 and ≤ 1, is -1.0"),
        ("demo", ["--learning.active.hidden", "1000000000000"], "must be ≥ 1 and ≤ 10000"),
        ("gridworld", ["--hard-size", "3"], "must be ≥ 5 and ≤ 1001, is 3"),
        ("gridworld", ["--sizes", "1000001"], "must be ≥ 0 and ≤ 1001, is 1000001"),
        ("gridworld", ["--sizes"], "at least one value is needed"),
        ("toy_text", ["--environments"], "at least one value is needed"),
        ("own_task", ["--methods"], "at least one value is needed"),
        ("own_task", ["--methods", "magic"], "unknown name 'magic'; valid: fa_mlirl, "),
        ("bench", ["--subjects"], "at least one value is needed"),
        ("complexity", ["--states"], "at least one value is needed"),
        ("demo", ["--seed", str(2**32)], "must be ≥ 0 and ≤ 4294967295, is 4294967296"),
    ],
)  # fmt: skip
def test_a_refused_value_is_told_with_its_option_and_bounds(refused, name, given, told):
    assert f"{given[0]}: {told}" in refused(story_of(name), *given)
