"""What is asked next: the episode's next state, or what the learner wants to know most."""

import secrets
from dataclasses import dataclass, field, replace

import numpy as np

from experiments.teach.choosing import RUN, Choosing, Suggestion
from experiments.teach.shown import Reasons, Shown, unexplained
from experiments.teach.worlds import World
from irl.asking import STEP, TRAJECTORY
from irl.lesson import Lesson
from irl.lesson_events import (
    AUDIT,
    DONE,
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
from irl.session import GOAL, RETEST, START, Question
from irl.student import Learnt

EPISODE, AGAIN, PICKED = "episode", "again", "picked"
"""Strategies of the desk's own: an episode's next state; an answer that was taken back; a state
that the teacher picked."""
LONGEST = 50
"""Steps after which an episode is broken off."""
SURE = 0.95
"""From this probability that its choice will do the robot acts without asking."""
WORTH = 0.1
"""From this gain on an episode is left for another question, or advice asked for [nats]."""


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
        leads: whether it chooses the kind of question too, by what that is worth; else episodes go
            on to their end, and then the learner's own questions come.
    """

    world: World
    lesson: Lesson
    taught: Taught
    seed: int
    queue: list[Question] = field(default_factory=list)
    reasons: Reasons | None = None
    k: int = -1
    synchronous: bool = False
    leads: bool = True
    _highest: int = -1

    def __post_init__(self) -> None:
        """Note which trajectories there are."""
        self._choosing = Choosing(self.world, self.lesson, self.taught)
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
        """What is worth most of the teacher's time: a state of the queue, or a new trajectory.

        Tests come first, and what is taken for a goal. A toss-up is not asked about, but where
        Algorithm 4.1 would.
        """
        self.queue = [question for question in self.queue if self._is_open(question)]
        run = Question(self.start(), START if not self.taught.answers else RUN, 0.0)
        if not self.queue:
            return run
        chosen = self.queue[0]
        if self._weighs and chosen.purpose == LEARN and chosen.strategy != GOAL:
            states = {q.state: q for q in self.queue if q.purpose == LEARN}
            assert self.reasons is not None
            best = self._choosing.best(self.reasons, list(states), advice=False)
            if best is not None and best.kind == TRAJECTORY:
                return run
            if best is not None and best.worth.offer.state is not None:
                chosen = states[best.worth.offer.state]
        self.queue.remove(chosen)
        return chosen

    def leaves(self, state: int) -> bool:
        """Whether an episode had better be left where it came to a state.

        Where another kind of question tells more for the teacher's time; not where the robot is
        sure and goes on by itself, nor before a trajectory was shown to its end.
        """
        if not self._weighs or not self._ended:
            return False
        assert self.reasons is not None
        if self.reasons.sure(state) >= SURE or not self.reasons.knows(state):
            return False
        open_ = [q for q in self.queue if self._is_open(q)]
        if any(q.purpose == AUDIT for q in open_):
            return False
        states = [q.state for q in open_ if q.state != state]
        best = self._choosing.best(self.reasons, states, step=state, advice=False)
        return best is not None and best.kind != STEP and best.worth.gain >= WORTH

    def suggestion(self, asked: Shown | None) -> Suggestion | None:
        """What would tell the learner most for the teacher's time, after the first trajectory.

        Args:
            asked: the question that is open.

        Returns:
            None before anything was learnt, while the learner is tested, if nothing is expected
            to tell anything, and where Algorithm 4.1 says what is asked.
        """
        if self.reasons is None or self.synchronous:
            return None
        if asked is not None and asked.purpose == AUDIT:
            return None
        states = [q.state for q in self.queue if q.purpose == LEARN and self._is_open(q)]
        step = None
        if asked is not None and asked.step:
            step = asked.state
        elif asked is not None and asked.strategy not in (START, RUN):
            states.append(asked.state)
        return self._choosing.best(self.reasons, states, step=step)

    @property
    def _weighs(self) -> bool:
        """Whether the kind of question is chosen by what it is worth."""
        return self.leads and not self.synchronous and self.reasons is not None

    @property
    def _ended(self) -> bool:
        """Whether anything was shown to its end."""
        return bool(
            self.lesson.initial.ends.size
            or any(a.action == DONE for a in self.taught.answers.values())
            or any(event.ends for event in self.taught.imports)
        )

    def _is_open(self, question: Question) -> bool:
        """Whether a question of the queue is worth asking still."""
        answered = {a.state for a in self.taught.answers.values()} | self.taught.skipped
        if question.state in answered and question.strategy != RETEST:
            return False
        return self.synchronous or question.purpose != LEARN or not self._toss_up(question.state)

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

    def looked_at_again(self, shown: Shown) -> Shown:
        """An open question after a round: why it is asked, the favourites, and what is proposed.

        Something that was proposed before stays so.
        """
        asked = self.lesson.events[shown.number - 1]
        assert isinstance(asked, Asked)
        if asked.proposed is None and self.reasons is not None:
            asked = replace(asked, proposed=self.reasons.proposed(asked.state))
        return self.shown(shown.number, asked)

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
