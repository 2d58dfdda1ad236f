"""When a learner has been taught enough: a rule that stops asking, and what it may claim.

Enough is predicted success of 0.99 and predicted accuracy of 0.95 at two checks in a row, while
runs end where the learner's plans do. Predictions hold if the truth is among the hypotheses. Two
things are looked at because they need no such faith: where runs ended, and how many labels none of
the hypotheses explains but as a slip. A cost that has no name may escape both.
"""

from dataclasses import dataclass, field

from irl.posterior.learner import AGREE, GoalLearner

SUCCESS, ACCURACY = 0.99, 0.95
"""Predictions that are enough."""
UNEXPLAINED = 0.15
"""Share of labels taken for slips above which a learner does not claim to know how it is done."""
_IN_A_ROW = 2

LEARNT = "it reaches the goal, the way you like it"
REACHES = "it reaches the goal; how you like it done I have not understood"
UNSURE = "I am not sure of the goal yet"


@dataclass
class EnoughRule:
    """Watches one learner.

    Attributes:
        passed: checks in a row that were passed.
    """

    passed: int = field(default=0, init=False)

    def __call__(self, learner: GoalLearner) -> bool:
        """Check once, after a lesson's new label; True when it is enough."""
        self.passed = self.passed + 1 if claim(learner) == LEARNT else 0
        return self.passed >= _IN_A_ROW


def claim(learner: GoalLearner) -> str:
    """What a learner may say of itself: ``LEARNT``, ``REACHES`` or ``UNSURE``."""
    predicted = learner.predicted
    if predicted.success < SUCCESS or learner.ends_agree < AGREE:
        return UNSURE
    if predicted.accuracy < ACCURACY or learner.unexplained > UNEXPLAINED:
        return REACHES
    return LEARNT
