"""``advice``: what advice about actions and about states is worth, from few labels to many."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any

from experiments.grasping.tables.learners import OURS
from experiments.grasping.tables.lesson import ADVICE, MEASURED, Lesson, per_seed, shared_teacher
from experiments.grasping.tables.options import Measurement, spread, told
from experiments.kit.command import Output
from experiments.kit.jobs import rows_of
from experiments.kit.kept_rows import KeptRows
from irl.choices import Limits
from models.task.spaces import N_STATES

GAINED = ("accuracy_optimal_all", "success_mdp")


@dataclass(frozen=True)
class AdviceGains(Measurement):
    """Give the demo's learner advice of each kind, and see what it gains and what it loses."""

    labels: Annotated[tuple[int, ...], Limits(1, N_STATES)] = (7, 30, 160)
    """How many states are demonstrated; 160 are 1 % of them."""
    out: Path = field(default_factory=lambda: Path("out/grasping/advice"))
    """The folder that the results are written to."""


def run_advice(config: AdviceGains, output: Output) -> dict[str, Any]:
    """Teach what is still missing, and compare what was learnt with and without advice."""
    teacher = shared_teacher(str(config.task))
    kept = KeptRows(output, {"task": teacher.task.task_hash})
    outcomes = rows_of(
        # Seed by seed, so that an interrupted run has whole tables of fewer seeds.
        [(labels, seed) for seed, labels in product(config.all_seeds, config.labels)],
        partial(advised, str(config.task)),
        kept,
        workers=config.workers,
        cluster=config.cluster,
    )
    rows = [row for outcome in outcomes for row in outcome]
    table = [gains(rows, n, advice) for n in config.labels for advice in ADVICE]
    show(table)
    kept.forget()
    return {"rows": table, "seeds": list(config.all_seeds)}


def advised(folder: str, job: tuple[int, int]) -> list[dict[str, Any]]:
    """One training, and what comes of it by kind of advice."""
    labels, seed = job
    way = OURS.with_learning(demonstrations=labels)
    lesson = Lesson.begin(shared_teacher(folder), way, seed)
    learnt = lesson.learn(0)
    return [{"shown": labels, "seed": seed, **lesson.row(learnt, advice)} for advice in ADVICE]


def gains(rows: Sequence[dict[str, Any]], labels: int, advice: str) -> dict[str, Any]:
    """Measures by seed, what advice adds on the same seeds, and the most success it cost."""
    own, without = (
        [row for row in rows if (row["shown"], row["advice"]) == (labels, name)]
        for name in (advice, "none")
    )
    added = {
        name: [a[name] - b[name] for a, b in zip(own, without, strict=True)] for name in GAINED
    }
    return {
        "labels": labels,
        "advice": advice,
        **per_seed(own, MEASURED),
        "gain": {name: spread(values) for name, values in added.items()},
        "success_lost_at_most": max(0.0, -min(added["success_mdp"])),
    }


def show(table: Sequence[dict[str, Any]]) -> None:
    """Print means with intervals, and gains in points."""
    print(f"{'labels':>6} {'advice':8}{'as good':>24}{'gain':>20}{'success':>24}{'gain':>20}")
    for row in table:
        line = f"{row['labels']:6d} {row['advice']:8}"
        for name in GAINED:
            gain, low, high = (100 * value for value in row["gain"][name])
            line += f"{told(row[name]):>24}" + f"{gain:+.1f} [{low:+.1f}, {high:+.1f}]".rjust(20)
        print(line)
