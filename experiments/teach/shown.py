"""What a teacher is shown: a question, why it is asked, and what an answer led to."""

from dataclasses import dataclass

import numpy as np

from experiments.teach.worlds import World
from irl.asking import visits
from irl.lesson_events import DONE
from irl.student import Learnt

TOP = 3


@dataclass(frozen=True)
class Why:
    """Why a question is asked: three shares, each from 0 to 1, and a sentence.

    Attributes:
        doubt: how unsure the learner is of its own choice there.
        visited: how often its policy comes by, compared with where it comes by most.
        new: how unlike what was shown the state is: the share of factors that differ from the
            nearest state with an answer.
        words: one sentence.
    """

    doubt: float
    visited: float
    new: float
    words: str


@dataclass(frozen=True)
class Shown:
    """A question as it is shown.

    Attributes:
        token: makes an answer count once.
        number: of its event.
        state: index, and ``words`` for it.
        trajectory: the run that an answer belongs to, and its ``step`` there.
        step: see there.
        strategy: why this one.
        purpose: what the answer is for, a name in ``irl.lesson_events.PURPOSES``.
        proposed: what the policy would do, `DONE` if it takes the state for a goal, None if there
            is no policy yet; to be preselected.
        top: the learner's favourites, best first, three at most.
        feasible: what can be done there.
        sure: probability that what is proposed will do.
        why: why it is asked.
        words: the state in words.
    """

    token: str
    number: int
    state: int
    trajectory: int
    step: int
    strategy: str
    purpose: str
    proposed: int | None
    top: tuple[int, ...]
    feasible: tuple[int, ...]
    sure: float
    why: Why
    words: str


@dataclass(frozen=True)
class Given:
    """What came of an answer.

    Attributes:
        accepted: whether it counts; not if one came before under its token.
        number: of its event.
        outcome: the state that it led to; None for *done*, and where the episode does not go on.
        follows: pairs (state, action) that rules label too, unless they are excluded.
    """

    accepted: bool
    number: int = 0
    outcome: int | None = None
    follows: tuple[tuple[int, int], ...] = ()


NOT_ACCEPTED = Given(False)


@dataclass(frozen=True)
class AdviceGiven:
    """What came of advice: on how many states, and which answers (by number) it contradicts."""

    accepted: bool
    states: int = 0
    contradicted: tuple[int, ...] = ()


_WORDS = {
    "start": "A whole trajectory from here shows me what you are after.",
    "run": "A whole trajectory from here shows me what you are after.",
    "episode": "The episode goes on here.",
    "picked": "You picked this state: what should I do here?",
    "again": "You took your answer back.",
    "information": "Your answer here tells me most of what you are after.",
    "goal": "I take this for done, as where you ended: is it?",
    "test": "Not of my choosing, to test whether I have understood; I say what I would do.",
    "test again": "Once more, for your answer surprised me.",
    "random": "Drawn by chance.",
}
_WHOLE = ("start", "run", "episode", "again", "picked", "goal", "test", "test again")
"""Strategies of which that is all there is to say."""


class Reasons:
    """Why a learner asks, worked out once a round."""

    def __init__(self, world: World, learnt: Learnt) -> None:
        """Prepare: visits of the policy from the starts."""
        assert learnt.policy is not None
        self._world, self._learnt = world, learnt
        model, starts = world.model, world.subject.problem.start_states
        total = visits(model, learnt.policy.action, starts)
        self._visits = total / max(total.max(), 1e-12)

    def why(self, state: int, strategy: str, answered: np.ndarray) -> Why:
        """Why ``state`` is asked about, when ``answered`` states have answers."""
        doubt = 1.0 - float(self._learnt.sure[state])
        visited, new = float(self._visits[state]), newness(self._world, state, answered)
        words = _WORDS.get(strategy, "")
        if strategy not in _WHOLE:
            words = (
                words or f"Chosen by {strategy.replace('_', ' ')}."
            ) + f" {_said(doubt, visited)}"
        return Why(doubt, visited, new, words)

    def gain(self, states: np.ndarray) -> float:
        """What an answer in one of some states tells, as often as the policy comes by each.

        As often as each other if it comes by none; 0 if nothing is known of any.
        """
        known = states[np.isfinite(self._learnt.gain[states])]
        if not known.size:
            return 0.0
        often = self._visits[known]
        gain = self._learnt.gain[known].astype(np.float64)
        return float(np.average(gain, weights=often if often.sum() > 0 else None))

    def knows(self, state: int) -> bool:
        """Whether it was worked out what an answer in a state tells."""
        return bool(np.isfinite(self._learnt.gain[state]))

    @property
    def left(self) -> float:
        """All that is left to learn."""
        return self._learnt.left

    @property
    def on_my_way(self) -> np.ndarray:
        """States that the policy comes by and that it does not take for goals."""
        coming = self._visits > 0
        if self._learnt.arrived.size:
            coming &= ~self._learnt.arrived
        return np.flatnonzero(coming)

    def toss_up(self, state: int) -> bool:
        """Whether the learner is sure that several actions will do."""
        return bool(self._learnt.toss_up.size and self._learnt.toss_up[state])

    def top(self, state: int) -> tuple[int, ...]:
        """The favourites in a state, best first."""
        assert self._learnt.policy is not None
        q = self._learnt.policy.q[state]
        order = np.argsort(-q, kind="stable")[:TOP]
        return tuple(int(a) for a in order if np.isfinite(q[a]))

    def sure(self, state: int) -> float:
        """Probability that the policy's choice will do."""
        return float(self._learnt.sure[state])

    def proposed(self, state: int) -> int | None:
        """The policy's choice; `DONE` in what is taken for a goal."""
        assert self._learnt.policy is not None
        if self._learnt.arrived.size and self._learnt.arrived[state]:
            return DONE
        action = int(self._learnt.policy.action[state])
        return None if action < 0 else action


def unexplained(world: World, state: int, strategy: str, answered: np.ndarray) -> Why:
    """Why a question is asked while nothing was learnt yet."""
    return Why(1.0, 0.0, newness(world, state, answered), _WORDS.get(strategy, ""))


def newness(world: World, state: int, answered: np.ndarray) -> float:
    """Share of factors in which a state differs from the nearest answered one; 1 without any."""
    factors = list(world.subject.problem.factors.values())
    if not answered.size or not factors:
        return 1.0
    differs = [values[answered] != values[state] for values in factors]
    return float(np.mean(differs, axis=0).min())


def _said(doubt: float, visited: float) -> str:
    unsure = "I waver between choices there" if doubt > 0.3 else "I am fairly sure there"
    often = "and come by often" if visited > 0.1 else "and seldom come by"
    return f"{unsure} {often}."


__all__ = [
    "DONE",
    "NOT_ACCEPTED",
    "AdviceGiven",
    "Given",
    "Reasons",
    "Shown",
    "Why",
    "newness",
    "unexplained",
]
