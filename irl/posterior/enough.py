"""When a learner has been taught enough: a rule that stops asking, and what it may claim.

First its own predictions must be good enough at two checks in a row, success of 0.99 and accuracy
of 0.98, while runs end where the learner's plans do: what is still wrong, a question that tells
most finds sooner than an audit. If it takes more for the goal than was shown to be one, it asks
whether a state of that is one: as unlike where runs ended as there is. Predictions hold if the
truth is among the hypotheses. They may be good because nobody planned for it yet: so hypotheses are
sought once more, as long as after the first run, before anything is claimed. And a cost that has no
name is in no hypothesis at all. So an audit follows, which needs no such faith:
`irl.posterior.audit`. It decides whether the learner may say that it knows how things are liked. If
it contradicts, the learner goes on asking, and another audit follows.
"""

from dataclasses import dataclass, field

from irl.demonstrations import Demonstrations
from irl.posterior.learner import AGREE, GoalLearner

SUCCESS, ACCURACY = 0.99, 0.98
"""Predictions that are enough for an audit."""
_IN_A_ROW = 2

LEARNT = "it reaches the goal, the way you like it"
UNTRIED = "it reaches the goal; I think I know how you like it done, and was not put to the test"
REACHES = "it reaches the goal; how you like it done I have not understood"
UNSURE = "I am not sure of the goal yet"


@dataclass
class EnoughRule:
    """Leads one lesson: whether it is over, what to ask next, and what an answer is for.

    Attributes:
        passed: checks in a row that were passed.
    """

    passed: int = field(default=0, init=False)

    def __call__(self, learner: GoalLearner) -> bool:
        """Check once, after an answer; True when it is enough."""
        self.passed = self.passed + 1 if confident(learner) else 0
        if self.passed == _IN_A_ROW:
            learner.learn(learner.shown)
            self.passed *= confident(learner)
        return claim(learner) == LEARNT

    def question(self, learner: GoalLearner) -> int:
        """The state to ask about.

        In an audit as that wants; else to see whether it is a goal, if success is predicted because
        it is taken for one; else where it tells most.
        """
        if self.audits(learner):
            return learner.audit_question()
        goal = self.goal_question(learner)
        return learner.question() if goal is None else goal

    def goal_question(self, learner: GoalLearner) -> int | None:
        """A state that success is predicted because of, though nobody said that it is a goal."""
        expects = learner.predicted.success >= SUCCESS and not self.audits(learner)
        return learner.untried_goal if expects else None

    def take(self, learner: GoalLearner, answer: Demonstrations) -> None:
        """Give the learner the answer to the question: to learn from, or for the audit."""
        if not self.audits(learner):
            learner.learn(Demonstrations.concatenate([learner.shown, answer]), rounds=1)
            return
        before = learner.mistaken
        learner.compare(answer)
        if learner.mistaken > before:
            self.passed = 0

    def proposal(self, learner: GoalLearner, state: int) -> int | None:
        """In an audit what the learner would do in the state, to be let pass or corrected."""
        return learner.proposal(state) if self.audits(learner) else None

    def audits(self, learner: GoalLearner) -> bool:
        """Whether answers are held out to test the learner's proposals."""
        return self.passed >= _IN_A_ROW and not learner.audit.confirmed


def confident(learner: GoalLearner) -> bool:
    """Whether a learner's own predictions are good enough."""
    return reaches(learner) and learner.predicted.accuracy >= ACCURACY


def claim(learner: GoalLearner) -> str:
    """What a learner may say of itself: ``LEARNT``, ``UNTRIED``, ``REACHES`` or ``UNSURE``.

    Once an audit has contradicted, only one that confirms makes good for it.
    """
    if not reaches(learner):
        return UNSURE
    if not confident(learner) or (learner.mistaken and not learner.audit.confirmed):
        return REACHES
    return LEARNT if learner.audit.confirmed else UNTRIED


def reaches(learner: GoalLearner) -> bool:
    """Whether it predicts that it reaches the goal, and has reason to think that it knows it.

    Runs ended as its plans do, and of what it takes for the goal beyond that a state was tried.
    """
    predicts = learner.predicted.success >= SUCCESS and learner.ends_agree >= AGREE
    return predicts and learner.untried_goal is None
