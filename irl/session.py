"""Algorithm 4.1 with the control inverted: the learner's side of a lesson.

Whoever leads a lesson, a page, a terminal or `irl.active_fa_mlirl`, asks a session what to ask
(`propose`), tells it what was said (`apply`), lets it learn (`refit`), and takes its policy. What
was said comes as events, `irl.lesson_events`, so that it can be undone and edited, and so that the
same events, rounds and seed give the same policy, bit for bit.

| session | learner |
|---|---|
| `irl.session_network.NetworkSession` | ``fa_mlirl``, thesis Algorithm 4.1 |
| `irl.session_goals.GoalSession` | ``goal_posterior``, which also knows when it is enough |
| `irl.session_methods.MethodSession` | ``planning`` and every other key of `irl.methods.METHODS` |
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from irl.asking import as_good_as_best, toss_up
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.lesson_events import DONE, LEARN, Advised, Answered, Event, Imported, hash_of_states
from irl.lesson_taught import Taught, imported
from irl.metrics import success_mdp
from irl.policy import Policy
from irl.problem import LearningProblem
from irl.session_settled import Enough, Settled
from irl.taught_state import TaughtState
from irl.tensor_file import digest

if TYPE_CHECKING:  # torch, which whoever only asks and answers does without
    from irl.active_config import Progress

START = "start"
"""The strategy of questions before there is anything to choose by: where runs begin."""
RETEST = "test again"
"""That of a state asked about once more, for an answer contradicted what was proposed there."""
GOAL = "goal"
"""That of a state that is taken for a goal, though nobody said that it is one."""

ALIKE = 1e-6
"""Share of a state's range of values within which a learner of one set of values calls actions
equally good: less than that it does not learn from anything but symmetry."""


@dataclass(frozen=True)
class Question:
    """A state to ask about.

    Attributes:
        state: index.
        strategy: how it was chosen.
        score: of that strategy.
        proposed: the action that the policy favours there, ``DONE`` if it takes the state for a
            goal, None if there is no policy yet.
        purpose: what the answer is for, a name in ``irl.lesson_events.PURPOSES``.
    """

    state: int
    strategy: str
    score: float
    proposed: int | None = None
    purpose: str = LEARN


class Session(ABC):
    """What every session has; see the table above.

    Attributes:
        problem: what is known beforehand.
        state: what was taught and asked.
        taught: the events, folded.
        rounds: how often it has learnt.
        q: action values ``[n_states, n_actions]`` after the last round, advice included.
        method: key of the learner in ``irl.methods.METHODS``.
    """

    method: str

    def __init__(
        self,
        problem: LearningProblem,
        state: TaughtState,
        generalise: Callable[[Demonstrations], Demonstrations],
        *,
        source: str = "human",
        most: int | None = None,
    ) -> None:
        """Nothing was said yet.

        Args:
            problem: what is known beforehand.
            state: with the demonstrations that come first.
            generalise: adds to a run what follows from it.
            source: who shows, a name in ``irl.demonstrations.SOURCES``.
            most: how many states may have labels.
        """
        self.problem, self.state = problem, state
        self.taught = Taught(source)
        self.rounds = 0
        self.q: np.ndarray = np.zeros((0, 0))
        self._generalise, self._most = generalise, most
        self._learnt: list[int] = []  # numbers of the runs among the labels, in order
        self._settled = Settled()
        self._remember()

    # --- What was said ----------------------------------------------------------------------

    def apply(self, events: Sequence[Event]) -> None:
        """Take up what was said, in order; nothing is learnt from it before the next `refit`.

        Events that say nothing, such as that a question was shown, are only counted: an event's
        number, which undo, edits and outcomes name, is its place among all.

        Raises:
            InputError: if something cannot be undone or edited, or a cluster is unknown.
        """
        added = self.taught.add(events)
        touched = dict.fromkeys(
            e.trajectory for e in events if isinstance(e, Answered) and e.purpose == LEARN
        )
        earlier = set(touched) & set(self._learnt[:-1])
        if not added or earlier or any(isinstance(event, Imported) for event in events):
            self._begin_again()
            return
        for number in touched:
            self._learn(number)
        for event in events:
            if isinstance(event, Advised):
                self._advise(event)

    def _remember(self) -> None:
        """Keep what was known before anything was said, to begin again from it."""
        state = self.state
        self._before = (
            *(state.labels, state.advice, dict(state.clusters)),
            *(list(state.asked), list(state.asked_clusters)),
        )

    def _begin_again(self) -> None:
        """Take up all that was said from the start: something of it changed."""
        state, self._learnt = self.state, []
        labels, advice, clusters, asked, asked_clusters = self._before
        state.labels, state.advice, state.clusters = labels, advice, dict(clusters)
        state.asked, state.asked_clusters = list(asked), list(asked_clusters)
        for from_file in self.taught.imports:
            state.learn_of(self._labelled(imported(from_file)), self._most)
        for number in self.taught.trajectories:
            self._learn(number)
        for event in self.taught.advised:
            self._advise(event)

    def _learn(self, number: int) -> None:
        run = self.taught.run(number)
        if number not in self._learnt:
            self._learnt.append(number)
            self.state.asked.append(self.taught.first_state(number))
        self._add(run)

    def _add(self, run: Demonstrations) -> None:
        """Take up a run, in place of what was known of it."""
        self.state.learn_of(self._labelled(run), self._most)

    def _labelled(self, run: Demonstrations) -> Demonstrations:
        """A run and what follows from it, but for what was refused."""
        labels, refused = self._generalise(run), self.taught.excluded
        if not refused:
            return labels
        out = np.array([pair in refused for pair in labels.pairs], dtype=bool)
        return labels.select(~(out & labels.generalised))

    def _advise(self, event: Advised) -> None:
        state = self.state
        state.speak_of(event.cluster)
        states = state.clusters[event.cluster]
        if event.states_hash and event.states_hash != hash_of_states(states):
            raise InputError(
                "has other states than when advice was given", place=f"cluster {event.cluster!r}"
            )
        state.advice = state.advice.add(states, event.preferred, event.avoided)

    @property
    def known(self) -> np.ndarray:
        """States not to ask about: labelled, asked about before, or put aside; int64."""
        state = self.state
        put_aside = [*state.asked, *self.taught.skipped]
        return np.r_[state.labels.state, np.array(put_aside, dtype=np.int64)]

    # --- What comes of it -------------------------------------------------------------------

    def refit(self, callback: "Callable[[Progress], None] | None" = None) -> None:
        """Learn from all that was said.

        Args:
            callback: told of iterations, and at the end of the action values.

        Raises:
            InputError: if nothing was said that can be learnt from.
        """
        self._refit(callback)
        self.rounds += 1
        self._settled.add(Policy.from_q(self.q, self.problem.model.mask).action)

    @abstractmethod
    def _refit(self, callback: "Callable[[Progress], None] | None") -> None:
        """Learn, and set ``q``."""

    @abstractmethod
    def propose(self, n: int) -> list[Question]:
        """The next questions about states, best first; fewer if there are no more.

        What it draws by chance it draws from the session's own generator: the same calls in the
        same order give the same questions.
        """

    @abstractmethod
    def sure(self, states: np.ndarray) -> np.ndarray:
        """Probability that the policy's action will do, float64 ``[len(states)]``."""

    @abstractmethod
    def gain(self, states: np.ndarray) -> np.ndarray:
        """What an answer in each state is expected to tell, in nats, float64 ``[len(states)]``."""

    @property
    def left(self) -> float:
        """All that is left to learn, in nats; here there is no measure of it: infinite."""
        return np.inf

    def toss_up(self, states: np.ndarray) -> np.ndarray:
        """Where the learner is sure that several actions will do, bool ``[len(states)]``."""
        return toss_up(as_good_as_best(self.q[states], ALIKE))

    def arrived(self) -> np.ndarray:
        """Which states it takes for goals, bool ``[n_states]``; none where it does not know."""
        return np.zeros(self.problem.model.n_states, dtype=bool)

    def enough(self) -> Enough:
        """Whether it has learnt enough; here by a stand-in, that the policy stopped changing.

        ``reached`` among its figures is the probability of coming to where runs ended, in the
        model, mean over the starts.
        """
        told, model = self._settled.enough(), self.problem.model
        said = [a.state for a in self.taught.answers.values() if a.action == DONE]
        ends = np.union1d(self.state.labels.ends[:, 2], np.array(said, dtype=np.int64))
        if not (self.rounds and ends.size):
            return told
        action = Policy.from_q(self.q, model.mask).action
        reached = success_mdp(model, action, ends, self.problem.start_states)
        return replace(told, figures=told.figures | {"reached": reached})

    def policy(self, *, task_hash: str = "", seed: int = 0) -> Policy:
        """The policy after the last round.

        Args:
            task_hash: hash of the task data.
            seed: the seed.

        Raises:
            InputError: if nothing was learnt yet.
        """
        if not self.rounds:
            raise InputError("nothing was learnt yet", place="session")
        mask = self.problem.model.mask
        return Policy.from_q(self.q, mask, task_hash=task_hash, algorithm=self.method, seed=seed)


def policy_hash(policy: Policy) -> str:
    """SHA-256 of a policy's actions and values, in hexadecimal, whoever learnt it."""
    return digest({"action": policy.action, "q": policy.q}, {"task_hash": policy.task_hash})
