"""Learning the grasping task from a simulated teacher: what its experiments share."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated

import numpy as np
from tqdm import tqdm

from experiments.grasping.teacher import GraspTeacher
from irl.active import ActiveConfig, Progress, Result, active_fa_mlirl
from irl.active_state import training_files
from irl.choices import Limits, Settings, check_choice
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.factors import one_hot
from irl.files import atomic_path
from irl.formats import read_json, write_json
from irl.metrics import accuracy_on_unseen, success_mdp
from irl.policy import Policy
from irl.problem import LearningProblem
from irl.rule_trust import AT_THE_END, ON_THE_WAY, Trust
from irl.task_data import EVIDENCE, TaskData
from irl.teacher import Teacher
from irl.training_config import TrainingConfig
from models.task.spaces import N_STATES

THESIS_DEMONSTRATIONS, THESIS_DEMONSTRATED = 981, 0.0811
"""Initial demonstrations of §6.3, and the share of demonstrated states in Table 6.3."""
FACTORED = "factored"
FACTORS = (("x", "y", "z"), ("alpha", "beta", "gamma"), ("gripper",))
"""Columns of ``states.csv`` that name a state: its position, orientation and gripper."""
STRONG = TrainingConfig(
    step=3e-3,
    learn_caution=True,
    bellman_weight=100.0,
    bellman_batch=N_STATES + 1,
    bellman_delta=0.02,
)
"""How the network learns the grasping task best: with the penalty on all states."""
CHECKPOINT, CURVE = "learning.checkpoint", "learning_curve.json"
"""What an interrupted run leaves in its folder."""


@dataclass(frozen=True)
class LearningConfig(Settings):
    """Algorithm 4.1 on the grasping task."""

    features: str = "factored"
    """What the network sees of a state: thesis or rotation, as in the task data, or factored, which
    adds to rotation a column for each position, orientation and gripper orientation."""
    demonstrations: Annotated[int, Limits(1, N_STATES)] = THESIS_DEMONSTRATIONS
    """How many distinct states are demonstrated before the first query."""
    least_purity: Annotated[float, Limits(0, 1)] = 0.95
    """A generalisation rule is left out if a smaller share of its labels is right, as far as runs
    tell that pass through the same states; 0 trusts every rule, as the thesis does."""
    active: ActiveConfig = field(
        default_factory=lambda: ActiveConfig(
            initial=replace(STRONG, iterations=200),
            refine=replace(STRONG, iterations=40),
            budget=40,
            batch=10,
            max_demonstrated=int(THESIS_DEMONSTRATED * N_STATES),
            state_query="visited_and_diverse",
            query_beta=30.0,
            policy_update="planned",
            hidden=(64, 32),
            state_preferences=False,
        )
    )
    """What the learner asks about, what it makes of advice, and its network."""


@dataclass(frozen=True)
class CurvePoint:
    """How good the policy was after one training.

    Attributes:
        query: answers before it.
        demonstrated: distinct states with labels.
        success: probability of the goal within 20 actions, mean over the start states.
        accuracy_optimal_all: share of unseen states with an action as good as the demonstrator's.
    """

    query: int
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
        trust: in each generalisation rule by kind of source, what the runs told of it.
        rules: of those, the ones used.
        evidence: transition entries by evidence.
    """

    result: Result
    initial: Demonstrations
    curve: list[CurvePoint]
    trust: dict[str, dict[str, Trust]]
    rules: dict[str, list[str]]
    evidence: Mapping[str, int]


