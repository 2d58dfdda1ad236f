"""What a lesson's desk writes down, and what it may: the part of `desk` that nobody sees."""

from dataclasses import dataclass, field

import numpy as np

from experiments.teach.asking import EPISODE, LONGEST, Asking
from experiments.teach.choosing import Suggestion
from experiments.teach.rounds import Learner, Rounds
from experiments.teach.shown import Shown
from experiments.teach.worlds import World
from irl.clusters import intersection
from irl.errors import InputError
from irl.lesson import Lesson
from irl.lesson_events import (
    AUDIT,
    DONE,
    HELD_OUT,
    LEARN,
    Advised,
    Asked,
    Edit,
    Event,
    Imported,
)
from irl.lesson_replay import config_of
from irl.lesson_standing import stands
from irl.lesson_taught import Taught
from irl.session import Question

TENTH = 10
"""Of so many answers one is held out, if the teacher wishes."""


@dataclass(frozen=True)
class DeskConfig:
    """How a lesson is led.

    Attributes:
        synchronous: a round after each answer, and no episodes but the first trajectory.
        hold_out: whether every tenth answer is held out, to judge the policy by.
    """

    synchronous: bool = False
    hold_out: bool = False


@dataclass
class Notes:
    """One lesson's file, and what is asked.

    Attributes:
        world: what is taught.
        lesson: the file; this is its only writer.
        learner: who learns.
        config: how it is led.
        student: the learner's settings.
        taught: what was said so far.
        rounds: what was learnt so far.
        asking: what is asked next.
        question: what is asked now.
    """

    world: World
    lesson: Lesson
    learner: Learner
    config: DeskConfig = field(default_factory=DeskConfig)

    def __post_init__(self) -> None:
        """Take up a lesson where it stands, the open question included."""
        self.student = config_of(self.lesson, self.world.subject)
        self.taught = Taught.of(self.lesson.events)
        self.rounds = Rounds(self.lesson, self.learner)
        self.asking = Asking(self.world, self.lesson, self.taught, self.student.seed)
        self.asking.synchronous = self.config.synchronous
        self.question: Shown | None = None
        open_ = self.asking.open_question()
        if open_ is not None:
            self.question = self.asking.shown(*open_)

    @property
    def suggestion(self) -> Suggestion | None:
        """What had best be asked next for the teacher's time; None if nothing can be said."""
        return self.asking.suggestion(self.question)

    def _next(self) -> None:
        self._say([self.asking.event(self.asking.next())])

    def _say(self, events: list[Event], token: str | None = None) -> bool:
        """Write events down and take them up; whether they were new under their token.

        The last of them is the question shown from now on, if it is one; an answer leaves none.
        """
        if self.lesson.append(events, token) is None:
            return False
        self._keep_up()
        last = events[-1]
        if isinstance(last, Asked):
            self.question = self.asking.shown(len(self.lesson.events), last)
        elif token is not None and self.question is not None and token == self.question.token:
            self.question = None
        return True

    def _keep_up(self) -> None:
        """Take up what is in the file by now, rounds and their results included."""
        first = len(self.taught.events)
        self.taught.add(self.lesson.events[first:])
        self.asking.note(first)

    def _instead(self, said: Advised) -> list[Event]:
        """Edits that put advice in the place of what was advised of the same states; maybe none.

        Where several pieces are about them, the last gets it and the others are emptied.
        """
        edits: list[Event] = []
        good, bad = said.preferred, said.avoided
        for number, event in reversed(stands(self.lesson.events).items()):
            if isinstance(event, Advised) and event.states_hash == said.states_hash:
                edits.append(Edit(number, {"preferred": good, "avoided": bad}))
            elif isinstance(event, Imported):
                pieces = [Advised(*piece) for piece in event.advice]
                same = [k for k, p in enumerate(pieces) if p.states_hash == said.states_hash]
                if not same:
                    continue
                advice = [list(piece) for piece in event.advice]
                for k in same:
                    advice[k][2:4] = ([], []) if k != same[-1] else (good, bad)
                edits.append(Edit(number, {"advice": advice}))
            else:
                continue
            good, bad = [], []
        return edits[::-1]

    def _onward(self, asked: Shown, action: int, came: int) -> list[Event]:
        """The question that goes on with an episode, if it goes on."""
        alone = self.config.synchronous and not self.asking.is_run(asked.trajectory)
        over = asked.step + 1 >= LONGEST or not self.world.model.widths[came]
        if alone or over or asked.purpose == AUDIT:
            return []
        step = asked.step + 1 + (not self._leads(asked.state, action, came))
        return [self.asking.event(Question(came, EPISODE, 0.0), asked.trajectory, step)]

    def _is_held_out(self, asked: Shown, action: int) -> bool:
        """Whether one in ten is due; one that can be: of an end or a test it waits for the next."""
        held = len(self.taught.with_purpose(HELD_OUT))
        due = len(self.taught.answers) + 1 >= TENTH * (held + 1)
        return self.config.hold_out and due and asked.purpose == LEARN and action != DONE

    def _drawn(self, state: int, action: int) -> int:
        return self.world.model.sample(state, action, self.asking.chance())

    def _leads(self, state: int, action: int, to: int) -> bool:
        """Whether an action may lead there, by the model."""
        if action == DONE:
            return False
        pair = int(self.world.model.pair_index(state, action))
        return bool(self.world.model.P[pair, to] > 0)

    def _following(self, state: int, action: int) -> tuple[tuple[int, int], ...]:
        rules = list(self.student.rules)
        if action == DONE or not rules:
            return ()
        states, actions = self.world.subject.generalisation.following(state, action, rules)
        return tuple(dict.fromkeys(zip(states.tolist(), actions.tolist(), strict=True)))

    def _require(self, state: int, action: int) -> None:
        """Refuse what cannot be done."""
        self._require_state(state)
        model = self.world.model
        feasible = model.actions_of(state).tolist()
        if action != DONE and action not in feasible:
            raise InputError(
                f"action {action} is not feasible in state {state}",
                place="answer",
                valid=[*feasible, DONE],
            )

    def _require_state(self, state: int) -> None:
        """Refuse a state that there is none of."""
        n = self.world.model.n_states
        if not 0 <= state < n:
            raise InputError(f"no state {state}; they are 0…{n - 1}", place="answer")

    def members(self, cluster: str) -> np.ndarray:
        """The states of a cluster, or of an intersection such as ``"a ∩ b"``."""
        return intersection(self.world.clusters, cluster)

    def _some_members(self, cluster: str) -> np.ndarray:
        states = self.members(cluster)
        if not states.size:
            raise InputError("has no states", place=f"cluster {cluster!r}")
        return states
