"""The learner in a process of its own: it may be slow or killed, and no answer waits for it.

It owns no truth. What it needs it is told, from the lesson; if it dies, another one begins anew.
"""

import os
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from typing import Any

from experiments.teach.page.link import Link
from experiments.teach.worlds import World
from irl.demonstrations import Demonstrations
from irl.lesson_events import Event
from irl.student import Learnt, Order, Student, StudentConfig

_BEHIND = 10
"""How far it steps back, as `nice` counts it, where somebody waits for the page."""


class ProcessLearner:
    """Does rounds elsewhere; a `Learner`, for `experiments.teach.rounds.Rounds`.

    Attributes:
        link: the way to the process.
    """

    def __init__(
        self,
        build: Callable[..., World],
        arguments: tuple,
        config: StudentConfig,
        initial: Demonstrations,
        heard: Callable[[], None],
    ) -> None:
        """Prepare a learner; `Link.start` begins its process.

        Args:
            build: makes the world there, of ``arguments``.
            arguments: see there.
            config: who learns.
            initial: what was demonstrated before the first question.
            heard: is called when a round is over, or the process was begun anew.
        """
        self.link = Link(_work, (build, arguments, config, initial), self._hear, self._begin)
        self._heard = heard
        self._learnt: Learnt | None = None
        self._odd: list[dict[str, Any]] | None = None
        self._lost = False
        self._shipped = 0

    def start(self, order: Order) -> None:
        """Begin a round; only events that the process does not know are sent."""
        self._ship(order.k, order.fresh, order.events)

    def look(self, events: Sequence[Event]) -> None:
        """Look there, once the round is over."""
        self._ship(None, False, events)

    def _ship(self, k: int | None, fresh: bool, events: Sequence[Event]) -> None:
        self.link.tell((k, fresh, list(events[self._shipped :])))
        self._shipped = len(events)

    def poll(self) -> Learnt | None:
        """What came of the last round, once."""
        learnt, self._learnt = self._learnt, None
        return learnt

    def odd(self) -> list[dict[str, Any]] | None:
        """What was found, once."""
        odd, self._odd = self._odd, None
        return odd

    @property
    def lost(self) -> bool:
        """Whether the process is another one than before; says so once."""
        lost, self._lost = self._lost, False
        return lost

    def _hear(self, told: Learnt | list[dict[str, Any]]) -> None:
        if isinstance(told, Learnt):
            self._learnt = told
        else:
            self._odd = told
        self._heard()

    def _begin(self) -> None:
        self._lost, self._shipped = self.link.starts > 1, 0
        self._learnt = self._odd = None
        if self._lost:
            self._heard()


def _work(
    connection: Connection,
    build: Callable[..., World],
    arguments: tuple,
    config: StudentConfig,
    initial: Demonstrations,
) -> None:
    """What the process does: one round after another, on one thread."""
    import torch  # noqa: PLC0415 - the server does not wait for it

    torch.set_num_threads(1)
    os.nice(_BEHIND)
    student = Student(build(*arguments).subject, config, initial)
    events: list[Event] = []
    while True:
        k, fresh, new = connection.recv()
        events += new
        if k is None:
            connection.send(student.at_odds(events))
        else:
            connection.send(student.learn(Order(k, fresh, events)))
