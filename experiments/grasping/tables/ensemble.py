"""``ensemble``: when the network and the planning learner stop asking, and whether rightly.

Neither has a posterior, so members that learn from parts of the labels stand in for it
(`irl.ensemble`). Beside that rule goes the one by which the policy stopped changing.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Protocol

import numpy as np

from experiments.grasping.hidden.enough import RIGHT_ACCURACY, RIGHT_SUCCESS
from experiments.grasping.hidden.lessons import LEAST_LABELS
from experiments.grasping.tables.learners import OURS
from experiments.grasping.tables.lesson import Lesson, shared_teacher
from experiments.grasping.tables.options import Measurement, spread
from experiments.grasping.teacher import GraspTeacher
from experiments.kit.command import Output
from experiments.kit.jobs import rows_of
from experiments.kit.kept_rows import KeptRows
from irl.active import Result
from irl.choices import Limits, Members
from irl.collection import runs_from
from irl.demonstrations import Demonstrations
from irl.ensemble import EnsembleRule, Member, part_of, predicted
from irl.methods import learn
from irl.metrics import accuracy_on_unseen, success_mdp
from irl.posterior.predictions import Predicted
from irl.problem import LearningProblem
from models.task.spaces import N_STATES

RULES = ("ensemble", "policy unchanged")
UNCHANGED, IN_A_ROW = 0.01, 2
"""Share of the states, below which so many checks in a row must find that what would have been done
before will not do any more."""
_BETA = 30.0
"""Inverse temperature of the choices of ``planning``, whose values differ by 1 at most or so."""


@dataclass(frozen=True)
class Ensemble(Measurement):
    """Let the network and the planning learner stop asking by what an ensemble predicts."""

    learners: Annotated[tuple[str, ...], Members(("fa_mlirl", "planning"))] = (
        "fa_mlirl",
        "planning",
    )
    """Who learns."""
    members: Annotated[int, Limits(1, 100)] = 4
    """How many members learn from parts of the labels."""
    batch: Annotated[int, Limits(1, N_STATES)] = 10
    """How many questions are asked between two checks."""
    most: Annotated[int, Limits(1, N_STATES)] = 100
    """At how many labels a lesson is ended that neither rule ended."""
    out: Path = field(default_factory=lambda: Path("out/grasping/ensemble"))
    """The folder that the results are written to."""


class Taught(Protocol):
    """A learner in a lesson."""

    shown: Demonstrations
    ends: np.ndarray
    own: Member

    def ask(self, number: int) -> None:
        """Ask so many questions, and learn from the answers."""
        ...

    def learn_from(self, shown: Demonstrations, k: int) -> Member:
        """Learn from something else, as member ``k``."""
        ...


class TaughtNetwork:
    """The demo's learner, which asks where it is in doubt; `Taught`."""

    def __init__(self, teacher: GraspTeacher, seed: int, first: int) -> None:
        """Shown runs of ``first`` states or more."""
        # Answers count one by one: rules would settle a hundred states with a dozen of them.
        way = OURS.with_learning(demonstrations=first, least_purity=1.0)
        self._lesson = Lesson.begin(teacher, way, seed)
        self._take(self._lesson.learn(0))

    def ask(self, number: int) -> None:
        """Ask so many questions, and learn from the answers."""
        most = self.shown.n_states_demonstrated + number
        self._take(self._lesson.learn(most, after=self._learnt))

    def learn_from(self, shown: Demonstrations, k: int) -> Member:
        """Learn from something else, as member ``k``."""
        other = replace(self._lesson, initial=shown, seed=self._lesson.seed + 1000 * (k + 1))
        return _member(other.learn(0))

    def _take(self, learnt: Result) -> None:
        self._learnt, self.shown, self.ends = learnt, learnt.demonstrations, learnt.ends
        self.own = _member(learnt)


class TaughtPlanning:
    """``planning``, which is told of states drawn by chance; `Taught`."""

    def __init__(self, teacher: GraspTeacher, seed: int, first: int) -> None:
        """Shown runs of ``first`` labels or more."""
        self._oracle, task = teacher.oracle, teacher.task
        self._problem, self._seed = LearningProblem.of(task, "rotation"), seed
        self._rng = np.random.default_rng([seed, 3])
        runs: list[Demonstrations] = []
        for run in runs_from(self._oracle, task.start_states, self._rng):
            if sum(map(len, runs)) >= first:
                break
            if len(run) >= LEAST_LABELS and len(run.ends):
                runs.append(run)
        self._take(Demonstrations.concatenate(runs))

    def ask(self, number: int) -> None:
        """Ask so many questions, and learn from the answers."""
        shown, oracle = self.shown, self._oracle
        known = np.union1d(shown.state, shown.ends[:, 2])
        left, run = np.setdiff1d(self._problem.model.acting, known), int(shown.trajectory.max()) + 1
        answers = [shown]
        for k, state in enumerate(self._rng.choice(left, number, replace=False).tolist()):
            done = bool(oracle.terminal[state])
            pairs = [] if done else [(state, oracle.label(state, self._rng))]
            end = state if done else None
            answers.append(Demonstrations.from_pairs(pairs, run + len(shown.ends) + k, end=end))
        self._take(Demonstrations.concatenate(answers))

    def learn_from(self, shown: Demonstrations, k: int) -> Member:
        """Learn from something else, as member ``k``."""
        rng = np.random.default_rng([self._seed, 4, k + 1])
        return Member(learn("planning", self._problem, shown, rng=rng).q, _BETA)

    def _take(self, shown: Demonstrations) -> None:
        self.shown, self.ends = shown, np.unique(shown.ends[:, 2])
        self.own = self.learn_from(shown, -1)


