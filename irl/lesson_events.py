"""What is said in a lesson: its events, one after another.

An event's number is its place, from 1. Nothing is ever taken out: ``Undo`` and ``Edit`` are events
themselves, and `irl.lesson_standing` does what they say.
"""

import hashlib
import types
import typing
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from irl.choices import check_choice
from irl.errors import InputError

DONE = -1
"""The action that stands for *done: nothing to do here*."""
LEARN, AUDIT, HELD_OUT = "learn", "audit", "held_out"
PURPOSES = (LEARN, AUDIT, HELD_OUT)
"""What an answer is for: to learn from; to test the learner's own proposal, and to learn from when
the test is over; or to judge the policy by, and never to learn from."""


@dataclass(frozen=True)
class Began:
    """The first event: what is taught, to whom.

    Attributes:
        task_hash: of the task data.
        config: of the session, as plain values.
        versions: of Python and packages.
        initial: rows of the demonstrations before the first question: trajectory, step, state,
            action, source.
        ends: where those runs ended: trajectory, step, state.
    """

    task_hash: str
    config: dict
    versions: dict
    initial: list
    ends: list


@dataclass(frozen=True)
class Asked:
    """A question about a state was shown.

    Attributes:
        state: index.
        strategy: why this one: the name of a strategy, or of what else led to it.
        score: of the strategy.
        round: the last one that had a result; −1 before any.
        trajectory: the run that an answer belongs to, and its ``step`` there.
        step: see there.
        proposed: the action that the policy favours, ``DONE``, or None if there is none yet.
        purpose: a name in ``PURPOSES``.
        token: made when it was shown; what comes under it a second time is nothing new.
    """

    state: int
    strategy: str
    score: float
    round: int
    trajectory: int
    step: int
    proposed: int | None
    purpose: str
    token: str


@dataclass(frozen=True)
class Answered:
    """An answer.

    Attributes:
        state: index, and what to do there: ``action``, or ``DONE``.
        action: see there.
        trajectory: the run, and its ``step`` there.
        step: see there.
        preselected: what was marked when the question was shown; None for nothing.
        seconds: from there to the answer.
        previews: motions looked at meanwhile.
        purpose: a name in ``PURPOSES``.
    """

    state: int
    action: int
    trajectory: int
    step: int
    preselected: int | None = None
    seconds: float = 0.0
    previews: int = 0
    purpose: str = LEARN


@dataclass(frozen=True)
class Outcome:
    """What the answer of that number led to."""

    answer: int
    state: int


@dataclass(frozen=True)
class Acted:
    """The learner was sure and acted alone: what it did, in which moment of a run, what came.

    No demonstration: the run has a gap there.
    """

    state: int
    action: int
    trajectory: int
    step: int
    outcome: int


@dataclass(frozen=True)
class Advised:
    """Advice about a cluster, or an intersection such as ``"a ∩ b"``.

    Attributes:
        cluster: its expression.
        states_hash: of its states, `hash_of_states`; not compared where it is empty.
        preferred: actions.
        avoided: actions.
        seconds: that it took; 0 if nobody measured.
    """

    cluster: str
    states_hash: str
    preferred: list
    avoided: list
    seconds: float = 0.0


@dataclass(frozen=True)
class Cluster:
    """A new cluster: an intersection of others, and the hash of its states."""

    cluster: str
    states_hash: str


@dataclass(frozen=True)
class Excluded:
    """Pairs that a rule would label after the answer of that number, and that do not follow."""

    answer: int
    pairs: list


@dataclass(frozen=True)
class Skipped:
    """The question about that state was put aside, for good."""

    state: int


@dataclass(frozen=True)
class Undo:
    """The event of that number is taken back."""

    of: int


@dataclass(frozen=True)
class Edit:
    """The event of that number holds other values in some of its fields, in its old place.

    Of an answer ``action`` may change, of advice ``preferred`` and ``avoided``, of what was
    excluded ``pairs``, of what came from files ``advice``.
    """

    of: int
    changes: dict


@dataclass(frozen=True)
class Round:
    """The learner sets out to learn from the events up to number ``upto``.

    Attributes:
        k: number of the round, from 0.
        upto: see there.
        fresh: whether it starts anew, knowing nothing of earlier rounds: the first, and one after
            the learner or the whole program was started again.
    """

    k: int
    upto: int
    fresh: bool


@dataclass(frozen=True)
class Result:
    """What round ``k`` came to: the policy's hash, and what the learner says of itself."""

    k: int
    policy_hash: str
    told: dict


@dataclass(frozen=True)
class Imported:
    """Demonstrations and advice from files.

    Attributes:
        source: their names.
        rows: of demonstrations: trajectory, step, state, action, source.
        ends: where runs ended: trajectory, step, state.
        advice: for each piece cluster, hash of its states, preferred, avoided.
        excluded: pairs that no rule may label: state, action.
    """

    source: str
    rows: list
    ends: list
    advice: list
    excluded: list


Event = (
    Began
    | Asked
    | Answered
    | Outcome
    | Acted
    | Advised
    | Cluster
    | Excluded
    | Skipped
    | Undo
    | Edit
    | Round
    | Result
    | Imported
)
KINDS: Mapping[str, type] = {each.__name__.lower(): each for each in typing.get_args(Event)}


def to_plain(event: Event) -> tuple[str, dict[str, Any]]:
    """The kind of an event, a key of ``KINDS``, and its fields as JSON holds them."""
    return type(event).__name__.lower(), asdict(event)


def from_plain(kind: str, values: Mapping[str, Any]) -> Event:
    """The event of a kind with these fields.

    Raises:
        InputError: if there is no such kind, a field is missing, unknown or of another type.
    """
    check_choice("kind", kind, KINDS)
    hints = typing.get_type_hints(KINDS[kind])
    for name in values.keys() - hints.keys():
        raise InputError(f"unknown field {name!r}", place=kind, valid=hints)
    for field in fields(KINDS[kind]):
        if field.name not in values:
            raise InputError(f"field '{field.name}' is missing", place=kind)
        value, hint = values[field.name], hints[field.name]
        allowed = typing.get_args(hint) if isinstance(hint, types.UnionType) else (hint,)
        allowed = (*allowed, int) if float in allowed else allowed
        if type(value) not in allowed:
            wanted = " or ".join(each.__name__ for each in allowed)
            raise InputError(f"field '{field.name}' must be {wanted}, is {value!r:.60}", place=kind)
    return KINDS[kind](**values)


def hash_of_states(states: Sequence[int] | np.ndarray) -> str:
    """SHA-256 of a set of states, by their ascending indices."""
    return hashlib.sha256(np.unique(np.asarray(states, dtype="<i8")).tobytes()).hexdigest()
