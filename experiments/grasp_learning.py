"""Learning the grasping task from a simulated teacher: what its experiments share."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from tqdm import tqdm

from irl.active import ActiveConfig, Progress, Result, active_fa_mlirl
from irl.choices import check_range
from irl.collection import held_out, initial_demonstrations
from irl.demonstrations import Demonstrations, generalise
from irl.demonstrators import OracleDemonstrator, OracleExpert
from irl.errors import InputError
from irl.generalisation import rule_purity
from irl.metrics import (
    Share,
    accuracy_optimal,
    accuracy_strict,
    success_mdp,
    unseen_states,
)
from irl.planning import uniform_policy
from irl.policy import Policy
from irl.preferences import StatePreferences
from irl.task_data import EVIDENCE, TaskData
from irl.training import TrainingConfig
from models.task.clusters import uncomfortable_states
from models.task.spaces import LOST, N_STATES

THESIS_DEMONSTRATIONS, THESIS_DEMONSTRATED = 981, 0.0811
"""Initial demonstrations of §6.3, and the share of demonstrated states in Table 6.3."""


@dataclass(frozen=True)
class TeacherConfig:
    """The hidden reward of the simulated demonstrator, in units of the goal's."""

    action_cost: float = 0.01
    """Of each action."""
    discomfort: float = 0.05
    """Of entering a pose that §5.10.1 calls less comfortable."""
    surprise: float = 0.5
    """Of an action, times the probability that its likeliest outcome does not come. A turn that
    leaves the cube halfway between two orientations is a toss-up, and what follows from there
    is not what the state's name says: a person would not demonstrate it."""
    tolerance: float = 0.005
    """Difference of value below which two actions are equally good: half an action's cost."""
    label_noise: float = 0.0
    """Probability of a wrong label."""


@dataclass(frozen=True)
class LearningConfig:
    """Algorithm 4.1 on the grasping task."""

    features: str = "rotation"
    """Which features of the task data the network sees: rotation or thesis."""
    demonstrations: int = THESIS_DEMONSTRATIONS
    """Distinct states demonstrated before the first query."""
    least_purity: float = 0.95
    """Generalisation rules whose labels are right less often are left out."""
    active: ActiveConfig = field(
        default_factory=lambda: ActiveConfig(
            initial=TrainingConfig(iterations=3000, bellman_weight=10.0, bellman_delta=0.05),
            refine=TrainingConfig(
                iterations=100, step=3e-4, bellman_weight=10.0, bellman_delta=0.05
            ),
            budget=20,
            max_demonstrated=int(THESIS_DEMONSTRATED * N_STATES),
            state_query="visitation_entropy",
            query_beta=30.0,
            state_preferences=False,
        )
    )
    """Training, queries and advice."""


class Teacher:
    """Demonstrator and expert of one mind: an optimal policy under a hidden reward."""

    def __init__(self, task: TaskData, config: TeacherConfig) -> None:
        """Plan with the task's own transition model."""
        self.demonstrator = OracleDemonstrator(
            task.model,
            task.goal_states,
            gamma=task.gamma,
            uncomfortable=uncomfortable_states(),
            lost_states=np.array([LOST]),
            action_cost=config.action_cost,
            discomfort=config.discomfort,
            surprise=config.surprise,
            tolerance=config.tolerance,
            label_noise=config.label_noise,
        )
        self.expert = OracleExpert(self.demonstrator, task.start_states)


@dataclass(frozen=True)
class CurvePoint:
    """How good the policy was after one training.

    Attributes:
        demonstrated: distinct states with labels.
        success: probability of the goal within 20 actions, mean over the start states.
        accuracy_optimal_all: share of unseen states with an action as good as the demonstrator's.
    """

    demonstrated: int
    success: float
    accuracy_optimal_all: float


