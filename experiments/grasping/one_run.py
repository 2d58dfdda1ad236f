"""What a single run teaches, beside a thousand labels: `goal_posterior` on one trajectory."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from time import process_time

import numpy as np

from experiments.grasping.hidden.costs import costs, factors
from experiments.grasping.teacher import GraspTeacher
from irl.demonstrations import Demonstrations
from irl.methods import learn
from irl.metrics import accuracy_on_unseen, success_mdp
from irl.policy import Policy
from irl.problem import LearningProblem

LEAST_LABELS, TRIES = 2, 100  # a shorter run is not much of a demonstration


@dataclass(frozen=True)
class OneRun:
    """How good what came of one trajectory is, by the names in ``result.json``.

    Attributes:
        labels: how many there were.
        accuracy_optimal_all: share of all other states with an action as good as the
            demonstrator's.
        success_mdp: probability of the goal within 20 actions, mean over the free states.
        seconds: of processor time that learning took.
    """

    labels: int
    accuracy_optimal_all: float
    success_mdp: float
    seconds: float


def learn_from_one(
    teacher: GraspTeacher, rng: np.random.Generator, seed: int
) -> tuple[OneRun, Policy] | None:
    """Learn from the first run of two labels or more; None if none says where it ended.

    Costs are known by name and the task's factors as such; the goal, the sizes of the costs and
    the care of the demonstrator are not.

    Args:
        teacher: who shows the run, and is compared with.
        rng: draws the run, and what the learner tries.
        seed: is noted in the policy.
    """
    run = next(whole_runs(teacher, rng), None)
    if run is None:
        return None
    began, task = process_time(), teacher.task
    problem = replace(LearningProblem.of(task), costs=costs(task.model), factors=factors())
    q = learn("goal_posterior", problem, run, rng=rng).q
    seconds = process_time() - began
    policy = Policy.from_q(
        q, task.model.mask, task_hash=task.task_hash, algorithm="goal_posterior", seed=seed
    )
    seen, starts = np.union1d(run.state, run.ends[:, 2]), task.start_states
    return OneRun(
        len(run),
        accuracy_on_unseen(policy.action, seen, teacher.oracle, starts).value,
        success_mdp(task.model, policy.action, task.goal_states, starts),
        seconds,
    ), policy


def whole_runs(teacher: GraspTeacher, rng: np.random.Generator) -> Iterator[Demonstrations]:
    """Of a hundred runs those that have two labels or more, and say where they ended."""
    for run in islice(teacher.runs(rng), TRIES):
        if len(run) >= LEAST_LABELS and len(run.ends):
            yield run