def learn(
    task: TaskData,
    teacher: GraspTeacher,
    config: LearningConfig,
    rng: np.random.Generator,
    folder: Path | None = None,
) -> Learnt:
    """Collect the initial demonstrations and run Algorithm 4.1, with progress bars.

    Args:
        task: what to learn.
        teacher: demonstrator and expert.
        config: every choice.
        rng: the only source of chance.
        folder: keeps what was learnt so far after each training, to go on from if the run is
            interrupted; `forget` clears it.

    Raises:
        InputError: if the task data lack the features, or ``folder`` keeps other work.
    """
    problem, initial, answers, trust = prepare(task, teacher, config, rng)
    kept = None if folder is None else folder / CURVE
    curve = [] if kept is None or not kept.exists() else _read_curve(kept)
    with _Bars(config.active) as bars:

        def follow(progress: Progress) -> None:
            if progress.q is None:
                bars.show(progress)
                return
            action = Policy.from_q(progress.q, task.model.mask).action
            point = curve_point(task, teacher, action, progress)
            # A run that was cut off after this training, before it was saved, has it already.
            curve[:] = [earlier for earlier in curve if earlier.query < point.query] + [point]
            if kept is not None:
                with atomic_path(kept) as path:
                    write_json(path, {"points": [asdict(each) for each in curve]})
            bars.learnt(progress, point)

        result = active_fa_mlirl(
            problem,
            initial,
            answers,
            config.active,
            rng=rng,
            callback=follow,
            checkpoint=None if folder is None else folder / CHECKPOINT,
        )
    evidence = np.bincount(task.transitions.evidence, minlength=len(EVIDENCE))
    return Learnt(
        result,
        initial,
        curve,
        trust,
        {ON_THE_WAY: list(answers.rules or []), AT_THE_END: list(answers.rules_at_end or [])},
        dict(zip(EVIDENCE, evidence.tolist(), strict=True)),
    )


def prepare(
    task: TaskData, teacher: GraspTeacher, config: LearningConfig, rng: np.random.Generator
) -> tuple[LearningProblem, Demonstrations, Teacher, dict[str, dict[str, Trust]]]:
    """What Algorithm 4.1 is given: the problem, D₀, who answers, and the trust in each rule."""
    initial, answers, trust = teacher.initial_demonstrations(
        config.demonstrations, config.least_purity, rng
    )
    features = network_features(task, config.features)
    problem = replace(LearningProblem.of(task), features=features)
    return replace(problem, candidates=teacher.candidates(problem)), initial, answers, trust


def curve_point(
    task: TaskData, teacher: GraspTeacher, action: np.ndarray, progress: Progress
) -> CurvePoint:
    """How good a policy ``[n_states]`` is, after a training."""
    seen, oracle, starts = progress.labels.state, teacher.oracle, task.start_states
    return CurvePoint(
        progress.query,
        progress.labels.n_states_demonstrated,
        success_mdp(task.model, action, task.goal_states, starts),
        accuracy_on_unseen(action, seen, oracle, starts).value,
    )


def network_features(task: TaskData, name: str) -> np.ndarray:
    """What a network sees of the states: `LearningConfig.features`.

    Raises:
        InputError: if there are no such features.
    """
    check_choice("features", name, (*task.features, FACTORED))
    if name != FACTORED:
        return task.feature(name)
    return np.concatenate([task.feature("rotation"), one_hot(task.states, FACTORS)], axis=1)


def forget(folder: Path) -> None:
    """Remove what `learn` kept in ``folder``."""
    for path in (folder / CHECKPOINT, folder / CURVE, *training_files(folder / CHECKPOINT)):
        path.unlink(missing_ok=True)


def _read_curve(path: Path) -> list[CurvePoint]:
    """What an interrupted run kept of its curve.

    Raises:
        InputError: naming the point and field that no run could have written.
    """
    kept = read_json(path)
    points = kept.get("points") if isinstance(kept, dict) else None
    if not isinstance(points, list):
        raise InputError("field 'points' must be a list; delete the file", place=str(path))
    wanted = {
        "query": (int, 0, float("inf")),
        "demonstrated": (int, 1, float("inf")),
        "success": (float, 0, 1),
        "accuracy_optimal_all": (float, 0, 1),
    }
    curve: list[CurvePoint] = []
    for number, point in enumerate(points):
        place = f"{path}: point {number}"
        if not isinstance(point, dict) or point.keys() != wanted.keys():
            raise InputError(
                f"must have the fields {', '.join(wanted)} alone; delete the file", place=place
            )
        for name, (kind, low, high) in wanted.items():
            if type(point[name]) is not kind or not low <= point[name] <= high:
                raise InputError(
                    f"field '{name}' is {point[name]!r:.40}; delete the file", place=place
                )
        if curve and point["query"] <= curve[-1].query:
            raise InputError("field 'query' must grow; delete the file", place=place)
        curve.append(CurvePoint(**point))
    return curve


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
            if self._first.n == 0 and progress.iteration > 1:
                # What an interrupted run did took none of this run's time.
                self._first.initial = self._first.n = progress.iteration - 1
                self._first.write(f"learning goes on at iteration {progress.iteration}")
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
