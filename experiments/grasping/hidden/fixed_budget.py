"""A lesson of a fixed length, for comparison with `EnoughRule`: as many answers as in the thesis.

About states drawn by chance, as in Table 6.3, and learnt from at once: nothing is chosen by what
was said before, so that hypotheses need be sought only when all is said.
"""

import numpy as np

from experiments.grasping.hidden.drawn import HiddenReward
from experiments.grasping.hidden.lessons import Setting
from experiments.grasping.learning import THESIS_DEMONSTRATED
from irl.demonstrations import Demonstrations
from irl.posterior.learner import GoalLearner
from models.task.spaces import N_STATES

THESIS_ANSWERS = int(THESIS_DEMONSTRATED * N_STATES)
_ROUNDS = 24  # of seeking hypotheses; a steep posterior is climbed step by step


def after_answers(
    setting: Setting,
    reward: HiddenReward,
    shown: Demonstrations,
    number: int,
    rng: np.random.Generator,
) -> GoalLearner:
    """A learner that was shown runs, and then told of so many states what to do there.

    Args:
        setting: what lessons have in common.
        reward: who answers.
        shown: the runs.
        number: how many answers, of as many states as there are at most.
        rng: draws the states, the demonstrator's choices, and hypotheses.
    """
    learner = GoalLearner(setting.problem, rng=rng)
    left = np.setdiff1d(learner.candidates, np.union1d(shown.state, shown.ends[:, 2]))
    answers, done = [shown], reward.oracle.terminal
    for k, state in enumerate(rng.choice(left, min(number, left.size), replace=False).tolist()):
        pairs = [] if done[state] else [(state, reward.oracle.label(state, rng))]
        end = state if done[state] else None
        answers.append(Demonstrations.from_pairs(pairs, len(shown.ends) + 1000 + k, "human", end))
    learner.learn(Demonstrations.concatenate(answers), rounds=_ROUNDS)
    return learner
