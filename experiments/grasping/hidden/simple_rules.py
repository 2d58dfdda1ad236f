"""Rules that end a lesson by what labels or policies show, for comparison with `EnoughRule`.

They ask for nothing: they watch a lesson that `EnoughRule` leads, and each says when it would have
ended it.

* ``labels agree``: five answers in a row are what the learner takes for as good as the best;
* ``policy unchanged``: three answers in a row that it learnt from changed its action in fewer than
  one of a hundred states.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from irl.demonstrations import Demonstrations
from irl.posterior.enough import EnoughRule
from irl.posterior.learner import GoalLearner
from irl.posterior.predictions import ALIKE

RULES = ("labels agree", "policy unchanged")
_AGREE, _UNCHANGED, _FEW = 5, 3, 0.01


@dataclass
class Watched:
    """The rule that leads, and those that watch.

    Attributes:
        on_end: told which rule would have ended the lesson, with the learner as it then is.
        rule: leads the lesson.
        agreed: answers in a row that agreed, and ``same``, that changed nothing.
    """

    on_end: Callable[[str, GoalLearner], None]
    rule: EnoughRule = field(default_factory=EnoughRule)
    agreed: int = 0
    same: int = 0

    def __call__(self, learner: GoalLearner) -> bool:
        """Whether the lesson is over."""
        return self.rule(learner)

    def question(self, learner: GoalLearner) -> int:
        """The state to ask about next."""
        return self.rule.question(learner)

    def proposal(self, learner: GoalLearner, state: int) -> int | None:
        """What the learner would do there, in an audit."""
        return self.rule.proposal(learner, state)

    def take(self, learner: GoalLearner, answer: Demonstrations) -> None:
        """Give the learner the answer, and see who would end the lesson."""
        agrees, before, shown = as_expected(learner, answer), learner.action, learner.shown
        self.rule.take(learner, answer)
        self.agreed = self.agreed + 1 if agrees else 0
        if self.agreed == _AGREE:
            self.on_end(RULES[0], learner)
        if learner.shown is shown:
            return  # held out: it learnt nothing
        changed = (before != learner.action)[learner.candidates].mean()
        self.same = self.same + 1 if changed < _FEW else 0
        if self.same == _UNCHANGED:
            self.on_end(RULES[1], learner)


def as_expected(learner: GoalLearner, answer: Demonstrations) -> bool:
    """Whether an answer is what the learner would have said, or as good."""
    q, arrived = learner.q, learner.arrived
    said = all(
        not arrived[state] and q[state, action] >= q[state].max() - ALIKE
        for state, action in answer.pairs
    )
    return said and bool(np.all(arrived[answer.ends[:, 2]]))
