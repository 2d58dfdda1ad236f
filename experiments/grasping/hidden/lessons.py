"""One lesson about a hidden reward: what a learner is shown, what it asks, and how good it gets."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from experiments.grasping.hidden.costs import costs, factors
from experiments.grasping.hidden.drawn import HiddenReward, draw, with_noise
from experiments.grasping.learning import FACTORED, network_features
from experiments.kit.robot_task import load_robot_task
from irl.collection import demonstrate_to_the_end
from irl.demonstrations import Demonstrations
from irl.methods import learn
from irl.metrics import HORIZON, accuracy_on_unseen
from irl.planning import policy_success
from irl.policy import Policy
from irl.posterior.learner import GoalLearner
from irl.posterior.plan_student import taught
from irl.problem import LearningProblem
from irl.task_data import TaskData

LEAST_LABELS, TRIES = 2, 100  # a first run shorter than that is not much of a demonstration
LEARNERS = {
    **{"goal_posterior": 1, "student": 1, "goal_posterior_two": 2},
    **{"planning": 5, "fa_mlirl": 5},
}
"""Who learns, and from how many trajectories; goal_posterior asks questions besides, and what it
then knows the student is taught."""


@dataclass(frozen=True)
class Setting:
    """What lessons have in common.

    Attributes:
        folder: of the task data.
        seed: of the hidden rewards, and of all chance in the lessons.
        questions: how many may be asked.
        untold: a factor that goals may be told in, and that learners do not know of; '' for none.
    """

    folder: Path
    seed: int
    questions: int
    untold: str = ""

    @property
    def task(self) -> TaskData:
        """The task data."""
        return _task(self.folder)

    @cached_property
    def problem(self) -> LearningProblem:
        """What every learner is told."""
        problem = LearningProblem.of(self.task, "rotation")
        told = {name: values for name, values in factors().items() if name != self.untold}
        return replace(problem, costs=costs(self.task.model), factors=told)

    def reward(self, number: int) -> HiddenReward:
        """One hidden reward."""
        return draw(self.task, [number], self.seed)[0]

    def judged(self, reward: HiddenReward, q: np.ndarray, shown: Demonstrations) -> dict[str, Any]:
        """How good a policy is: over all free states, from the worst of them, and in its choices.

        Success from the worst start is compared with nothing: a goal that chance keeps the best
        policy from is no fault of the learner, so ``success_mdp_oracle`` is beside it.
        """
        task = self.task
        action = Policy.from_q(q, task.model.mask).action
        goal, starts = reward.goal_states, task.start_states
        success = policy_success(task.model, action, goal, HORIZON)[starts]
        best = reward.oracle.optimal_actions
        ideal = policy_success(
            task.model, np.where(best.any(axis=1), best.argmax(axis=1), -1), goal, HORIZON
        )[starts]
        seen = np.union1d(shown.state, shown.ends[:, 2])
        return {
            "success_mdp": float(success.mean()),
            "worst_start": float(success.min()),
            "success_mdp_oracle": float(ideal.mean()),
            "accuracy_optimal_all": accuracy_on_unseen(action, seen, reward.oracle, starts).value,
            "labels": len(shown),
        }


@cache
def _task(folder: Path) -> TaskData:
    return load_robot_task(folder)


@cache
def shared_setting(folder: str, seed: int, questions: int, untold: str = "") -> Setting:
    """The setting of a worker's lessons, which read the task once."""
    return Setting(Path(folder), seed, questions, untold)


def shown_runs(
    setting: Setting, reward: HiddenReward, count: int, rng: np.random.Generator
) -> Demonstrations:
    """Runs from starts drawn by chance, to their ends, the first of two labels or more."""
    runs = Demonstrations.empty()
    tries = 0
    while np.unique(runs.ends[:, 0]).size < count and tries < TRIES:
        tries += 1
        start = int(rng.choice(setting.task.start_states))
        run = demonstrate_to_the_end(reward.oracle, [start], rng)
        if not len(run.ends) or (len(run) < LEAST_LABELS and tries < TRIES / 2):
            continue
        number = len(runs.ends)
        ends = run.ends.copy()
        ends[:, 0] = number
        run = replace(run, trajectory=np.full_like(run.trajectory, number), ends=ends)
        runs = Demonstrations.concatenate([runs, run])
    return runs


