"""The teacher's desk: a lesson led from question to question, whatever it is shown on.

A page and a terminal do the same: show `Desk.question`, give it an answer under its token, and
call `Desk.tick` so that rounds of learning begin and end. Every answer is on disk before the next
question; after a restart the desk shows the question that was open, under the same token.

Episodes rather than quizzes: after an answer the next question is the state that came of it, until
the teacher says that nothing is left to do. Then the learner chooses. Questions that test the
learner stand alone. A synchronous desk does a round after each answer, and asks what Algorithm 4.1
would: only the first trajectory, if the lesson begins without any, is followed to its end.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from experiments.teach.asking import AGAIN, EPISODE, LONGEST, RUN, Asking
from experiments.teach.rounds import Learner, Rounds
from experiments.teach.shown import NOT_ACCEPTED, Given, Shown
from experiments.teach.worlds import World
from irl.clusters import intersection
from irl.errors import InputError
from irl.lesson import Lesson
from irl.lesson_events import (
    AUDIT,
    DONE,
    HELD_OUT,
    LEARN,
    Acted,
    Advised,
    Answered,
    Asked,
    Cluster,
    Edit,
    Event,
    Excluded,
    Outcome,
    Skipped,
    Undo,
    hash_of_states,
    last_said,
)
from irl.lesson_replay import config_of
from irl.lesson_taught import Taught
from irl.policy import Policy
from irl.session import Question
from irl.session_settled import Enough
from irl.student import Learnt

TENTH = 10
"""Of so many answers one is held out, if the teacher wishes."""


@dataclass(frozen=True)
class DeskConfig:
    """How a lesson is led.

    Attributes:
        synchronous: a round after each answer, and no episodes.
        hold_out: whether every tenth answer is held out, to judge the policy by.
    """

    synchronous: bool = False
    hold_out: bool = False


@dataclass(frozen=True)
class AdviceGiven:
    """What came of advice: on how many states, and which answers (by number) it contradicts."""

    accepted: bool
    states: int = 0
    contradicted: tuple[int, ...] = ()


@dataclass
class Desk:
    """One lesson, being taught. What it may be asked to do is refused by `InputError` if it cannot.

    Attributes:
        world: what is taught.
        lesson: the file; this is its only writer.
        learner: who learns.
        config: how it is led.
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
        self.question: Shown | None = None
        open_ = self.asking.open_question()
        if open_ is not None:
            self.question = self.asking.shown(*open_)
        self.tick()
        if self.question is None:
            self._next()

    # --- Answers ----------------------------------------------------------------------------

    def answer(
        self,
        token: str,
        action: int,
        *,
        seconds: float = 0.0,
        previews: int = 0,
        outcome: int | None = None,
    ) -> Given:
        """Answer the question.

        Args:
            token: of the question; under another, or one used before, nothing happens.
            action: what to do in its state, or ``DONE``.
            seconds: since it was shown.
            previews: motions looked at meanwhile.
            outcome: the state that came of it, if that is known; else one is drawn by the model.
        """
        asked = self.question
        if asked is None or token != asked.token or self.lesson.used(token):
            return NOT_ACCEPTED
        self._require(asked.state, action)
        held_out = self._is_held_out(asked, action)
        said = Answered(
            *(asked.state, action, asked.trajectory, asked.step, asked.proposed),
            seconds=round(float(seconds), 3),
            previews=previews,
            purpose=HELD_OUT if held_out else asked.purpose,
        )
        number, came = len(self.lesson.events) + 1, None
        events: list[Event] = [said]
        if action != DONE:
            came = self._drawn(asked.state, action) if outcome is None else outcome
            events.append(Outcome(number, came))
            events += self._onward(asked, action, came)
        self._say(events, token)
        self.tick()
        if self.question is None:
            self._next()
        return Given(True, number, came, self._following(asked.state, action))

    def act(self, token: str, outcome: int | None = None) -> Given:
        """Let the learner do what it proposes, which is no demonstration, and go on from there."""
        asked = self.question
        if asked is None or token != asked.token or asked.proposed in (None, DONE):
            return NOT_ACCEPTED
        action = int(asked.proposed)  # type: ignore[arg-type]
        came = self._drawn(asked.state, action) if outcome is None else outcome
        number = len(self.lesson.events) + 1
        acted = Acted(asked.state, action, asked.trajectory, asked.step, came)
        if not self._say([acted, *self._onward(asked, action, came)], token):
            return NOT_ACCEPTED
        if self.question is None:
            self._next()
        return Given(True, number, came)

    def skip(self, token: str) -> bool:
        """Put the question aside for good."""
        asked = self.question
        if asked is None or token != asked.token or not self._say([Skipped(asked.state)], token):
            return False
        self._next()
        return True

    def another(self, token: str) -> bool:
        """Ask something else now; the state may come again."""
        if self.question is None or token != self.question.token:
            return False
        self._next()
        return True

    def begin_run(self, state: int | None = None) -> None:
        """Ask for a whole trajectory, from a state or from a start drawn by chance."""
        start = self.asking.start() if state is None else state
        self._say([self.asking.event(Question(start, RUN, 0.0))])

    def correct(self, state: int, action: int, token: str, after: int | None = None) -> int | None:
        """A person took over from a playing policy: what to do in that state.

        Args:
            state: where the policy was stopped.
            action: what to do there instead, or ``DONE``.
            token: of the message.
            after: number of the correction before, if this one follows it.

        Returns:
            Its number; None if there was one under that token.
        """
        self._require(state, action)
        trajectory, step = self.asking.new_trajectory(), 0
        before = None if after is None else self.taught.answers.get(after)
        if before is not None:
            gap = not self._leads(before.state, before.action, state)
            trajectory, step = before.trajectory, before.step + 1 + gap
        reasons = self.asking.reasons
        proposed = None if reasons is None else reasons.proposed(state)
        number = len(self.lesson.events) + 1
        said = self._say([Answered(state, action, trajectory, step, proposed)], token)
        self.tick()
        return number if said else None

    # --- Taking back ------------------------------------------------------------------------

    def undo(self, token: str) -> int | None:
        """Take back the last thing said that holds; what was answered is asked again.

        Returns:
            Its number; None if there was nothing, or the token was used before.
        """
        number = last_said(self.lesson.events)
        if number is None:
            return None
        event = self.lesson.events[number - 1]
        events: list[Event] = [Undo(number)]
        if isinstance(event, Answered):
            purpose = AUDIT if event.purpose == AUDIT else LEARN
            again = Question(event.state, AGAIN, 0.0, event.preselected, purpose)
            events.append(self.asking.event(again, event.trajectory, event.step))
        elif isinstance(event, Skipped):
            events.append(self.asking.event(Question(event.state, AGAIN, 0.0)))
        if not self._say(events, token):
            return None
        self.tick()
        return number

    def edit(self, number: int, action: int, token: str) -> bool:
        """Give an earlier answer another action."""
        answer = self.taught.answers.get(number)
        if answer is None:
            raise InputError(f"no answer {number} holds", place="edit", valid=self.taught.answers)
        self._require(answer.state, action)
        done = self._say([Edit(number, {"action": action})], token)
        self.tick()
        return done

    def exclude(self, number: int, pairs: Sequence[tuple[int, int]], token: str) -> bool:
        """Refuse labels that rules would give after an answer."""
        plain = [[int(s), int(a)] for s, a in pairs]
        done = self._say([Excluded(number, plain)], token)
        self.tick()
        return done

    # --- Advice -----------------------------------------------------------------------------

    def members(self, cluster: str) -> np.ndarray:
        """The states of a cluster, or of an intersection such as ``"a ∩ b"``."""
        return intersection(self.world.clusters, cluster)

    def make_cluster(self, cluster: str, token: str) -> int:
        """Keep an intersection; how many states it has."""
        states = self._some_members(cluster)
        self._say([Cluster(cluster, hash_of_states(states))], token)
        return int(states.size)

    def advise(
        self, cluster: str, preferred: Sequence[int], avoided: Sequence[int], token: str
    ) -> AdviceGiven:
        """Say what to prefer and what to avoid in all states of a cluster."""
        states = self._some_members(cluster)
        good, bad = sorted({int(a) for a in preferred}), sorted({int(a) for a in avoided})
        for action in [*good, *bad]:
            if not 0 <= action < self.world.model.n_actions:
                raise InputError(f"no action {action}", place="advice")
        if set(good) & set(bad):
            raise InputError(
                f"action {min(set(good) & set(bad))} is both preferred and avoided", place="advice"
            )
        if not self._say([Advised(cluster, hash_of_states(states), good, bad)], token):
            return AdviceGiven(False)
        inside = set(states.tolist())
        contradicted = tuple(
            number
            for number, answer in self.taught.answers.items()
            if answer.state in inside and answer.action in bad
        )
        self.tick()
        return AdviceGiven(True, int(states.size), contradicted)

    # --- Rounds -----------------------------------------------------------------------------

    def tick(self) -> bool:
        """Take up what was learnt, and begin a round if there is news; whether anything changed."""
        changed = self._take_up()
        if self._may_learn and self.rounds.begin(self.taught):
            self._take_up()
            return True
        return changed

    @property
    def learnt(self) -> Learnt | None:
        """What came of the last round."""
        return self.rounds.learnt

    @property
    def policy(self) -> Policy | None:
        """The policy after the last round."""
        return None if self.learnt is None else self.learnt.policy

    @property
    def enough(self) -> Enough:
        """Whether the learner has learnt enough, and why."""
        if self.learnt is None:
            return Enough(False, "I have learnt nothing yet", False, {})
        return self.learnt.enough

    @property
    def _may_learn(self) -> bool:
        """Whether a round may begin; a synchronous desk waits for the first trajectory's end."""
        in_first_run = self.question is not None and self.question.step > 0
        return not (self.config.synchronous and in_first_run)

    def _take_up(self) -> bool:
        changed = self.rounds.poll()
        if changed and self.learnt is not None and not self.rounds.error:
            self.asking.take_up(self.learnt)
        return changed

    # --- What the above share ---------------------------------------------------------------

    def _next(self) -> None:
        self._say([self.asking.event(self.asking.next())])

    def _say(self, events: list[Event], token: str | None = None) -> bool:
        """Write events down and take them up; whether they were new under their token.

        The last of them is the question shown from now on, if it is one; an answer leaves none.
        """
        first = len(self.lesson.events)
        if self.lesson.append(events, token) is None:
            return False
        self.taught.add(events)
        self.asking.note(first)
        last = events[-1]
        if isinstance(last, Asked):
            self.question = self.asking.shown(len(self.lesson.events), last)
        elif token is not None and self.question is not None and token == self.question.token:
            self.question = None
        return True

    def _onward(self, asked: Shown, action: int, came: int) -> list[Event]:
        """The question that goes on with an episode, if it goes on."""
        alone = self.config.synchronous and not self.asking.is_run(asked.trajectory)
        over = asked.step + 1 >= LONGEST or not self.world.model.widths[came]
        if alone or over or asked.purpose == AUDIT:
            return []
        step = asked.step + 1 + (not self._leads(asked.state, action, came))
        return [self.asking.event(Question(came, EPISODE, 0.0), asked.trajectory, step)]

    def _is_held_out(self, asked: Shown, action: int) -> bool:
        due = len(self.taught.answers) % TENTH == TENTH - 1
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
        model = self.world.model
        if not 0 <= state < model.n_states:
            raise InputError(f"no state {state}", place="answer")
        feasible = model.actions_of(state).tolist()
        if action != DONE and action not in feasible:
            raise InputError(
                f"action {action} is not feasible in state {state}",
                place="answer",
                valid=[*feasible, DONE],
            )

    def _some_members(self, cluster: str) -> np.ndarray:
        states = self.members(cluster)
        if not states.size:
            raise InputError("has no states", place=f"cluster {cluster!r}")
        return states
