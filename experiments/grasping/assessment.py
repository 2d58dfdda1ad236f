"""How good a learnt grasping policy is, by the measures of `irl.metrics`."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from irl.collection import held_out
from irl.demonstrations import Demonstrations
from irl.demonstrators import OracleDemonstrator
from irl.metrics import (
    Share,
    accuracy_on_unseen,
    accuracy_optimal,
    accuracy_strict,
    success_mdp,
    unseen_states,
)
from irl.planning import uniform_policy
from irl.task_data import TaskData
from models.task.spaces import N_STATES


@dataclass(frozen=True)
class Assessment:
    """The figures by the names in ``result.json``.

    ``accuracy_strict_ceiling`` is what the best of policies can expect of ``accuracy_strict``: of k
    actions that are equally good the demonstrator shows each with probability 1/k, or by habit one.
    ``strict_of_ceiling`` is which share of that this policy can expect, over all unseen states: the
    same without the chance of a hundred draws.
    """

    accuracy_strict: Share
    accuracy_strict_ceiling: float
    accuracy_optimal: Share
    accuracy_optimal_all: Share
    strict_of_ceiling: float
    success_mdp: float
    success_mdp_all: float
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
    oracle: OracleDemonstrator,
    action: np.ndarray,
    labels: Demonstrations,
    rng: np.random.Generator,
) -> Assessment:
    """Compare a policy with its demonstrator on states that were never shown.

    Args:
        task: what was learnt.
        oracle: the demonstrator, and the measure.
        action: the policy that came of it, ``[n_states]``.
        labels: all demonstrations it was learnt from.
        rng: draws the held-out states.
    """
    validation = held_out(oracle, labels.state, task.start_states, rng)
    optimal = oracle.optimal_actions
    shown = oracle.shown
    most = shown.max(axis=1)
    own = np.where(action >= 0, shown[np.arange(action.size), action], 0.0)
    unseen = unseen_states(task.model, task.start_states, labels.state, oracle.terminal)

    def success(policy_table: np.ndarray, starts: np.ndarray) -> float:
        return success_mdp(task.model, policy_table, task.goal_states, starts)

    return Assessment(
        accuracy_strict=accuracy_strict(action, validation.state, validation.action),
        accuracy_strict_ceiling=float(most[validation.state].mean()),
        accuracy_optimal=accuracy_optimal(action, validation.state, optimal),
        accuracy_optimal_all=accuracy_on_unseen(action, labels.state, oracle, task.start_states),
        strict_of_ceiling=float(own[unseen].sum() / most[unseen].sum()),
        success_mdp=success(action, task.start_states),
        success_mdp_all=success(action, np.flatnonzero(task.model.reachable(task.start_states))),
        success_mdp_oracle=success(uniform_policy(optimal), task.start_states),
        demonstrated_fraction=labels.demonstrated_fraction(N_STATES),
    )
