"""``network``: what the size of the network is worth (thesis 7.3), at 1 % of the states."""

from dataclasses import dataclass, field
from functools import partial
from itertools import product
from pathlib import Path
from time import process_time
from typing import Annotated, Any

from experiments.grasping.tables.learners import OURS
from experiments.grasping.tables.lesson import MEASURED, Lesson, per_seed, shared_teacher
from experiments.grasping.tables.options import Measurement, told
from experiments.kit.command import Output
from experiments.kit.jobs import rows_of
from experiments.kit.kept_rows import KeptRows
from irl.choices import Limits
from models.task.spaces import N_STATES

SIZES: tuple[tuple[int, ...], ...] = ((16,), (64,), (32, 16), (64, 32), (150, 50), (64, 64, 32))
FEATURES = ("thesis", "rotation", "factored")


@dataclass(frozen=True)
class Network(Measurement):
    """Learn with networks of other sizes, and from other features."""

    seeds: Annotated[int, Limits(1, 100_000)] = 5
    """How many seeds there are."""
    labels: Annotated[int, Limits(1, N_STATES)] = 160
    """How many states are demonstrated; 160 are 1 % of them."""
    out: Path = field(default_factory=lambda: Path("out/grasping/network"))
    """The folder that the results are written to."""


Case = tuple[str, tuple[int, ...]]
"""Features, and hidden widths."""


def cases() -> list[Case]:
    """All sizes with the demo's features, and the demo's size with all features."""
    own = OURS.learning
    sizes: list[Case] = [(own.features, size) for size in SIZES]
    return sizes + [(name, own.active.hidden) for name in FEATURES if name != own.features]


def run_network(config: Network, output: Output) -> dict[str, Any]:
    """Teach what is still missing, and tabulate."""
    teacher = shared_teacher(str(config.task))
    kept = KeptRows(output, {"task": teacher.task.task_hash, "labels": config.labels})
    jobs = [
        (features, *hidden, seed) for (features, hidden), seed in product(cases(), config.all_seeds)
    ]
    rows = rows_of(
        jobs,
        partial(learnt_with, str(config.task), config.labels),
        kept,
        workers=config.workers,
        cluster=config.cluster,
    )
    table: list[dict[str, Any]] = []
    for features, hidden in cases():
        same = [r for r in rows if (r["features"], tuple(r["hidden"])) == (features, hidden)]
        case: dict[str, Any] = {"features": features, "hidden": list(hidden)}
        table.append(case | per_seed(same, (*MEASURED, "seconds")))
    for row in table:
        name = f"{row['features']:10}{'–'.join(map(str, row['hidden'])):10}"
        print(name + told(row["accuracy_optimal_all"]), told(row["success_mdp"]))
    kept.forget()
    return {"rows": table, "seeds": list(config.all_seeds), "labels": config.labels}


def learnt_with(folder: str, labels: int, job: tuple[Any, ...]) -> dict[str, Any]:
    """One network with one seed: features, widths and seed, one after the other."""
    features, *hidden, seed = job
    way = OURS.with_learning(features=features, demonstrations=labels)
    lesson = Lesson.begin(shared_teacher(folder), way.with_active(hidden=tuple(hidden)), seed)
    began = process_time()
    learnt = lesson.learn(0)
    seconds = process_time() - began
    return {"features": features, "hidden": hidden, "seconds": seconds, **lesson.row(learnt)}
