"""``goal_posterior``: Bayesian inverse reinforcement learning with structured hypotheses.

A hypothesis is a goal, a state or a region, and a size for each named cost. In reading order:
`plans` plans for many at once, `goals` proposes, `evidence` weighs what was shown, `shares` says
for how many combinations of sizes each stands, `belief` seeks hypotheses and keeps them,
`predictions` says what follows, `questions` what to ask, `audit` what answers held out said of the
predictions, `arriving` has values lead to the goal, `learner` does all that in turn, `enough` says
when to stop, and `plan_student` makes a VR network of it. `experiments/grasping.md` tells more.
"""

from irl.posterior.enough import EnoughRule, claim
from irl.posterior.learner import GoalConfig, GoalLearner
from irl.posterior.plan_student import PlanStudent, PlanStudentConfig, taught

__all__ = [
    "EnoughRule",
    "GoalConfig",
    "GoalLearner",
    "PlanStudent",
    "PlanStudentConfig",
    "claim",
    "taught",
]
