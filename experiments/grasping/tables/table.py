"""``table``: thesis Table 6.3, the thesis' network beside ours, with and without advice."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any

from experiments.grasping.learning import THESIS_DEMONSTRATED
from experiments.grasping.tables.learners import LEARNERS
from experiments.grasping.tables.lesson import ADVICE, MEASURED, Lesson, per_seed, shared_teacher
from experiments.grasping.tables.options import Measurement, told
from experiments.grasping.tables.pictures import draw_curves, draw_matrix
from experiments.kit.command import Output
from experiments.kit.jobs import rows_of
from experiments.kit.kept_rows import KeptRows
from irl.choices import Limits
from models.task.spaces import N_STATES

SETS = ("initial", "random", "active")
"""981 states; up to 14.25 % by random questions; up to 8.11 % by those that the learner likes."""
MOST = {"random": int(0.1425 * N_STATES), "active": int(THESIS_DEMONSTRATED * N_STATES)}
THESIS_TABLE = {
    "initial": (0.08, 0.09, 0.14, 0.15),
    "random": (0.15, 0.15, 0.18, 0.18),
    "active": (0.19, 0.19, 0.21, 0.21),
}
"""Table 6.3: ``accuracy_strict`` by set, and by advice in the order of ``ADVICE``."""


@dataclass(frozen=True)
class Table(Measurement):
    """Make Table 6.3 anew: the thesis' network beside ours, with and without advice."""

    thesis_seeds: Annotated[int, Limits(0, 100_000)] = 10
    """How many of the seeds the thesis' network has as well, at most; it takes seven times as long.
    """
    out: Path = field(default_factory=lambda: Path("out/grasping/table"))
    """The folder that the results are written to."""


def run_table(config: Table, output: Output) -> dict[str, Any]:
    """Teach what is still missing, tabulate and draw."""
    teacher = shared_teacher(str(config.task))
    kept = KeptRows(output, {"task": teacher.task.task_hash})
    few = config.all_seeds[: config.thesis_seeds]
    jobs = [*product(("fa_mlirl",), config.all_seeds), *product(("thesis",), few)]
    outcomes = rows_of(
        jobs,
        partial(taught, str(config.task)),
        kept,
        workers=config.workers,
        cluster=config.cluster,
    )
    rows = [row for outcome in outcomes for row in outcome["rows"]]
    result = {
        "rows": tabulated(rows),
        "seeds": {"fa_mlirl": list(config.all_seeds), "thesis": list(few)},
        "curves": [outcome["curves"] for outcome in outcomes],
        "success_mdp_oracle": rows[0]["success_mdp_oracle"],
    }
    show(result["rows"])
    with output.figure("accuracy.png") as figure:
        draw_matrix(figure, result["rows"], THESIS_TABLE, ADVICE)
    with output.figure("curves.png") as figure:
        draw_curves(figure, result["curves"])
    kept.forget()
    return result


def taught(folder: str, job: tuple[str, int]) -> dict[str, Any]:
    """One learner with one seed: rows of all sets and all advice, and two learning curves."""
    name, seed = job
    lesson = Lesson.begin(shared_teacher(folder), LEARNERS[name], seed)
    first = lesson.learn(0)
    rows, curves = [], {}
    for chosen in SETS:
        if chosen == "initial":
            learnt = first
        else:
            learnt = lesson.learn(MOST[chosen], "random" if chosen == "random" else "", after=first)
            curves[chosen] = lesson.points()
        common = {"method": name, "demonstration_set": chosen, "seed": seed}
        rows += [common | lesson.row(learnt, advice) for advice in ADVICE]
    return {"rows": rows, "curves": {"method": name, **curves}}


def tabulated(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """One row a cell of the table, each measure a list of one value a seed."""
    cells = dict.fromkeys((r["method"], r["demonstration_set"], r["advice"]) for r in rows)
    table: list[dict[str, Any]] = []
    for method, chosen, advice in cells:
        same = [
            row
            for row in rows
            if (row["method"], row["demonstration_set"], row["advice"]) == (method, chosen, advice)
        ]
        cell = {"method": method, "demonstration_set": chosen, "advice": advice}
        table.append(cell | per_seed(same, (*MEASURED, "labels", "answers")))
    return table


def show(table: Sequence[dict[str, Any]]) -> None:
    """Print means with intervals."""
    print(
        f"{'method':10}{'set':9}{'advice':8}{'the same action':>24}{'as good':>24}{'success':>24}"
    )
    for row in table:
        shares = (row["accuracy_strict"], row["accuracy_optimal_all"], row["success_mdp"])
        print(
            f"{row['method']:10}{row['demonstration_set']:9}{row['advice']:8}"
            + "".join(f"{told(values):>24}" for values in shares)
        )
