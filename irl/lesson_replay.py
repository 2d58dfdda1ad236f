"""A recorded lesson learnt over again: the same events and rounds, so the same policy."""

from dataclasses import asdict, dataclass

from irl.choices import made
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.lesson import Lesson, versions
from irl.lesson_events import Began, Result, Round
from irl.lesson_taught import to_rows
from irl.policy import Policy
from irl.student import Learnt, Order, Student, StudentConfig, Subject

SUBJECT = "subject"
"""Where a lesson's configuration says what the learner was told beforehand."""


@dataclass(frozen=True, eq=False)
class Replayed:
    """A policy learnt over again.

    Attributes:
        policy: the policy.
        policy_hash: of it.
        recorded: the hash that the lesson holds.
        k: of which round.
        learnt: all that came of the round.
        differing: packages of another version than in the lesson, as ``name there → here``.
    """

    policy: Policy
    policy_hash: str
    recorded: str
    k: int
    learnt: Learnt
    differing: tuple[str, ...]

    @property
    def same(self) -> bool:
        """Whether it is the policy of the lesson, bit for bit."""
        return self.policy_hash == self.recorded


def began(subject: Subject, config: StudentConfig, initial: Demonstrations | None = None) -> Began:
    """The first event of a lesson about a subject."""
    plain = asdict(config) | {"rules": list(config.rules), SUBJECT: subject.fingerprint}
    rows, ends = to_rows(initial or Demonstrations.empty())
    return Began(subject.task_hash, plain, versions(), rows, ends)


def config_of(lesson: Lesson, subject: Subject) -> StudentConfig:
    """Who learns in a lesson.

    Raises:
        InputError: if the lesson is about something else, or its configuration is none.
    """
    lesson.require_task(subject.task_hash)
    kept = dict(lesson.began.config)
    if kept.pop(SUBJECT, None) != subject.fingerprint:
        raise InputError(
            "its learner was told other features, costs, factors or clusters than there are now",
            place=str(lesson.path),
        )
    return made(StudentConfig, kept | {"rules": tuple(kept.get("rules", ()))}, str(lesson.path))


def replay(lesson: Lesson, subject: Subject) -> Replayed:
    """Learn a lesson's last policy over again.

    Args:
        lesson: with one finished round at least.
        subject: what was taught.

    Raises:
        InputError: if no round was finished, or the lesson is about something else.
    """
    student = Student(subject, config_of(lesson, subject), lesson.initial)
    results = [event for event in lesson.events if isinstance(event, Result)]
    if not results:
        raise InputError("no round was finished; there is no policy yet", place=str(lesson.path))
    last = results[-1]
    rounds = [e for e in lesson.events if isinstance(e, Round) and e.k <= last.k]
    fresh = [place for place, event in enumerate(rounds) if event.fresh]
    if not fresh:
        raise InputError("no round starts anew; the first should", place=str(lesson.path))
    for event in rounds[fresh[-1] :]:
        learnt = student.learn(Order(event.k, event.fresh, lesson.events[: event.upto]))
    if learnt.policy is None:
        raise InputError(f"round {last.k} cannot be done ({learnt.error})", place=str(lesson.path))
    there, here = lesson.began.versions, versions()
    differing = tuple(
        f"{name} {there[name]} → {here.get(name)}"
        for name in sorted(there)
        if there[name] != here.get(name)
    )
    return Replayed(learnt.policy, learnt.policy_hash, last.policy_hash, last.k, learnt, differing)
