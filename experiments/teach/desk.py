"""The teacher's desk: a lesson led from question to question, whatever it is shown on.

A page and a terminal do the same: show `Desk.question`, give it an answer under its token, and
call `Desk.tick` so that rounds of learning begin and end. Every answer is on disk before the next
question; after a restart the desk shows the question that was open, under the same token.

Episodes rather than quizzes: after an answer the next question is the state that came of it, until
the teacher says that nothing is left to do, or another question is worth more of the teacher's
time (`Asking.leads`). Then the learner chooses. Questions that test the learner stand alone. A
synchronous desk does a round after each answer, and asks what Algorithm 4.1 would: only the first
trajectory, if the lesson begins without any, is followed to its end.
"""

from collections.abc import Sequence

from experiments.teach.asking import AGAIN, PICKED
from experiments.teach.choosing import RUN
from experiments.teach.notes import DeskConfig, Notes
from experiments.teach.shown import NOT_ACCEPTED, AdviceGiven, Given
from irl.errors import InputError
from irl.lesson_events import (
    AUDIT,
    DONE,
    HELD_OUT,
    LEARN,
    Acted,
    Advised,
    Answered,
    Cluster,
    Edit,
    Event,
    Excluded,
    Outcome,
    Skipped,
    Undo,
    hash_of_states,
)
from irl.lesson_standing import last_said, stands
from irl.policy import Policy
from irl.session import Question
from irl.session_settled import Enough
from irl.student import Learnt

__all__ = ["AdviceGiven", "Desk", "DeskConfig"]


class Desk(Notes):
    """One lesson, being taught. What it may be asked to do is refused by `InputError` if it cannot.

    What it is made of, and what it shows, are the attributes of `Notes`.
    """

    def __post_init__(self) -> None:
        """Take up a lesson where it stands, and begin to learn from it."""
        super().__post_init__()
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
        if outcome is not None:
            self._require_state(outcome)
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
            if not self.asking.leaves(came):
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
        action = asked.proposed
        if outcome is not None:
            self._require_state(outcome)
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
        self._require_state(start)
        self._say([self.asking.event(Question(start, RUN, 0.0))])

    def ask(self, state: int) -> None:
        """Ask about a state that the teacher picked."""
        self._require_state(state)
        self._say([self.asking.event(Question(state, PICKED, 0.0))])

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

    def undo(self, token: str, number: int | None = None) -> int | None:
        """Take back something said that holds, the last if not told which.

        What was answered is asked again.

        Returns:
            Its number; None if there was nothing, or the token was used before.
        """
        if number is None:
            number = last_said(self.lesson.events)
        elif number not in stands(self.lesson.events) and not self.lesson.used(token):
            raise InputError(f"nothing said under {number} holds", place="undo")
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
        if number not in self.taught.answers:
            raise InputError(f"no answer {number} holds", place="exclude")
        plain = [[int(s), int(a)] for s, a in pairs]
        done = self._say([Excluded(number, plain)], token)
        self.tick()
        return done

    def take(self, events: list[Event]) -> None:
        """Take in what came from files, checked before."""
        self._say(events)
        self.tick()

    # --- Advice -----------------------------------------------------------------------------

    def make_cluster(self, cluster: str, token: str) -> int:
        """Keep an intersection; how many states it has."""
        states = self._some_members(cluster)
        self._say([Cluster(cluster, hash_of_states(states))], token)
        return int(states.size)

    def advise(
        self,
        cluster: str,
        preferred: Sequence[int],
        avoided: Sequence[int],
        token: str,
        *,
        seconds: float = 0.0,
    ) -> AdviceGiven:
        """Say, in so many seconds, what to prefer and to avoid in all states of a cluster.

        What was said of the same states before gives way to it: nothing at all takes it back.
        """
        states = self._some_members(cluster)
        good, bad = sorted({int(a) for a in preferred}), sorted({int(a) for a in avoided})
        for action in [*good, *bad]:
            if not 0 <= action < self.world.model.n_actions:
                raise InputError(f"no action {action}", place="advice")
        if set(good) & set(bad):
            raise InputError(
                f"action {min(set(good) & set(bad))} is both preferred and avoided", place="advice"
            )
        said = Advised(cluster, hash_of_states(states), good, bad, round(float(seconds), 3))
        if not self._say(self._instead(said) or [said], token):
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
        changed = self._take_up() | self.rounds.found()
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
        """Whether a round may begin: nobody learns a goal from a trajectory that goes on still."""
        first = self.learnt is None and len(self.taught.trajectories) == 1
        return not (first and self.question is not None and self.question.step > 0)

    def _take_up(self) -> bool:
        changed = self.rounds.poll()
        if changed and self.learnt is not None and not self.rounds.error:
            self.asking.take_up(self.learnt)
            asked = self.question
            if asked is not None and asked.purpose == LEARN:
                self.question = self.asking.looked_at_again(asked)
        return changed
