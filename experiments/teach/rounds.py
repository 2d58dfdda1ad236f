"""The learner beside a lesson: which rounds it does, and what came of the last one.

A round is written down before it begins, with the events that it may know of, and its result when
it ends. So a lesson can be learnt over again whatever the learner's and the teacher's speed.
"""

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, Protocol

from irl.lesson import Lesson
from irl.lesson_events import DONE, LEARN, Event, Result, Round, Undo
from irl.lesson_standing import SAID
from irl.lesson_taught import Taught
from irl.student import Learnt, Order, Student


class Learner(Protocol):
    """Does rounds, here or in a process of its own; it owns no truth, and may be killed."""

    def start(self, order: Order) -> None:
        """Begin a round; none is being done."""
        ...

    def poll(self) -> Learnt | None:
        """What came of it, once; None as long as nothing did."""
        ...

    def look(self, events: Sequence[Event]) -> None:
        """Begin to look for answers at odds with the rest, once no round is being done."""
        ...

    def odd(self) -> list[dict[str, Any]] | None:
        """What it found, once; None as long as it looks."""
        ...

    @property
    def lost(self) -> bool:
        """Whether it knows no more what it learnt, such as a process started anew; asked once."""
        ...


@dataclass
class LocalLearner:
    """Does its rounds at once, in this process."""

    student: Student
    lost: bool = False
    _learnt: Learnt | None = field(default=None, init=False)
    _odd: list[dict[str, Any]] | None = field(default=None, init=False)

    def start(self, order: Order) -> None:
        """Do a round."""
        self._learnt = self.student.learn(order)

    def poll(self) -> Learnt | None:
        """What came of it."""
        learnt, self._learnt = self._learnt, None
        return learnt

    def look(self, events: Sequence[Event]) -> None:
        """Look at once."""
        self._odd = self.student.at_odds(events)

    def odd(self) -> list[dict[str, Any]] | None:
        """What was found."""
        odd, self._odd = self._odd, None
        return odd


@dataclass
class ThreadLearner:
    """Does its rounds in a thread, while a terminal waits for a line."""

    student: Student
    lost: bool = False
    _pool: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(1), init=False)
    _round: "Future[Learnt] | None" = field(default=None, init=False)
    _odd: "Future[list[dict[str, Any]]] | None" = field(default=None, init=False)

    def start(self, order: Order) -> None:
        """Begin a round."""
        self._round = self._pool.submit(self.student.learn, order)

    def poll(self) -> Learnt | None:
        """What came of it, once it did.

        Raises:
            Exception: whatever ended the round, if something did.
        """
        if self._round is None or not self._round.done():
            return None
        done, self._round = self._round, None
        return done.result()

    def look(self, events: Sequence[Event]) -> None:
        """Look when the round is over."""
        self._odd = self._pool.submit(self.student.at_odds, list(events))

    def odd(self) -> list[dict[str, Any]] | None:
        """What was found."""
        if self._odd is None or not self._odd.done():
            return None
        done, self._odd = self._odd, None
        return done.result()


@dataclass
class Rounds:
    """Rounds of one lesson.

    Attributes:
        lesson: the file.
        learner: who does them.
        running: number of the round being done, or None.
        learnt: what came of the last that could be done, in this run of the program.
        error: why the last one could not be done; empty if it could.
        odd: all answers, those at odds with the rest first, when last looked; None before.
        looked: how many events there were then.
        looking: whether they are being looked for.
    """

    lesson: Lesson
    learner: Learner
    running: int | None = field(default=None, init=False)
    learnt: Learnt | None = field(default=None, init=False)
    error: str = field(default="", init=False)
    odd: list[dict[str, Any]] | None = field(default=None, init=False)
    looked: int = field(default=0, init=False)
    looking: bool = field(default=False, init=False)
    _fresh: bool = field(default=True, init=False)
    _upto: int = field(default=0, init=False)

    @property
    def next(self) -> int:
        """The number of the next round."""
        numbers = [event.k for event in self.lesson.events if isinstance(event, Round)]
        return max(numbers, default=-1) + 1

    @property
    def news(self) -> bool:
        """Whether something was said since the last round began."""
        return self.said_since(self._upto)

    def said_since(self, upto: int) -> bool:
        """Whether something was said after so many events."""
        return any(isinstance(e, (*SAID, Undo)) for e in self.lesson.events[upto:])

    def look(self) -> None:
        """Look for answers at odds with the rest, unless nothing was said since that was done."""
        if not self.looking and (self.odd is None or self.said_since(self.looked)):
            self.looking, self.looked = True, len(self.lesson.events)
            self.learner.look(self.lesson.events)

    def found(self) -> bool:
        """Take up what was found; whether something was."""
        odd = self.learner.odd() if self.looking else None
        if odd is not None:
            self.odd, self.looking = odd, False
        return odd is not None

    def begin(self, taught: Taught) -> bool:
        """Begin a round if there is something new to learn from, and none is being done."""
        if self.learner.lost:
            self._fresh, self.running = True, None
            if self.looking:
                self.learner.look(self.lesson.events)
        elif self.running is not None or not (self.news or self._fresh):
            return False
        if not can_be_learnt(self.lesson, taught):
            return False
        k, self._upto = self.next, len(self.lesson.events)
        self.lesson.append(Round(k, self._upto, self._fresh))
        self.running = k
        order = Order(k, self._fresh, self.lesson.events[: self._upto])
        self._fresh = False
        self.learner.start(order)
        return True

    def poll(self) -> bool:
        """Take up what came of a round; whether something did."""
        learnt = self.learner.poll()
        if learnt is None or learnt.k != self.running:
            return False
        self.running, self.error = None, learnt.error
        if learnt.policy is not None:
            told = {"enough": learnt.enough.enough, "stands_in": learnt.enough.stands_in}
            self.lesson.append(Result(learnt.k, learnt.policy_hash, told | learnt.enough.figures))
            self.learnt = learnt
        return True


def can_be_learnt(lesson: Lesson, taught: Taught) -> bool:
    """Whether a learner has one label to learn from."""
    if lesson.began.initial or any(event.rows for event in taught.imports):
        return True
    return any(a.purpose == LEARN and a.action != DONE for a in taught.answers.values())
