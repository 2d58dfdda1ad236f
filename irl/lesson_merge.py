"""Two teachers' lessons become one.

Where they contradict one another, nobody decides for them. Answers of both count, as two answers of
one teacher do; of advice what one prefers and the other avoids is set aside on both sides; and all
of it is listed.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from irl.clusters import intersection
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.lesson import Lesson
from irl.lesson_events import AUDIT, DONE, LEARN, Advised, Edit, Event, Imported
from irl.lesson_exchange import demonstrations_of, next_trajectory, renumbered
from irl.lesson_standing import stands
from irl.lesson_taught import Taught

BOTH_COUNT = "both count"
SET_ASIDE = "set aside on both sides"
SET_ASIDE_THERE = "set aside there; here it came from a file and stands: undo that, or let it be"


@dataclass(frozen=True)
class Conflict:
    """Where two teachers contradict one another.

    Attributes:
        kind: ``answer``, ``advice``, or ``advice against answer``.
        about: the state, or the cluster of each side.
        here: actions that this lesson is for; `DONE` among them.
        there: actions that the other is for; of advice against them those that it avoids.
        remedy: what becomes of it.
    """

    kind: str
    about: str
    here: tuple[int, ...]
    there: tuple[int, ...]
    remedy: str


@dataclass(frozen=True)
class Merged:
    """What is to be added to a lesson so that it holds another one too, and all conflicts."""

    events: list[Event]
    conflicts: list[Conflict]


def merge(here: Lesson, there: Lesson, clusters: Mapping[str, np.ndarray]) -> Merged:
    """Take another lesson into this one; nothing is written yet.

    What both begin with alike, as copies of one do, comes once. What the other teacher held out
    stays there.

    Args:
        here: the lesson to add to.
        there: the other.
        clusters: of the task.

    Raises:
        InputError: if the other lesson is about another task, or was taken in before.
    """
    there.require_task(here.began.task_hash)
    source = f"{there.path.name}, {there.mark[:12]}"
    standing = stands(here.events).values()
    if any(isinstance(each, Imported) and each.source == source for each in standing):
        raise InputError("was taken into this lesson before", place=str(there.path))
    alike = 0
    for one, other in zip(here.events, there.events, strict=False):
        if one != other:
            break
        alike += 1
    new = Taught.of(there.events)
    new.forget(alike)
    parts = [new.demonstrations((LEARN, AUDIT))]
    if there.began.initial != here.began.initial:
        parts.append(there.initial)
    shown = Demonstrations.concatenate(parts)
    edits, left, contested = _advice(here, new.advised, clusters)
    against = _against(demonstrations_of(here), new.advised, clusters, "there")
    against += _against(shown, Taught.of(here.events).advised, clusters, "here")
    rows, ends = renumbered(shown, next_trajectory(here))
    event = Imported(source, rows, ends, left, [list(pair) for pair in sorted(new.excluded)])
    conflicts = [*_answers(demonstrations_of(here), shown), *contested, *against]
    return Merged([*edits, event], conflicts)


def _said(shown: Demonstrations) -> dict[int, set[int]]:
    """State → what was shown there, `DONE` for an end."""
    said: dict[int, set[int]] = {}
    own = ~shown.generalised
    for state, action in zip(shown.state[own].tolist(), shown.action[own].tolist(), strict=True):
        said.setdefault(state, set()).add(action)
    for state in shown.ends[:, 2].tolist():
        said.setdefault(state, set()).add(DONE)
    return said


def _answers(here: Demonstrations, there: Demonstrations) -> list[Conflict]:
    mine, others = _said(here), _said(there)
    return [
        Conflict(
            *("answer", f"state {state}"),
            here=tuple(sorted(mine[state])),
            there=tuple(sorted(others[state])),
            remedy=BOTH_COUNT,
        )
        for state in sorted(mine.keys() & others.keys())
        if not mine[state] & others[state]
    ]


def _advice(
    here: Lesson, there: list[Advised], clusters: Mapping[str, np.ndarray]
) -> tuple[list[Event], list[list], list[Conflict]]:
    """Edits of advice here, what is left of advice from there, and what was contested."""
    standing = stands(here.events)
    mine: list[tuple[int | None, Advised]] = []
    for said_as, event in standing.items():
        if isinstance(event, Advised):
            mine.append((said_as, event))
        elif isinstance(event, Imported):
            mine += [(None, Advised(*piece)) for piece in event.advice]
    gone: dict[int, set[int]] = {}
    left, conflicts = [], []
    for piece in there:
        contested: set[int] = set()
        for number, own in mine:
            both = set(own.preferred) & set(piece.avoided)
            both |= set(own.avoided) & set(piece.preferred)
            if not both or not _overlap(own.cluster, piece.cluster, clusters):
                continue
            contested |= both
            if number is not None:
                gone.setdefault(number, set()).update(both)
            conflicts.append(
                Conflict(
                    *("advice", f"{own.cluster} here, {piece.cluster} there"),
                    here=tuple(sorted(both & set(own.preferred))),
                    there=tuple(sorted(both & set(piece.preferred))),
                    remedy=SET_ASIDE if number is not None else SET_ASIDE_THERE,
                )
            )
        good, bad = ([a for a in each if a not in contested] for each in _sides(piece))
        left.append([piece.cluster, piece.states_hash, good, bad])
    edits: list[Event] = []
    for edited, own in mine:
        if edited is not None and edited in gone:
            good, bad = ([a for a in each if a not in gone[edited]] for each in _sides(own))
            edits.append(Edit(edited, {"preferred": good, "avoided": bad}))
    return edits, left, conflicts


def _against(
    shown: Demonstrations, advised: list[Advised], clusters: Mapping[str, np.ndarray], where: str
) -> list[Conflict]:
    """Advice of one side that avoids what the other side showed."""
    said, conflicts = _said(shown), []
    for piece in advised:
        members = set(intersection(clusters, piece.cluster).tolist())
        for state in sorted(members & said.keys()):
            avoided = tuple(sorted(said[state] & set(piece.avoided)))
            if avoided:
                here, there = ((), avoided) if where == "there" else (avoided, ())
                about = f"state {state}, of {piece.cluster} {where}"
                conflicts.append(Conflict("advice against answer", about, here, there, BOTH_COUNT))
    return conflicts


def _sides(piece: Advised) -> tuple[list, list]:
    return piece.preferred, piece.avoided


def _overlap(one: str, other: str, clusters: Mapping[str, np.ndarray]) -> bool:
    return bool(np.intersect1d(intersection(clusters, one), intersection(clusters, other)).size)