TAUGHT: Mapping[str, Callable[[GraspTeacher, int, int], Taught]] = {
    "fa_mlirl": TaughtNetwork,
    "planning": TaughtPlanning,
}


def run_ensemble(config: Ensemble, output: Output) -> dict[str, Any]:
    """Give every lesson that is still missing, and count."""
    teacher = shared_teacher(str(config.task))
    sizes = {"members": config.members, "batch": config.batch, "most": config.most}
    kept = KeptRows(output, {"task": teacher.task.task_hash, **sizes})
    lessons = rows_of(
        list(product(config.learners, config.all_seeds)),
        partial(one_lesson, str(config.task), (config.members, config.batch, config.most)),
        kept,
        workers=config.workers,
        cluster=config.cluster,
        unit="lesson",
    )
    rows = [
        {
            "learner": name,
            "rule": rule,
            **counted([x for x in lessons if x["learner"] == name], rule),
        }
        for name in config.learners
        for rule in RULES
    ]
    for row in rows:
        print(
            f"{row['learner']:10}{row['rule']:18}ended {row['ended']} of {row['lessons']}, "
            f"{row['wrong']} of them wrongly"
        )
    kept.forget()
    return {"rows": rows, "lessons": lessons, "seeds": list(config.all_seeds)}


@dataclass(frozen=True)
class Check:
    """What was predicted and true after some labels.

    Attributes:
        labels: how many.
        predicted: success and accuracy, by the ensemble.
        true: the same.
        changed: share of the states where it would not do any more what it would have done at the
            check before; 1 at first.
    """

    labels: int
    predicted: tuple[float, float]
    true: tuple[float, float]
    changed: float

    @property
    def right(self) -> bool:
        """Whether a lesson may be ended here."""
        return self.true[0] >= RIGHT_SUCCESS and self.true[1] >= RIGHT_ACCURACY


def one_lesson(folder: str, sizes: tuple[int, int, int], job: tuple[str, int]) -> dict[str, Any]:
    """Ask until both rules ended it, or enough labels were given."""
    (name, seed), (members, batch, most) = job, sizes
    teacher, rng = shared_teacher(folder), np.random.default_rng([seed, 5])
    taught, rule = TAUGHT[name](teacher, seed, batch), EnsembleRule()
    checks: list[Check] = []
    ended: dict[str, int] = {}
    still, last = 0, None
    while len(ended) < len(RULES):
        check = checked(taught, teacher, members, last, rng)
        checks.append(check)
        still = still + 1 if check.changed < UNCHANGED else 0
        for each, over in zip(
            RULES, (rule(Predicted(*check.predicted)), still >= IN_A_ROW), strict=True
        ):
            if over:
                ended.setdefault(each, len(checks) - 1)
        if check.labels >= most:
            break
        last = taught.own.action(teacher.task.model)
        taught.ask(batch)
    told = [asdict(check) | {"right": check.right} for check in checks]
    return {"learner": name, "seed": seed, "checks": told, "ended": ended}


def checked(
    taught: Taught,
    teacher: GraspTeacher,
    members: int,
    last: np.ndarray | None,
    rng: np.random.Generator,
) -> Check:
    """Ask an ensemble of so many members, and see what is true; ``last``: actions before."""
    task, shown, action = teacher.task, taught.shown, taught.own.action(teacher.task.model)
    others = [taught.learn_from(part_of(shown, rng), k) for k in range(members)]
    seen = np.union1d(shown.state, taught.ends)
    judged = np.setdiff1d(task.model.acting, seen)
    told = predicted(task.model, taught.own, others, taught.ends, task.start_states, judged)
    accuracy = accuracy_on_unseen(action, seen, teacher.oracle, task.start_states).value
    return Check(
        len(shown),
        (told.success, told.accuracy),
        (success_mdp(task.model, action, task.goal_states, task.start_states), accuracy),
        1.0 if last is None else float(1 - taught.own.lets_pass(judged, last[judged]).mean()),
    )


def counted(lessons: Sequence[dict[str, Any]], rule: str) -> dict[str, Any]:
    """How many lessons a rule ended, how many wrongly, and at what, mean and interval."""
    ends = [x["checks"][x["ended"][rule]] for x in lessons if rule in x["ended"]]
    wrong = sum(not each["right"] for each in ends)
    told: dict[str, Any] = {"lessons": len(lessons), "ended": len(ends), "wrong": wrong}
    if not ends:
        return told
    for kind in ("predicted", "true"):
        for k, name in enumerate(("success", "accuracy")):
            told[f"{kind}_{name}"] = spread([each[kind][k] for each in ends])
    return told | {"labels": spread([each["labels"] for each in ends])}


def _member(learnt: Result) -> Member:
    return Member(learnt.q, learnt.beta)
