"""One network taught once: what came of it with and without advice, and the way there.

Questions are chosen without regard to advice, and advice is applied to what was learnt: rows differ
by the advice alone, and one training serves them all.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import torch

from experiments.grasping.assessment import assess
from experiments.grasping.learning import CurvePoint, curve_point, prepare
from experiments.grasping.tables.learners import Learner, with_everything
from experiments.grasping.teacher import GraspTeacher, TeacherConfig
from experiments.kit.robot_task import load_robot_task
from irl.active import Progress, Result, active_fa_mlirl
from irl.advice import Advice
from irl.demonstrations import Demonstrations
from irl.experts import Expert, OracleExpert
from irl.metrics import Share
from irl.policy_update import PolicyUpdate
from irl.preferences import StatePreferences
from irl.problem import LearningProblem
from irl.teacher import Teacher

ADVICE = ("none", "action", "state", "both")
MEASURED = (
    *("accuracy_strict", "accuracy_strict_ceiling", "strict_of_ceiling", "accuracy_optimal"),
    *("accuracy_optimal_all", "success_mdp", "success_mdp_all", "success_mdp_oracle"),
    "demonstrated_fraction",
)


@cache
def shared_teacher(folder: str) -> GraspTeacher:
    """The default teacher of the task in a folder; a worker reads it once."""
    torch.set_num_threads(1)
    return GraspTeacher(load_robot_task(Path(folder)), TeacherConfig())


@dataclass(eq=False)
class Lesson:
    """A learner at work with one seed.

    Attributes:
        teacher: who shows and answers.
        learner: how it is learnt.
        seed: of all chance.
        problem: what the learner is told.
        initial: what it was shown first.
        answers: who goes on to answer.
        curve: one point a training, the last stage's.
    """

    teacher: GraspTeacher
    learner: Learner
    seed: int
    problem: LearningProblem
    initial: Demonstrations
    answers: Teacher
    curve: list[CurvePoint]

    @classmethod
    def begin(cls, teacher: GraspTeacher, learner: Learner, seed: int) -> "Lesson":
        """Show the first demonstrations."""
        rng = np.random.default_rng(seed)
        problem, initial, answers, _ = prepare(teacher.task, teacher, learner.learning, rng)
        if learner.everything:
            problem = with_everything(problem)
        return cls(teacher, learner, seed, problem, initial, replace(answers, expert=None), [])

    def learn(self, most: int, strategy: str = "", after: Result | None = None) -> Result:
        """Learn, and ask until ``most`` states are demonstrated; the first training only once.

        Args:
            most: demonstrated states at the end; those shown first, to ask nothing.
            strategy: which states are asked about; the learner's own by default.
            after: what the first training alone led to, to go on from there.
        """
        active = self.learner.learning.active
        active = replace(
            active,
            max_demonstrated=max(most, self.initial.n_states_demonstrated),
            state_query=strategy or active.state_query,
        )
        self.curve = []
        return active_fa_mlirl(
            self.problem,
            self.initial if after is None else after,
            self.answers,
            active,
            rng=np.random.default_rng([self.seed, 1]),
            callback=self._follow,
        )

    def row(self, learnt: Result, advice: str = "none") -> dict[str, Any]:
        """The measures of ``MEASURED`` with advice of one kind, and the number of answers."""
        return {"advice": advice, **self.judged(learnt, self.advised(learnt, advice))}

    def judged(self, learnt: Result, q: np.ndarray) -> dict[str, Any]:
        """The same of action values ``[n_states, n_actions]``."""
        rng = np.random.default_rng([self.seed, 2])
        task, oracle = self.teacher.task, self.teacher.oracle
        told = assess(task, oracle, self._policy(q), learnt.demonstrations, rng)
        shown = {name: getattr(told, name) for name in MEASURED}
        plain = {n: v.value if isinstance(v, Share) else v for n, v in shown.items()}
        labels = learnt.demonstrations.n_states_demonstrated
        return {**plain, "labels": labels, "answers": len(learnt.history)}

    def advised(self, learnt: Result, advice: str) -> np.ndarray:
        """Action values with advice about all clusters, about states, both, or none."""
        task, model, f = self.teacher.task, self.problem.model, learnt.f
        told = Advice.none(model.n_states, model.n_actions)
        if advice in ("action", "both"):
            told = self.told_by(OracleExpert(self.teacher.oracle, task.start_states))
        if advice in ("state", "both"):
            f = StatePreferences(task.preferred, task.avoided).apply(f)
        return self.values(learnt, f, told)

    def told_by(self, expert: Expert) -> Advice:
        """What an expert says of all clusters."""
        told = Advice.none(self.problem.model.n_states, self.problem.model.n_actions)
        for name, states in self.teacher.task.clusters.items():
            answer = expert.advise(name, states)
            told = told.add(states, answer.preferred, answer.avoided)
        return told

    def values(self, learnt: Result, f: np.ndarray, told: Advice) -> np.ndarray:
        """Action values of VR values ``[n_states]`` under advice about actions."""
        active = self.learner.learning.active
        update = PolicyUpdate(
            *(self.problem.model, self.problem.gamma),
            *(active.policy_update, active.avoid, active.prefer),
        )
        return update.q(f, learnt.caution, told, learnt.ends)

    def points(self) -> list[dict[str, Any]]:
        """The learning curve of the last stage, as JSON holds it."""
        return [asdict(point) for point in self.curve]

    def _follow(self, progress: Progress) -> None:
        if progress.q is not None:
            action = self._policy(progress.q)
            self.curve.append(curve_point(self.teacher.task, self.teacher, action, progress))

    def _policy(self, q: np.ndarray) -> np.ndarray:
        """The best action of each state of the task; a thesis learner may choose what cannot be."""
        q = q[: self.teacher.task.model.n_states]
        return np.where(np.isfinite(q).any(axis=1), q.argmax(axis=1), -1)


def per_seed(rows: Sequence[dict[str, Any]], names: Sequence[str]) -> dict[str, list[Any]]:
    """Of rows of one kind, one a seed, each named value as a list."""
    return {name: [row[name] for row in rows] for name in names}
