"""A session whose learner is a posterior over goals and costs: few answers, and it says when.

Questions are where an answer tells most; once its own predictions are good, they are where an audit
wants them, and the learner's proposal is put to the test (`irl.posterior.enough`).
"""

from collections.abc import Callable

import numpy as np

from irl.active_config import Progress
from irl.asking import toss_up
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.lesson_events import AUDIT, DONE, Answered
from irl.posterior.audit import Audit
from irl.posterior.enough import LEARNT, EnoughRule, claim
from irl.posterior.learner import GoalConfig, GoalLearner
from irl.posterior.predictions import votes, votes_of_all
from irl.posterior.questions import information_gain
from irl.problem import LearningProblem
from irl.session import GOAL, RETEST, Question, Session
from irl.session_settled import Enough
from irl.taught_state import TaughtState
from irl.uncertainty import shannon_entropy

INFORMATION, TEST = "information", "test"
"""Strategies: where an answer tells most; and to test a proposal (`irl.posterior.audit_states`)."""
_LOOKED_AT = 1500  # states whose information is worked out before a question
_DRAWS = 5  # draws from a few states that are left may be the same
_CROWD = 10  # a batch of n is spread over the 10 n best


class GoalSession(Session):
    """A session of ``goal_posterior``.

    Attributes:
        learner: the posterior.
        rule: says when it is enough.
    """

    method = "goal_posterior"

    def __init__(
        self,
        problem: LearningProblem,
        state: TaughtState,
        generalise: Callable[[Demonstrations], Demonstrations],
        config: GoalConfig | None = None,
    ) -> None:
        """Nothing was said yet; the arguments are those of `Session`."""
        super().__init__(problem, state, generalise)
        self.learner = GoalLearner(problem, rng=state.rng, config=config)
        self.rule = EnoughRule()
        self._tested: dict[int, Answered] = {}  # the tests' answers that were taken up

    # --- Learning ---------------------------------------------------------------------------

    def _refit(self, callback: Callable[[Progress], None] | None) -> None:
        learner, audits = self.learner, self.taught.with_purpose(AUDIT)
        learner.proposals = {
            a.trajectory: a.preselected
            for a in audits.values()
            if a.preselected not in (None, DONE)
        }
        learner.skipped = self._skipped()
        if any(audits.get(number) != answer for number, answer in self._tested.items()):
            # What was held out was taken back: the test begins again, and what was answered in it
            # so far is learnt from.
            learner.held_out, self.rule.passed = Demonstrations.empty(), 0
            learner.audit = Audit.after(learner.mistaken)
        else:
            for number in sorted(audits.keys() - self._tested.keys()):
                self._compare(audits[number])
        self._tested = audits
        held = {*learner.held_out.trajectory.tolist(), *learner.held_out.ends[:, 0].tolist()}
        over = [self.taught.label(a) for a in audits.values() if a.trajectory not in held]
        shown = Demonstrations.concatenate([self.state.labels, *over])
        if not self.rounds or not _same(shown, learner.shown):
            learner.learn(shown, rounds=1 if self.rounds else None)
        self.rule(learner)
        self.q = self.state.advice.apply(learner.q, self.problem.model.mask, prefer="ignore")
        if callback is not None:
            size = learner.belief.goal.size
            likeliest = float(np.log(learner.belief.weight.max()))
            callback(Progress(self.rounds, size, size, likeliest, shown, self.q))

    def _compare(self, answer: Answered) -> None:
        learner, before = self.learner, self.learner.mistaken
        marked = answer.preselected
        proposed = {answer.state: None if marked == DONE else marked}
        learner.compare(self.taught.label(answer), proposed)
        if learner.mistaken > before:
            self.rule.passed = 0

    # --- Asking -----------------------------------------------------------------------------

    def propose(self, n: int) -> list[Question]:
        """Where answers tell most, spread over states unlike one another; or a test's.

        The first of them is the one that `EnoughRule` would ask about.
        """
        learner, rng = self.learner, self.state.rng
        learner.skipped = self._skipped()
        try:
            left = learner.unasked
        except InputError:
            return []
        if self.rule.audits(learner):
            return self._test(n, left)
        goal = self.rule.goal_question(learner)
        if goal is not None:
            gain = information_gain(learner.belief, np.array([goal]))
            tried = Question(goal, GOAL, float(gain[0]), self._proposal(goal))
            if n == 1:
                return [tried]
            return [tried, *self._telling(n - 1, left[left != goal], rng)]
        return self._telling(n, left, rng)

    def _telling(self, n: int, left: np.ndarray, rng: np.random.Generator) -> list[Question]:
        """Where answers tell most, of the states ``left``."""
        if not left.size:
            return []
        some = rng.choice(left, min(_LOOKED_AT, left.size), replace=False)
        gain = information_gain(self.learner.belief, some)
        return [
            Question(int(some[k]), INFORMATION, float(gain[k]), self._proposal(int(some[k])))
            for k in self._spread(some, gain, n)
        ]

    def _skipped(self) -> np.ndarray:
        return np.array(sorted(self.taught.skipped), dtype=np.int64)

    def _test(self, n: int, left: np.ndarray) -> list[Question]:
        """Distinct states as the learner's audit draws them, each with what it proposes there."""
        states: list[int] = []
        for _ in range(_DRAWS * n):
            state = self.learner.audit_question()
            if state not in states and (state in left or state == self.learner.audit.again):
                states.append(state)
            if len(states) == n:
                break
        again = self.learner.audit.again
        return [
            Question(s, RETEST if s == again else TEST, 0.0, self._proposal(s), AUDIT)
            for s in states
        ]

    def _spread(self, states: np.ndarray, gain: np.ndarray, n: int) -> list[int]:
        """The best, and of the best-scored others each the least alike to those before it."""
        first = int(gain.argmax())
        ranked = [int(k) for k in np.argsort(-gain, kind="stable")[: _CROWD * n] if k != first]
        chosen = [first]
        table = np.array([values[states] for values in self.problem.factors.values()])
        while len(chosen) < n and ranked:
            unlike = [
                min((table[:, k] != table[:, c]).sum() for c in chosen) if table.size else 0
                for k in ranked
            ]
            chosen.append(ranked.pop(int(np.argmax(unlike))))
        return chosen

    def _proposal(self, state: int) -> int:
        proposed = self.learner.proposal(state)
        return DONE if proposed is None else proposed

    def sure(self, states: np.ndarray) -> np.ndarray:
        """The posterior's probability that the policy's action is as good as the best.

        Where it takes a state for a goal, that it is one.
        """
        belief, action, ends = self.learner.belief, self.learner.action, self._ends(states)
        acting, sure = action[states] >= 0, np.zeros(states.size)
        sure[acting] = votes(belief, states[acting], action[states[acting]])
        return np.maximum(sure * (1 - ends), ends)

    def _ends(self, states: np.ndarray) -> np.ndarray:
        """Probability that a state is a goal."""
        belief = self.learner.belief
        chosen, weight = belief.likely()
        return np.asarray(belief.members(belief.goal[chosen])[states] @ weight)

    def gain(self, states: np.ndarray) -> np.ndarray:
        """The information of an answer there about goal and costs."""
        return information_gain(self.learner.belief, states)

    @property
    def left(self) -> float:
        """The entropy of goal and costs."""
        return float(shannon_entropy(self.learner.belief.weight))

    def toss_up(self, states: np.ndarray) -> np.ndarray:
        """Where nearly all that is believed agrees on several actions that will do.

        In a goal none does as well as to be done.
        """
        belief = self.learner.belief
        return toss_up(votes_of_all(belief, states) * (1 - self._ends(states)[:, None]))

    def arrived(self) -> np.ndarray:
        """The states that are more likely a goal than not."""
        return np.asarray(self.learner.arrived)

    def enough(self) -> Enough:
        """By its own predictions, and a test of proposals that it did not choose."""
        learner = self.learner
        predicted, audit = learner.predicted, learner.audit
        said = claim(learner)
        figures = {
            "predicted_success": predicted.success,
            "predicted_accuracy": predicted.accuracy,
            "ends_agree": learner.ends_agree,
            "tested": len(audit.passed),
            "to_test": audit.wanted,
            "mistaken": learner.mistaken,
            "slips": learner.unexplained,
        }
        reason = f"{said}. I expect to reach the goal from {predicted.success:.0%} of the starts, "
        reason += f"and to act as you would in {predicted.accuracy:.0%} of the states"
        if said == LEARNT:
            reason += f"; in {len(audit.passed)} states that I did not choose my proposals passed"
        elif self.rule.audits(learner):
            tested = f"{len(audit.passed)} of {audit.wanted} states that I did not choose"
            reason += f"; tested in {tested}"
        return Enough(said == LEARNT, reason, False, figures)


def _same(a: Demonstrations, b: Demonstrations) -> bool:
    """Whether two sets say the same, in whatever order."""

    def content(d: Demonstrations) -> tuple[list, list]:
        rows = np.stack([d.trajectory, d.step, d.state, d.action, d.source], axis=1)
        return sorted(map(tuple, rows.tolist())), sorted(map(tuple, d.ends.tolist()))

    return content(a) == content(b)
