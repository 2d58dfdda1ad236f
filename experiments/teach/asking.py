"""What is asked next: the episode's next state, or what the learner wants to know most."""

import secrets
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from experiments.teach.shown import Reasons, Shown, unexplained
from experiments.teach.worlds import World
from irl.asking import (
    ADVICE,
    STATE,
    STEP,
    TRAJECTORY,
    Offer,
    Worth,
    choose,
    measured_seconds,
)
from irl.lesson import Lesson
from irl.lesson_events import (
    AUDIT,
    LEARN,
    Acted,
    Answered,
    Asked,
    Imported,
    Outcome,
    Skipped,
    Undo,
)
from irl.lesson_taught import Taught
from irl.session import RETEST, START, Question
from irl.student import Learnt

RUN, EPISODE, AGAIN = "run", "episode", "again"
"""Strategies of the desk's own: a new trajectory; its next state; an answer that was taken back."""
LONGEST = 50
"""Steps after which an episode is broken off."""

SUGGESTED = {
    STEP: "to go on from here",
    STATE: "one state by itself",
    TRAJECTORY: "a new trajectory from a start",
    ADVICE: "advice where {}",
}


@dataclass(frozen=True)
class Suggestion:
    """What had best be asked next, and that in words."""

    worth: Worth
    words: str

    @property
    def kind(self) -> str:
        """A name in `irl.asking.KINDS`."""
        return self.worth.offer.kind