class LessonRule(Protocol):
    """Leads a lesson: whether it is over, what is asked, and what an answer is for."""

    def __call__(self, learner: GoalLearner) -> bool:
        """Whether the lesson is over."""
        ...

    def question(self, learner: GoalLearner) -> int:
        """The state to ask about next."""
        ...

    def proposal(self, learner: GoalLearner, state: int) -> int | None:
        """What the learner would do there, in an audit."""
        ...

    def take(self, learner: GoalLearner, answer: Demonstrations) -> None:
        """Give the learner the answer."""
        ...


@dataclass
class FixedNumber:
    """Ends a lesson after as many answers; the learner learns from each.

    Attributes:
        left: answers still to come.
    """

    left: int

    def __call__(self, learner: GoalLearner) -> bool:
        """Whether the lesson is over."""
        return self.left == 0

    def question(self, learner: GoalLearner) -> int:
        """The state to ask about next."""
        return learner.question()

    def proposal(self, learner: GoalLearner, state: int) -> None:
        """There is no audit."""

    def take(self, learner: GoalLearner, answer: Demonstrations) -> None:
        """Give the learner the answer."""
        self.left -= 1
        learner.learn(Demonstrations.concatenate([learner.shown, answer]), rounds=1)


def asked(
    setting: Setting,
    reward: HiddenReward,
    shown: Demonstrations,
    rng: np.random.Generator,
    rule: LessonRule,
) -> Iterator[GoalLearner]:
    """A learner after its runs, and after each answer, until it has enough by a rule.

    An answer is what the demonstrator would do in that state, or that there is nothing to do. In an
    audit it is what the learner would do, if that is as good.
    """
    learner = GoalLearner(setting.problem, rng=rng)
    learner.learn(shown)
    yield learner
    for k in range(setting.questions):
        if rule(learner):
            return
        state, number = rule.question(learner), len(shown.ends) + 1000 + k
        done = bool(reward.oracle.terminal[state])
        pairs = (
            [] if done else [(state, will_do(reward, state, rule.proposal(learner, state), rng))]
        )
        answer = Demonstrations.from_pairs(pairs, number, "human", state if done else None)
        rule.take(learner, answer)
        yield learner


def will_do(
    reward: HiddenReward, state: int, proposed: int | None, rng: np.random.Generator
) -> int:
    """The demonstrator's action; the proposed one, if both are right."""
    said, right = reward.oracle.label(state, rng), reward.oracle.optimal_actions[state]
    return proposed if proposed is not None and right[said] and right[proposed] else said


def lesson(
    setting: Setting, names: Sequence[str], number: int, noise: float
) -> list[dict[str, Any]]:
    """Rows of a lesson about one reward: before its questions, and after them.

    Args:
        setting: what lessons have in common.
        names: who learns; one of `LEARNERS`, or ``goal_posterior`` and its student.
        number: of the reward.
        noise: the share of wrong labels.
    """
    name, *_ = names
    reward = with_noise(setting.reward(number), noise)
    rng = np.random.default_rng([setting.seed, number, round(1000 * noise), LEARNERS[name]])
    shown = shown_runs(setting, reward, LEARNERS[name], rng)
    rows = []
    if name in ("goal_posterior", "goal_posterior_two", "student"):
        asks = 0 if name == "goal_posterior_two" else setting.questions
        for k, learner in enumerate(asked(setting, reward, shown, rng, FixedNumber(asks))):
            if name != "student" and k in (0, setting.questions // 2, setting.questions):
                predicted = learner.predicted
                rows.append(
                    {"method": name, "answers": k}
                    | setting.judged(reward, learner.q, learner.shown)
                    | {"predicted_success": predicted.success}
                    | {"predicted_accuracy": predicted.accuracy}
                    | {"ends_agree": learner.ends_agree, "unexplained": learner.unexplained}
                )
        if "student" in names:
            student = taught(learner, network_features(setting.task, FACTORED), rng=rng)
            of_student = setting.judged(reward, student.q, learner.shown)
            rows.append({"method": "student", "answers": setting.questions} | of_student)
    else:
        # Whatever was learnt, as it was learnt: pruning would hide what a reward cannot say.
        options: dict[str, Any] = {"prune": False} if name == "planning" else {}
        learnt = learn(name, setting.problem, shown, rng=rng, **options)
        rows.append({"method": name, "answers": 0} | setting.judged(reward, learnt.q, shown))
    return [{**reward.told, "label_noise": noise, **row} for row in rows]
