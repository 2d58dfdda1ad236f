"""A command's options: read from what a person typed, and named in messages as they are typed."""

import contextlib
import dataclasses
import io
import re
import sys
import types
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, TypeVar

import tyro

from irl.errors import InputError

Config = TypeVar("Config")

LARGEST_SEED = 2**32 - 1

_FRAME = re.compile(r"\x1b\[[0-9;]*m|[╭╮╰╯│]")
_RULE = re.compile(r"[─-]{3,}")  # hyphens where a terminal has no frames
_HINT = "Perhaps you meant:"
_NESTED = re.compile(r"^Error parsing (?:[\w-]*dummy-inner[\w-]*\.)?([\w.-]+): ")
_NAMED = (
    re.compile(r"^(?:\w+: )?(?P<name>\w+)(?= (?:is|must|are)\b| [-\d('\"])"),  # step is -1
    re.compile(r"^\w+: (?P<name>\w+)(?=: )"),  # training: step: must be …
    re.compile(r"^(?P<name>\w+)(?=: )"),  # step: must be …
)
_PLAIN = (
    (re.compile(r"invalid literal for int\(\) with base 10: (.+)"), r"\1 is not a whole number"),
    (re.compile(r"^Expected one of \{(.+)\}$"), r"a subcommand is missing, one of \1"),
    (re.compile(r"Expected 1 values"), "Expected 1 value"),
    (re.compile(r"Could not find valid parse for arguments: \[(.+)\]"), r"\1 cannot be read"),
    (re.compile(r"no type matching (\S+) could .+ from \[(.+?)\]\. Got.*"), r"\2 is not \1"),
    (re.compile(r"could not convert string to float: (.+)"), r"\1 is not a number"),
)


class OptionError(Exception):
    """What was typed cannot be read; one line says which option, why, and where help is."""


def program() -> str:
    """How a person started this process, such as ``python -m experiments.demo``."""
    spec = getattr(sys.modules["__main__"], "__spec__", None)
    return f"python -m {spec.name.removesuffix('.__main__')}" if spec else Path(sys.argv[0]).name


def parse(config_type: type[Config], arguments: list[str] | None = None) -> Config:
    """Read the options, each a field of ``config_type``; print the help if that is asked for.

    Raises:
        OptionError: if they cannot be read.
        SystemExit: 0 after ``--help``.
    """
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            return tyro.cli(config_type, args=arguments, prog=program())
    except SystemExit as stop:
        if not stop.code:
            raise
    raise OptionError(_message(said.getvalue(), config_type))


@contextlib.contextmanager
def about(option: str) -> Iterator[None]:
    """Refusals within are about ``option``, whatever the packages call the thing.

    Raises:
        InputError: in place of one raised within, with the option as its place.
    """
    try:
        yield
    except InputError as error:
        raise error.at(option) from None


def name_option(message: str, config_type: Any, group: str = "") -> str:
    """Name the option that a message is about, as it is typed, if only one can be meant.

    Args:
        message: begins with a field, such as ``batch: must be ≥ 1, is 0`` or
            ``trial: friction is 0``; others are given back as they are.
        config_type: dataclass of the options, or a union of such.
        group: dataclass within it that the message comes from, such as ``learning.active``.
    """
    paths = [path for path in _paths(config_type) if path.startswith(f"{group}." if group else "")]
    for pattern in _NAMED:
        found = pattern.match(message)
        named = [p for p in paths if found and p.rpartition(".")[2] == found["name"]]
        # Of equal names, the one nearest to the top is meant.
        depths = [path.count(".") for path in named]
        if found and depths.count(min(depths, default=0)) == 1:
            path = named[depths.index(min(depths))]
            return f"--{path.replace('_', '-')}{message[found.end() :]}"
    return message


def _message(box: str, config_type: Any) -> str:
    """One line from the parser's box: what is wrong, what may have been meant, where help is.

    The box has a title in its frame, and sections between rules: what is wrong first.
    """
    lines = [_FRAME.sub("", line).strip() for line in box.splitlines()[1:]]
    sections = [part for part in _RULE.split("\n".join(lines)) if part.strip()]
    told = " ".join(sections[0].split()).rstrip(".")
    if nested := _NESTED.match(told):
        group, told = nested[1], told[nested.end() :]
        for member in _members(config_type):
            if group == member.__name__:  # of one subcommand, or of all options
                config_type, group = member, ""
        is_option = group.startswith("-")
        told = f"{group}: {told}" if is_option else name_option(told, config_type, group)
    for pattern, words in _PLAIN:
        told = pattern.sub(words, told)
    for section in map(str.strip, sections[1:]):
        if section.startswith(_HINT):
            meant = dict.fromkeys(re.findall(r"^--[\w.-]+", section, flags=re.MULTILINE))
            told += f"; perhaps you meant {' or '.join(meant)}"
        elif section.startswith("Available subcommands"):
            told += f"; {section[0].lower()}{' '.join(section[1:].split())}"
    return f"{told}; for help: {program()} --help"


def _members(config_type: Any) -> Iterator[type]:
    """A dataclass of options by itself, or all those of a union."""
    if typing.get_origin(config_type) in (typing.Union, types.UnionType):
        for member in typing.get_args(config_type):
            yield from _members(member)
    elif typing.get_origin(config_type) is Annotated:
        yield from _members(typing.get_args(config_type)[0])
    else:
        yield config_type


def _paths(config_type: Any, above: str = "") -> Iterator[str]:
    """Every option of a dataclass as a dotted path of fields; of a union, of all its members."""
    members = list(_members(config_type))
    if len(members) > 1:
        yield from dict.fromkeys(path for member in members for path in _paths(member, above))
        return
    hints = typing.get_type_hints(members[0])
    for field in dataclasses.fields(members[0]):
        path = f"{above}{field.name}"
        if dataclasses.is_dataclass(hints[field.name]):
            yield from _paths(hints[field.name], f"{path}.")
        else:
            yield path
