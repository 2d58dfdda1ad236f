"""The learner in a process of its own: it may be slow or killed, and no answer waits for it.

It owns no truth. What it needs it is told, from the lesson; if it dies, another one begins anew.
"""

from collections.abc import Callable
from multiprocessing.connection import Connection

from experiments.teach.page.link import Link
from experiments.teach.worlds import World
from irl.demonstrations import Demonstrations
from irl.lesson_events import Event
from irl.student import Learnt, Order, Student, StudentConfig


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
        self._lost = False
        self._shipped = 0

    def start(self, order: Order) -> None:
        """Begin a round; only events that the process does not know are sent."""
        self.link.tell((order.k, order.fresh, list(order.events[self._shipped :])))
        self._shipped = len(order.events)

    def poll(self) -> Learnt | None:
        """What came of the last round, once."""
        learnt, self._learnt = self._learnt, None
        return learnt

    @property
    def lost(self) -> bool:
        """Whether the process is another one than before; says so once."""
        lost, self._lost = self._lost, False
        return lost

    def _hear(self, learnt: Learnt) -> None:
        self._learnt = learnt
        self._heard()

    def _begin(self) -> None:
        self._lost, self._shipped, self._learnt = self.link.starts > 1, 0, None
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
    student = Student(build(*arguments).subject, config, initial)
    events: list[Event] = []
    while True:
        k, fresh, new = connection.recv()
        events += new
        connection.send(student.learn(Order(k, fresh, events)))
