"""Who learns in a lesson: round after round from its events, to the same policies each time.

A lesson says before each round up to which event it learns, and whether it starts anew. So what
was learnt depends on what was said, never on how fast; `irl.lesson_replay` does it over again.
"""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from irl.asking import looked_at, visits
from irl.checkpoint import fingerprint
from irl.choices import Limits, Settings
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.generalisation import Generalisation
from irl.lesson_events import Event
from irl.lesson_taught import Taught
from irl.policy import Policy
from irl.problem import LearningProblem
from irl.session import Question, Session, policy_hash
from irl.session_settled import Enough

if TYPE_CHECKING:
    from irl.active_config import Progress


@dataclass(frozen=True, eq=False)
class Subject:
    """What is taught.

    Attributes:
        problem: what is known beforehand.
        task_hash: hash of the task data, or another name of what the problem is.
        generalisation: what follows from a demonstrated pair.
    """

    problem: LearningProblem
    task_hash: str
    generalisation: Generalisation = field(default_factory=Generalisation.none)

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256 of all that a learner is told beforehand, besides the task."""
        problem = self.problem
        told = [np.array([problem.gamma]), problem.start_states]
        told += [] if problem.features is None else [problem.features]
        told += [] if problem.candidates is None else [problem.candidates]
        named: Mapping[str, np.ndarray] = {
            **{f"cost {name}": np.asarray(cost) for name, cost in problem.costs.items()},
            **{f"factor {name}": np.asarray(each) for name, each in problem.factors.items()},
            **{f"cluster {name}": np.asarray(each) for name, each in problem.clusters.items()},
        }
        names = hashlib.sha256("\n".join(named).encode()).hexdigest()
        vr = sorted((int(s), float(v)) for s, v in problem.fixed_vr.items())
        return fingerprint(*told, np.array(vr), *named.values(), np.array([int(names[:12], 16)]))


@dataclass(frozen=True)
class StudentConfig(Settings):
    """Who learns, and how."""

    method: str = "goal_posterior"
    """The learner: a key of `irl.methods.METHODS`. The default learns most from few answers."""
    seed: Annotated[int, Limits(0, 2**32 - 1)] = 0
    """The seed of all that it draws."""
    queue: Annotated[int, Limits(1, 1000)] = 6
    """How many questions are proposed in each round."""
    rules: tuple[str, ...] = ()
    """The generalisation rules that label pairs which follow from what was shown."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Of the learner: fields of ``ActiveConfig`` for ``fa_mlirl``, of ``GoalConfig`` for
    ``goal_posterior``, ``strategy`` and the method's own for others."""


@dataclass(frozen=True)
class Order:
    """Which round to do next: its number, whether to start anew, and all events to learn from."""

    k: int
    fresh: bool
    events: Sequence[Event]


@dataclass(frozen=True, eq=False)
class Learnt:
    """What came of a round.

    Attributes:
        k: number of the round.
        policy: what it would do; None if the round could not be done.
        policy_hash: of it, `irl.session.policy_hash`; empty if there is none.
        questions: what to ask next, best first.
        enough: whether it has learnt enough, and why.
        sure: probability that the policy's action will do, float32 ``[n_states]``, 0 where nothing
            can be done.
        error: why the round could not be done; empty if it was.
        arrived: states that it takes for goals, bool ``[n_states]``.
        gain: what an answer is expected to tell, in nats, float32 ``[n_states]``; 0 in toss-ups
            and where one was given, NaN in the many states where it was not worked out.
        left: all that is left to learn, in nats; infinite where the learner cannot tell.
        toss_up: where the learner is sure that several actions will do, bool ``[n_states]``.
    """

    k: int
    policy: Policy | None
    policy_hash: str
    questions: list[Question]
    enough: Enough
    sure: np.ndarray
    error: str = ""
    arrived: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=bool))
    gain: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.float32))
    left: float = np.inf
    toss_up: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=bool))


class Student:
    """Learns round by round."""

    def __init__(self, subject: Subject, config: StudentConfig, initial: Demonstrations) -> None:
        """Nothing is learnt yet; ``initial`` is what was demonstrated before the first question."""
        self.subject, self.config, self._initial = subject, config, initial
        self._session: Session | None = None

    def learn(self, order: Order, callback: "Callable[[Progress], None] | None" = None) -> Learnt:
        """Do one round."""
        # Torch, which a server that leaves learning to another process does without.
        from irl.session_begin import begin_session  # noqa: PLC0415

        model, config = self.subject.problem.model, self.config
        if order.fresh or self._session is None:
            self._session = begin_session(self.subject, config, self._initial, order.k)
        session = self._session
        try:
            session.apply(order.events[len(session.taught.events) :])
            session.refit(callback)
        except InputError as error:
            enough = Enough(False, str(error), True, {})
            return Learnt(order.k, None, "", [], enough, np.zeros(model.n_states), str(error))
        policy = session.policy(task_hash=self.subject.task_hash, seed=config.seed)
        acting = np.flatnonzero(policy.action >= 0)
        sure = np.zeros(model.n_states, dtype=np.float32)
        sure[acting] = session.sure(acting)
        questions = session.propose(config.queue)
        gain, even = self._worth(session, policy, acting, questions)
        return Learnt(
            order.k,
            policy,
            policy_hash(policy),
            questions,
            session.enough(),
            sure,
            arrived=session.arrived(),
            gain=gain,
            left=session.left,
            toss_up=even,
        )

    def at_odds(self, events: Sequence[Event]) -> list[dict[str, Any]]:
        """All answers of these events, those at odds with the rest first: `irl.lesson_odds`.

        For this all of them are learnt anew, by a posterior, whoever else learns.
        """
        from irl.lesson_odds import at_odds  # noqa: PLC0415 - torch, as above

        rng = np.random.default_rng(self.config.seed)
        return at_odds(self.subject.problem, self._initial, Taught.of(events), rng)

    def _worth(
        self, session: Session, policy: Policy, acting: np.ndarray, questions: Sequence[Question]
    ) -> tuple[np.ndarray, np.ndarray]:
        """What answers would tell, and where there are toss-ups; see `Learnt`."""
        problem = self.subject.problem
        model, asked = problem.model, np.array([q.state for q in questions], dtype=np.int64)
        gain = np.full(model.n_states, np.nan, dtype=np.float32)
        even = np.zeros(model.n_states, dtype=bool)
        if acting.size:
            visited = visits(model, policy.action, problem.start_states)
            some = looked_at(acting, visited, asked)
            even[some] = session.toss_up(some)
            gain[some] = np.where(even[some], 0.0, np.maximum(session.gain(some), 0.0))
            gain[np.intersect1d(some, session.known)] = 0.0
        return gain, even
