"""What a teacher may say in a line, typed or from a script, and what the desk makes of it.

A script is a file of JSON lines, one command each:

| line | what it does |
|---|---|
| ``{"action": 3}``, ``{"action": "done"}`` | answers; ``"proposed"`` takes what is preselected |
| ``{"do": "skip"}``, ``{"do": "another"}`` | puts the question aside, for good or for now |
| ``{"do": "undo"}``, ``{"do": "undo", "number": 7}`` | takes back the last said, or that |
| ``{"do": "edit", "answer": 7, "action": 3}`` | corrects an answer |
| ``{"do": "advise", "cluster": "a ∩ b", "preferred": [1], "avoided": [2]}`` | advises |
| ``{"do": "cluster", "cluster": "a ∩ b"}`` | keeps an intersection |
| ``{"do": "exclude", "answer": 7, "pairs": [[s, a]]}`` | refuses what a rule would label |
| ``{"do": "correct", "state": 5, "action": 3}`` | corrects a playing policy, ``after`` another |
| ``{"do": "run", "state": 5}``, ``{"do": "act"}`` | begins a trajectory; lets the learner act |
| ``{"do": "round"}``, ``{"do": "quit"}`` | waits for the learner; ends the lesson |

An answer may say ``seconds``, ``previews`` and ``outcome`` (the state it led to), and for safety
``state``, the one it believes that it is asked about.
"""

import json
import secrets
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from experiments.teach.desk import Desk
from irl.errors import InputError, first_line
from irl.formats import distinct, read_text
from irl.lesson_events import DONE

Command = Mapping[str, Any]
_OPTIONAL = {
    "answer": ("seconds", "previews", "outcome", "state"),
    "correct": ("after",),
    "run": ("state",),
    "undo": ("number",),
    "advise": ("preferred", "avoided", "seconds"),
}
_WANTED: Mapping[str, tuple[str, ...]] = {
    "answer": ("action",),
    "skip": (),
    "another": (),
    "undo": (),
    "edit": ("answer", "action"),
    "advise": ("cluster",),
    "cluster": ("cluster",),
    "exclude": ("answer", "pairs"),
    "correct": ("state", "action"),
    "run": (),
    "act": (),
    "round": (),
    "quit": (),
}
QUIT = "quit"
_PATIENCE = 0.02


def read_script(path: Path) -> Iterator[tuple[str, Command]]:
    """The commands of a file of JSON lines, each with the place that messages name.

    Raises:
        InputError: if the file cannot be read, or a line is no command; names the line.
    """
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        if line.strip():
            place = f"{path}: line {number}"
            yield place, parsed(line, place)


def parsed(line: str, place: str) -> Command:
    """The command that a line of JSON is.

    Raises:
        InputError: if it is none.
    """
    try:
        command = json.loads(line, object_pairs_hook=distinct)
    except (ValueError, RecursionError) as error:
        raise InputError(f"not JSON ({first_line(error)})", place=place) from None
    check(command, place)
    return command


def check(command: Any, place: str) -> None:
    """Refuse what is no command.

    Raises:
        InputError: naming the field.
    """
    if not isinstance(command, dict):
        raise InputError(f"an object wanted, is {command!r:.40}", place=place)
    what = command.get("do", "answer")
    if what not in _WANTED:
        raise InputError(f"'do' is {what!r:.40}", place=place, valid=_WANTED)
    wanted, allowed = _WANTED[what], (*_WANTED[what], *_OPTIONAL.get(what, ()), "do")
    for name in wanted:
        if name not in command:
            raise InputError(f"field '{name}' is missing", place=place)
    for name, value in command.items():
        if name not in allowed:
            raise InputError(f"unknown field {name!r:.40}", place=place, valid=allowed)
        if not _FITS.get(name, _is_index)(value):
            raise InputError(f"field '{name}' is {value!r:.60}", place=place)


