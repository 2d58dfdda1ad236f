"""What a lesson's events come to: runs, ends, advice, and what was refused."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from irl.demonstrations import SOURCES, Demonstrations
from irl.lesson_events import (
    AUDIT,
    DONE,
    HELD_OUT,
    LEARN,
    Advised,
    Answered,
    Cluster,
    Edit,
    Event,
    Excluded,
    Imported,
    Skipped,
    Undo,
)
from irl.lesson_standing import stands

_APART = 10**9
"""From here on runs are numbered that an edit parted from theirs."""


@dataclass
class Taught:
    """What was said and still holds, kept up with the events.

    Attributes:
        source: who shows, a name in ``irl.demonstrations.SOURCES``.
        events: all of them.
        answers: number of its event → answer, edits done, in order.
        advised: pieces of advice, in order.
        clusters: expressions of new clusters, in order.
        excluded: pairs (state, action) that no rule may label.
        skipped: states put aside.
        imports: what came from files, in order.
    """

    source: str = "human"
    events: list[Event] = field(default_factory=list)
    answers: dict[int, Answered] = field(default_factory=dict)
    advised: list[Advised] = field(default_factory=list)
    clusters: list[str] = field(default_factory=list)
    excluded: set[tuple[int, int]] = field(default_factory=set)
    skipped: set[int] = field(default_factory=set)
    imports: list[Imported] = field(default_factory=list)
    _edited: set[int] = field(default_factory=set)
    _of_run: dict[int, list[int]] = field(default_factory=dict)  # numbers of a run's answers

    @classmethod
    def of(cls, events: Iterable[Event], source: str = "human") -> "Taught":
        """Fold a lesson's events."""
        taught = cls(source)
        taught.add(list(events))
        return taught

    def add(self, events: Sequence[Event]) -> bool:
        """Take up more events; whether what held before holds still, as it did.

        Raises:
            InputError: as `stands`.
        """
        first = len(self.events) + 1
        self.events.extend(events)
        if not any(isinstance(event, Undo | Edit | Excluded) for event in events):
            for number, event in enumerate(events, start=first):
                self._take(number, event)
            return True
        for kept in (self.answers, self.advised, self.clusters, self.excluded, self.skipped):
            kept.clear()
        self.imports.clear()
        self._of_run.clear()
        said = stands(self.events)
        undone = {event.of for event in self.events if isinstance(event, Undo)}
        self._edited = {
            event.of
            for number, event in enumerate(self.events, start=1)
            if isinstance(event, Edit) and number not in undone
        }
        for number, event in said.items():
            self._take(number, event)
        return False

    def _take(self, number: int, event: Event) -> None:
        match event:
            case Answered():
                self.answers[number] = event
                self._of_run.setdefault(event.trajectory, []).append(number)
            case Advised():
                self.advised.append(event)
            case Cluster():
                self.clusters.append(event.cluster)
            case Excluded() if event.answer in self.answers:
                self.excluded |= {(int(s), int(a)) for s, a in event.pairs}
            case Skipped():
                self.skipped.add(event.state)
            case Imported():
                self.imports.append(event)
                self.advised += [Advised(*piece) for piece in event.advice]
                self.excluded |= {(int(s), int(a)) for s, a in event.excluded}

    def forget(self, upto: int) -> None:
        """Leave out what the events up to number ``upto`` say; edits of it are left out too."""
        rest = stands(self.events)
        for kept in (self.answers, self.advised, self.clusters, self.excluded, self.skipped):
            kept.clear()
        self.imports.clear()
        self._of_run.clear()
        for number, event in rest.items():
            if number > upto:
                self._take(number, event)

    def with_purpose(self, purpose: str) -> dict[int, Answered]:
        """The answers for a purpose, by number."""
        return {n: each for n, each in self.answers.items() if each.purpose == purpose}

    def run(self, trajectory: int) -> Demonstrations:
        """What was shown in one run, to learn from; empty if nothing is left of it.

        Where an answer was edited nobody knows what it would have led to: the run has a gap there.
        What was shown after an end is a run of its own.
        """
        pairs: list[tuple[int, int, int, int]] = []
        ends: list[tuple[int, int, int]] = []
        run, shift = trajectory, 0
        numbers = self._of_run.get(trajectory, [])
        for number in sorted(numbers, key=lambda n: (self.answers[n].step, n)):
            answer = self.answers[number]
            if answer.purpose != LEARN:
                continue
            if ends and ends[-1][0] == run:
                run = _APART + number
            if answer.action == DONE:
                ends.append((run, answer.step + shift, answer.state))
            else:
                pairs.append((run, answer.step + shift, answer.state, answer.action))
            shift += number in self._edited
        return _of_rows(pairs, self.source, ends)

    def advice_on(self, states_hash: str) -> Advised | None:
        """What was last advised of a set of states, whatever it was called; None if nothing."""
        found = [each for each in self.advised if each.states_hash == states_hash]
        return found[-1] if found else None

    @property
    def trajectories(self) -> list[int]:
        """Numbers of the runs to learn from, in the order they were begun."""
        return [
            number
            for number, answers in self._of_run.items()
            if any(self.answers[n].purpose == LEARN for n in answers)
        ]

    def first_state(self, trajectory: int) -> int:
        """Where a run began."""
        first = min(self._of_run[trajectory], key=lambda n: (self.answers[n].step, n))
        return self.answers[first].state

    def runs(self) -> list[Demonstrations]:
        """Every run to learn from, those of files included, in the order they were begun."""
        runs = [imported(each) for each in self.imports]
        return [*runs, *map(self.run, self.trajectories)]

    def demonstrations(self, purposes: Sequence[str] = (LEARN, AUDIT, HELD_OUT)) -> Demonstrations:
        """All that was shown for these purposes, as one set."""
        parts = self.runs() if LEARN in purposes else []
        others = [p for p in purposes if p != LEARN]
        parts += [
            self.label(answer)
            for purpose in others
            for answer in self.with_purpose(purpose).values()
        ]
        return Demonstrations.concatenate(parts)

    def label(self, answer: Answered) -> Demonstrations:
        """One answer by itself, under the number of its run."""
        at = answer.trajectory, answer.step, answer.state
        if answer.action == DONE:
            return _of_rows([], self.source, [at])
        return _of_rows([(*at, answer.action)], self.source, [])


def imported(event: Imported) -> Demonstrations:
    """The demonstrations that came from a file."""
    return from_rows(event.rows, event.ends)


def from_rows(rows: Sequence[Sequence], ends: Sequence[Sequence[int]]) -> Demonstrations:
    """Demonstrations from an event's rows: trajectory, step, state, action, source."""
    columns = [np.array([row[k] for row in rows], dtype=np.int64) for k in range(4)]
    sources = np.array([SOURCES.index(row[4]) for row in rows], dtype=np.uint8)
    trajectory, step, state, action = columns
    ended = np.array(ends, dtype=np.int64).reshape(-1, 3)
    return Demonstrations(trajectory, step, state, action, sources, ended)


def to_rows(demonstrations: Demonstrations) -> tuple[list, list]:
    """Rows and ends of demonstrations, as an event holds them."""
    d = demonstrations
    columns = [getattr(d, name).tolist() for name in ("trajectory", "step", "state", "action")]
    names = [SOURCES[k] for k in d.source.tolist()]
    return [list(row) for row in zip(*columns, names, strict=True)], d.ends.tolist()


def _of_rows(
    pairs: Sequence[tuple[int, int, int, int]], source: str, ends: Sequence[tuple[int, int, int]]
) -> Demonstrations:
    return from_rows([(*pair, source) for pair in pairs], ends)
