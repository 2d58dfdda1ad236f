"""How good a learnt grasping policy is, by the measures of `irl.metrics`."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.grasping.teacher import Teacher
from irl.collection import held_out
from irl.demonstrations import Demonstrations
from irl.metrics import (
    Share,
    accuracy_optimal,
    accuracy_strict,
    success_mdp,
    unseen_states,
)
from irl.planning import uniform_policy
from irl.policy import Policy
from irl.task_data import TaskData
from models.task.spaces import N_STATES


@dataclass(frozen=True)
class Assessment:
    """The figures of design §5, by the names in ``result.json``."""

    accuracy_strict: Share
    accuracy_optimal: Share
    accuracy_optimal_all: Share
    success_mdp: float
    success_mdp_oracle: float
    demonstrated_fraction: float

    def as_dict(self) -> dict[str, Any]:
        """Plain figures; shares with their Wilson 95 % intervals beside them."""
        plain: dict[str, Any] = {}
        for name, value in vars(self).items():
            if isinstance(value, Share):
                plain[name] = value.value
                plain[f"{name}_interval"] = list(value.interval)
            else:
                plain[name] = value
        return plain


def assess(
    task: TaskData,
    teacher: Teacher,
    policy: Policy,
    labels: Demonstrations,
    rng: np.random.Generator,
) -> Assessment:
    """Compare a policy with its demonstrator on states that were never shown.

    Args:
        task: what was learnt.
        teacher: demonstrator and expert.
        policy: what came of it.
        labels: all demonstrations it was learnt from.
        rng: draws the held-out states.
    """
    demonstrator = teacher.demonstrator
    validation = held_out(demonstrator, labels.state, task.start_states, rng)
    optimal = demonstrator.optimal_actions

    def success(policy_table: np.ndarray) -> float:
        return success_mdp(task.model, policy_table, task.goal_states, task.start_states)

    return Assessment(
        accuracy_strict=accuracy_strict(policy.action, validation.state, validation.action),
        accuracy_optimal=accuracy_optimal(policy.action, validation.state, optimal),
        accuracy_optimal_all=accuracy_on_unseen(task, teacher, policy.action, labels.state),
        success_mdp=success(policy.action),
        success_mdp_oracle=success(uniform_policy(optimal)),
        demonstrated_fraction=labels.demonstrated_fraction(N_STATES),
    )


def accuracy_on_unseen(
    task: TaskData, teacher: Teacher, action: np.ndarray, shown: np.ndarray
) -> Share:
    """Share of all reachable states never shown whose action is as good as the demonstrator's."""
    demonstrator = teacher.demonstrator
    unseen = unseen_states(task.model, task.start_states, shown, demonstrator.terminal)
    return accuracy_optimal(action, unseen, demonstrator.optimal_actions)