def perform(desk: Desk, command: Command, token: str | None = None) -> str:
    """Do what a command says; one line about what came of it.

    Args:
        desk: the lesson.
        command: checked.
        token: of the message; a new one if None.

    Raises:
        InputError: if it cannot be done.
    """
    what, token = command.get("do", "answer"), token or secrets.token_hex(8)
    done: Mapping[str, Callable[[], str]] = {
        "answer": lambda: _answer(desk, command),
        "skip": lambda: _told(_asked(desk, Desk.skip), "put aside"),
        "another": lambda: _told(_asked(desk, Desk.another), "later, perhaps"),
        "undo": lambda: _told(desk.undo(token, command.get("number")) is not None, "taken back"),
        "edit": lambda: _told(
            desk.edit(command["answer"], _action(desk, command["action"]), token), "corrected"
        ),
        "advise": lambda: _advise(desk, command, token),
        "cluster": lambda: f"{desk.make_cluster(command['cluster'], token)} states",
        "exclude": lambda: _told(desk.exclude(command["answer"], command["pairs"], token), "noted"),
        "correct": lambda: _told(
            desk.correct(
                command["state"],
                _action(desk, command["action"]),
                token,
                command.get("after"),
            )
            is not None,
            "corrected",
        ),
        "run": lambda: _run(desk, command),
        "act": lambda: _act(desk),
        "round": lambda: _round(desk),
        QUIT: lambda: "",
    }
    return done[what]()


def settle(desk: Desk) -> None:
    """Wait until the learner has learnt from all that was said."""
    desk.tick()
    while desk.rounds.running is not None:
        time.sleep(_PATIENCE)
        desk.tick()


def _answer(desk: Desk, command: Command) -> str:
    asked = desk.question
    if asked is None:
        raise InputError("nothing is asked", place="answer")
    if command.get("state", asked.state) != asked.state:
        raise InputError(
            f"is about state {command['state']}, and state {asked.state} was asked about",
            place="answer",
        )
    action = _action(desk, command["action"])
    given = desk.answer(
        asked.token,
        action,
        seconds=command.get("seconds", 0.0),
        previews=command.get("previews", 0),
        outcome=command.get("outcome"),
    )
    told = desk.world.say_action(action)
    return told if given.outcome is None else f"{told} → {desk.world.say_state(given.outcome)}"


def _action(desk: Desk, said: int | str) -> int:
    """An action as commands name it."""
    if said == "done":
        return DONE
    if said == "proposed":
        if desk.question is None or desk.question.proposed is None:
            raise InputError("nothing is proposed", place="action")
        return desk.question.proposed
    return int(said)


def _asked(desk: Desk, method: Callable[[Desk, str], bool]) -> bool:
    return desk.question is not None and method(desk, desk.question.token)


def _run(desk: Desk, command: Command) -> str:
    desk.begin_run(command.get("state"))
    return "a new trajectory"


def _round(desk: Desk) -> str:
    settle(desk)
    return desk.rounds.error or "learnt"


def _act(desk: Desk) -> str:
    given = desk.act(desk.question.token) if desk.question is not None else None
    if given is None or given.outcome is None:
        raise InputError("there is nothing that the learner would do here", place="act")
    return f"the learner acted → {desk.world.say_state(given.outcome)}"


def _advise(desk: Desk, command: Command, token: str) -> str:
    good, bad = command.get("preferred", []), command.get("avoided", [])
    seconds = command.get("seconds", 0.0)
    given = desk.advise(command["cluster"], good, bad, token, seconds=seconds)
    told = f"in {given.states} states"
    if given.contradicted:
        numbers = ", ".join(map(str, given.contradicted))
        told += f"; contradicts the answers {numbers}"
    return told


def _told(done: bool, words: str) -> str:
    return words if done else "nothing to do"


def _is_index(value: Any) -> bool:
    return type(value) is int and value >= -1


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and 0 <= value < 1e9


_FITS: Mapping[str, Callable[[Any], bool]] = {
    "do": lambda value: isinstance(value, str),
    "cluster": lambda value: isinstance(value, str),
    "action": lambda value: _is_index(value) or value in ("done", "proposed"),
    "seconds": _is_number,
    "preferred": lambda value: isinstance(value, list) and all(map(_is_index, value)),
    "avoided": lambda value: isinstance(value, list) and all(map(_is_index, value)),
    "pairs": lambda value: (
        isinstance(value, list)
        and all(isinstance(p, list) and len(p) == 2 and all(map(_is_index, p)) for p in value)
    ),
}