@dataclass(frozen=True)
class Learnt:
    """What learning left behind.

    Attributes:
        result: of Algorithm 4.1.
        initial: the demonstrations before the first query.
        curve: one point a training.
        rules: the generalisation rules used.
        purity: each rule's share of right labels, None if it never applies.
        evidence: transition entries by evidence.
    """

    result: Result
    initial: Demonstrations
    curve: list[CurvePoint]
    rules: list[str]
    purity: Mapping[str, float | None]
    evidence: Mapping[str, int]


def learn(
    task: TaskData, teacher: Teacher, config: LearningConfig, rng: np.random.Generator
) -> Learnt:
    """Collect the initial demonstrations and run Algorithm 4.1, with progress bars.

    Raises:
        InputError: if the task data lack the features.
    """
    check_range("least_purity", config.least_purity, 0.0, 1.0)
    if config.features not in task.features:
        raise InputError(
            f"features '{config.features}' are not in the task data; "
            f"valid: {', '.join(task.features)}"
        )
    purity = {
        name: found.share
        for name, found in rule_purity(
            task.generalisation, teacher.demonstrator.optimal_actions
        ).items()
    }
    rules = [n for n, share in purity.items() if share is not None and share >= config.least_purity]
    initial = initial_demonstrations(
        teacher.demonstrator,
        task.start_states,
        config.demonstrations,
        task.generalisation,
        rules,
        rng,
    )
    curve: list[CurvePoint] = []
    with _Bars(config.active) as bars:

        def follow(progress: Progress) -> None:
            if progress.q is None:
                bars.show(progress)
                return
            action = Policy.from_q(progress.q, task.model.mask).action
            seen = progress.labels.state
            point = CurvePoint(
                progress.labels.n_states_demonstrated,
                success_mdp(task.model, action, task.goal_states, task.start_states),
                accuracy_on_unseen(task, teacher, action, seen).value,
            )
            curve.append(point)
            bars.learnt(progress, point)

        result = active_fa_mlirl(
            model=task.model,
            features=task.feature(config.features),
            gamma=task.gamma,
            fixed_vr=task.fixed_vr,
            demonstrations=initial,
            demonstrator=teacher.demonstrator,
            expert=teacher.expert,
            clusters=task.clusters,
            preferences=StatePreferences(task.preferred, task.avoided),
            generalise=lambda shown: generalise(shown, task.generalisation, rules),
            config=config.active,
            rng=rng,
            callback=follow,
            candidates=np.flatnonzero(task.model.reachable(task.start_states)),
            start_states=task.start_states,
        )
    evidence = np.bincount(task.transitions.evidence, minlength=len(EVIDENCE))
    return Learnt(
        result, initial, curve, rules, purity, dict(zip(EVIDENCE, evidence.tolist(), strict=True))
    )


class _Bars:
    """One bar for the first training, one for the queries."""

    def __init__(self, config: ActiveConfig) -> None:
        self._first = tqdm(total=config.initial.iterations, desc="learn", unit="it")
        self._queries = tqdm(total=config.budget, desc="queries", unit="query")

    def __enter__(self) -> "_Bars":
        return self

    def __exit__(self, *exception: object) -> None:
        self._first.close()
        self._queries.close()

    def show(self, progress: Progress) -> None:
        if progress.query == 0:
            self._first.update(progress.iteration - self._first.n)
            if progress.iteration % 100 == 0:
                self._first.set_postfix(log_likelihood=f"{progress.log_likelihood:.4f}")

    def learnt(self, progress: Progress, point: CurvePoint) -> None:
        self._queries.update(progress.query - self._queries.n)
        self._queries.set_postfix(
            demonstrated=point.demonstrated,
            success=f"{point.success:.1%}",
            accuracy=f"{point.accuracy_optimal_all:.1%}",
        )


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
    task: TaskData, teacher: Teacher, policy: Policy, learnt: Learnt, rng: np.random.Generator
) -> Assessment:
    """Compare a policy with its demonstrator on states that were never shown."""
    demonstrator = teacher.demonstrator
    labels = learnt.result.demonstrations
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
