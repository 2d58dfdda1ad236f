"""What is asked next: the episode's next state, or what the learner wants to know most."""

import secrets
from dataclasses import dataclass, field

import numpy as np

from experiments.teach.shown import Reasons, Shown, unexplained
from experiments.teach.worlds import World
from irl.lesson import Lesson
from irl.lesson_events import (
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
    """

    world: World
    lesson: Lesson
    taught: Taught
    seed: int
    queue: list[Question] = field(default_factory=list)
    reasons: Reasons | None = None
    k: int = -1
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
        """What the learner wants to know most; a trajectory from a start if it doesn't say."""
        answered = {a.state for a in self.taught.answers.values()} | self.taught.skipped
        while self.queue:
            question = self.queue.pop(0)
            if question.state not in answered or question.strategy == RETEST:
                return question
        return Question(self.start(), START if not self.taught.answers else RUN, 0.0)

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
