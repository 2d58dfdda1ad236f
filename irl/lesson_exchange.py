"""Lessons and files: demonstrations and advice go out of a lesson, and come into one."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from irl.clusters import intersection
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.files import atomic_path
from irl.formats import read_json, write_json
from irl.lesson import Lesson
from irl.lesson_events import PURPOSES, Imported, hash_of_states
from irl.lesson_taught import Taught, to_rows
from irl.mdp import TransitionModel

ADVICE_VERSION = 1
_PIECE = ("cluster", "preferred", "avoided", "states_hash")


# --- Out --------------------------------------------------------------------------------------


def demonstrations_of(lesson: Lesson, purposes: Sequence[str] = PURPOSES) -> Demonstrations:
    """All that was shown in a lesson and holds, the first demonstrations included."""
    taught = Taught.of(lesson.events)
    return Demonstrations.concatenate([lesson.initial, taught.demonstrations(purposes)])


def save_advice(lesson: Lesson, path: Path) -> None:
    """Write the advice of a lesson, as JSON, whole or not at all.

    Raises:
        OSError: if the file cannot be written.
    """
    pieces = [
        {name: getattr(each, name) for name in _PIECE} for each in Taught.of(lesson.events).advised
    ]
    told = {
        "schema_version": ADVICE_VERSION,
        "task_hash": lesson.began.task_hash,
        "advice": pieces,
    }
    with atomic_path(path) as temporary:
        write_json(temporary, told)


# --- In ---------------------------------------------------------------------------------------


def read_demonstrations(path: Path, model: TransitionModel, lesson: Lesson) -> Imported:
    """Demonstrations from a file, their runs numbered after those of the lesson.

    Raises:
        InputError: if it cannot be read, or holds what cannot be done.
    """
    found = Demonstrations.load(path)
    found.check(model, str(path))
    if not len(found) and not len(found.ends):
        raise InputError("holds no demonstration", place=str(path))
    rows, ends = renumbered(found, next_trajectory(lesson))
    return Imported(path.name, rows, ends, [], [])


def read_advice(
    path: Path, task_hash: str, clusters: Mapping[str, np.ndarray], n_actions: int
) -> Imported:
    """Advice from a file that `save_advice` wrote.

    Raises:
        InputError: naming the piece and the field that is wrong, or the task that it is about.
    """
    told = read_json(path)
    if not isinstance(told, dict) or told.keys() != {"schema_version", "task_hash", "advice"}:
        raise InputError(
            "an object with schema_version, task_hash and advice wanted", place=str(path)
        )
    if told["schema_version"] != ADVICE_VERSION:
        raise InputError(
            f"field 'schema_version' is {told['schema_version']!r:.20}",
            place=str(path),
            valid=[ADVICE_VERSION],
        )
    if told["task_hash"] != task_hash:
        raise InputError(
            f"field 'task_hash' is {told['task_hash']!r:.20}…, of another task than "
            f"{task_hash[:12]!r}…",
            place=str(path),
        )
    if not isinstance(told["advice"], list):
        raise InputError("field 'advice' must be a list", place=str(path))
    pieces = [
        _piece(each, f"{path}: advice {k}", clusters, n_actions)
        for k, each in enumerate(told["advice"])
    ]
    return Imported(path.name, [], [], pieces, [])


def _piece(told: Any, place: str, clusters: Mapping[str, np.ndarray], n_actions: int) -> list[Any]:
    if not isinstance(told, dict) or told.keys() != set(_PIECE):
        raise InputError(f"an object with {', '.join(_PIECE)} wanted", place=place)
    if not isinstance(told["cluster"], str):
        raise InputError("field 'cluster' must be a name", place=place)
    for name in ("preferred", "avoided"):
        actions = told[name]
        if not isinstance(actions, list) or any(
            type(a) is not int or not 0 <= a < n_actions for a in actions
        ):
            raise InputError(f"field '{name}' must list actions 0…{n_actions - 1}", place=place)
    if set(told["preferred"]) & set(told["avoided"]):
        raise InputError("an action is both preferred and avoided", place=place)
    try:
        states = intersection(clusters, told["cluster"])
    except InputError as error:
        raise InputError(str(error), place=place) from None
    if told["states_hash"] not in ("", hash_of_states(states)):
        raise InputError(
            f"cluster {told['cluster']!r} has other states than when advice was given", place=place
        )
    return [told["cluster"], hash_of_states(states), told["preferred"], told["avoided"]]


def next_trajectory(lesson: Lesson) -> int:
    """A number that no run of a lesson has."""
    numbers = [-1]
    for event in lesson.events:
        if hasattr(event, "trajectory"):
            numbers.append(event.trajectory)
        elif isinstance(event, Imported):
            numbers += [row[0] for row in [*event.rows, *event.ends]]
    numbers += [row[0] for row in [*lesson.began.initial, *lesson.began.ends]]
    return max(numbers) + 1


def renumbered(shown: Demonstrations, first: int) -> tuple[list, list]:
    """Rows and ends as an event holds them, the runs numbered from ``first`` on, in their order."""
    rows, ends = to_rows(shown)
    old = sorted({row[0] for row in [*rows, *ends]})
    new = {number: first + k for k, number in enumerate(old)}
    return [[new[r[0]], *r[1:]] for r in rows], [[new[r[0]], *r[1:]] for r in ends]