@dataclass
class Asking:
    """Chooses questions, and makes of each what is shown.

    Attributes:
        world: what is taught.
        lesson: the file, which is only read.
        taught: what was said so far.
        seed: of what is drawn by chance.
        queue: questions of the last round that were not asked yet, best first.
        reasons: of the last round; None before any.
        k: number of the last round; −1 before any.
        synchronous: whether it asks what Algorithm 4.1 would.
    """

    world: World
    lesson: Lesson
    taught: Taught
    seed: int
    queue: list[Question] = field(default_factory=list)
    reasons: Reasons | None = None
    k: int = -1
    synchronous: bool = False
    _highest: int = -1

    def __post_init__(self) -> None:
        """Note which trajectories there are."""
        self.note(0)

    def note(self, first: int) -> None:
        """Take note of the events from ``events[first]`` on."""
        began = self.lesson.began
        rows = [*began.initial, *began.ends] if first == 0 else []
        for event in self.lesson.events[first:]:
            if isinstance(event, Asked | Answered | Acted):
                rows.append([event.trajectory])
            elif isinstance(event, Imported):
                rows += [*event.rows, *event.ends]
        self._highest = max([self._highest, *(row[0] for row in rows)])

    def take_up(self, learnt: Learnt) -> None:
        """Choose by what came of a round."""
        self.queue, self.k = list(learnt.questions), learnt.k
        self.reasons = Reasons(self.world, learnt)

    def next(self) -> Question:
        """What the learner wants to know most; a trajectory from a start if it doesn't say.

        A toss-up is not asked about, but where Algorithm 4.1 would.
        """
        answered = {a.state for a in self.taught.answers.values()} | self.taught.skipped
        while self.queue:
            question = self.queue.pop(0)
            if question.state in answered and question.strategy != RETEST:
                continue
            if self.synchronous or question.purpose != LEARN or not self._toss_up(question.state):
                return question
        return Question(self.start(), START if not self.taught.answers else RUN, 0.0)

    def suggestion(self, asked: Shown | None) -> Suggestion | None:
        """What would tell the learner most for the teacher's time, after the first trajectory.

        Args:
            asked: the question that is open.

        Returns:
            None before anything was learnt, while the learner is tested, if nothing is expected
            to tell anything, and where Algorithm 4.1 says what is asked.
        """
        reasons = self.reasons
        if reasons is None or self.synchronous or (asked is not None and asked.purpose == AUDIT):
            return None
        answered = {a.state for a in self.taught.answers.values()} | self.taught.skipped
        states = [q.state for q in self.queue if q.purpose == LEARN and q.state not in answered]
        offers = []
        if asked is not None and asked.step:
            offers.append(Offer(STEP, reasons.gain(np.array([asked.state])), state=asked.state))
        elif asked is not None and asked.strategy not in (START, RUN):
            states.append(asked.state)
        offers += [Offer(STATE, reasons.gain(np.array([s])), state=s) for s in states]
        length = self._usual_length()
        offers.append(Offer(TRAJECTORY, reasons.gain(reasons.on_my_way), length))
        advised = {each.cluster for each in self.taught.advised}
        offers += [
            Offer(ADVICE, reasons.gain(members), cluster=name)
            for name, members in self.world.clusters.items()
            if name not in advised
        ]
        worth = choose(offers, measured_seconds(self._times()), reasons.left)
        return None if worth is None else Suggestion(worth, self._said(worth))

    def _said(self, worth: Worth) -> str:
        offer = worth.offer
        where = self.world.cluster_words(offer.cluster) if offer.cluster else ""
        what = SUGGESTED[offer.kind].format(where)
        bits = worth.gain / np.log(2)
        return (
            f"What tells me most for your time: {what} ({bits:.2g} bits in {worth.seconds:.0f} s)."
        )

    def _times(self) -> list[tuple[str, float]]:
        """Kind and seconds of all that was said and holds."""
        whole = {
            event.trajectory
            for event in self.lesson.events
            if isinstance(event, Asked) and event.step == 0 and event.strategy in (START, RUN)
        }
        times = [
            (STEP if a.step else TRAJECTORY if a.trajectory in whole else STATE, a.seconds)
            for a in self.taught.answers.values()
        ]
        return times + [(ADVICE, each.seconds) for each in self.taught.advised]

    def _usual_length(self) -> int:
        """Answers that a trajectory takes: the median of those with more than one."""
        runs = Counter(a.trajectory for a in self.taught.answers.values())
        return int(np.median([n for n in runs.values() if n > 1] or [1]))

    def _toss_up(self, state: int) -> bool:
        return self.reasons is not None and self.reasons.toss_up(state)

    def start(self) -> int:
        """Where a new trajectory may begin, drawn by chance."""
        return int(self.chance().choice(self.world.subject.problem.start_states))

    def chance(self) -> np.random.Generator:
        """A generator for this moment of the lesson."""
        return np.random.default_rng([self.seed, len(self.lesson.events)])

    def new_trajectory(self) -> int:
        """A number that no run has."""
        return self._highest + 1

    def event(self, question: Question, trajectory: int | None = None, step: int = 0) -> Asked:
        """The event of a question that is about to be shown, with a new token."""
        proposed = question.proposed
        if proposed is None and self.reasons is not None:
            proposed = self.reasons.proposed(question.state)
        return Asked(
            question.state,
            question.strategy,
            round(question.score, 6),
            self.k,
            self.new_trajectory() if trajectory is None else trajectory,
            step,
            proposed,
            question.purpose,
            secrets.token_hex(8),
        )

    def shown(self, number: int, asked: Asked) -> Shown:
        """A question that was asked, as it is shown."""
        world, reasons, state = self.world, self.reasons, asked.state
        states = [answer.state for answer in self.taught.answers.values()]
        answered = np.unique(np.array([*self.lesson.initial.state, *states], dtype=np.int64))
        why = unexplained(world, state, asked.strategy, answered)
        if reasons is not None:
            why = reasons.why(state, asked.strategy, answered)
        return Shown(
            asked.token,
            number,
            state,
            asked.trajectory,
            asked.step,
            asked.strategy,
            asked.purpose,
            asked.proposed,
            () if reasons is None else reasons.top(state),
            tuple(world.model.actions_of(state).tolist()),
            0.0 if reasons is None else reasons.sure(state),
            why,
            world.say_state(state),
        )

    def is_run(self, trajectory: int) -> bool:
        """Whether a run began as a whole trajectory, not with a question of the learner's."""
        for event in self.lesson.events:
            if isinstance(event, Asked) and event.trajectory == trajectory:
                return event.strategy in (START, RUN)
        return False

    def open_question(self) -> tuple[int, Asked] | None:
        """The question that was shown last and not answered, with its number."""
        for number in range(len(self.lesson.events), 0, -1):
            event = self.lesson.events[number - 1]
            if isinstance(event, Asked):
                return None if self.lesson.used(event.token) else (number, event)
            if isinstance(event, Answered | Outcome | Skipped | Undo):
                return None
        return None
