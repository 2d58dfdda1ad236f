"""``ladder``: from the thesis' network to ours, one change at a time, to see what buys what.

All rungs learn from the same 981 demonstrated states, without questions and without advice.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from experiments.grasping.tables.learners import ladder
from experiments.grasping.tables.lesson import MEASURED, Lesson, per_seed, shared_teacher
from experiments.grasping.tables.options import Measurement, spread, told
from experiments.kit.command import Output
from experiments.kit.jobs import rows_of
from experiments.kit.kept_rows import KeptRows

DRAWN = {
    "accuracy_strict": ("the same action", "#777777"),
    "accuracy_optimal_all": ("as good an action", "#b35806"),
    "success_mdp": ("goal reached", "#2166ac"),
}


@dataclass(frozen=True)
class Ladder(Measurement):
    """Change the thesis' network into the demo's, one change at a time."""

    out: Path = field(default_factory=lambda: Path("out/grasping/ladder"))
    """The folder that the results are written to."""


def run_ladder(config: Ladder, output: Output) -> dict[str, Any]:
    """Teach what is still missing, tabulate and draw."""
    teacher = shared_teacher(str(config.task))
    kept = KeptRows(output, {"task": teacher.task.task_hash})
    rows = rows_of(
        # Seed by seed: whoever looks before the end sees whole ladders.
        [(name, seed) for seed, name in product(config.all_seeds, ladder())],
        partial(rung, str(config.task)),
        kept,
        workers=config.workers,
        cluster=config.cluster,
    )
    table = [
        {"change": name, **per_seed([row for row in rows if row["change"] == name], MEASURED)}
        for name in ladder()
    ]
    for row in table:
        shares = "".join(f"{told(row[name]):>24}" for name in DRAWN)
        print(f"{row['change']:62}{shares}")
    with output.figure("ladder.png") as figure:
        draw(figure, table)
    kept.forget()
    return {"rows": table, "seeds": list(config.all_seeds)}


def rung(folder: str, job: tuple[str, int]) -> dict[str, Any]:
    """One rung with one seed."""
    name, seed = job
    lesson = Lesson.begin(shared_teacher(folder), ladder()[name], seed)
    return {"change": name, "seed": seed, **lesson.row(lesson.learn(0))}


def draw(figure: Figure, table: Sequence[dict[str, Any]]) -> None:
    """Draw the measures rung by rung, with their intervals."""
    figure.set_size_inches(9, 0.5 * len(table) + 1.4)
    axis = figure.subplots()
    y = np.arange(len(table))
    for name, (words, colour) in DRAWN.items():
        mean, low, high = np.array([spread(row[name]) for row in table]).T
        axis.errorbar(
            mean, y, xerr=[mean - low, high - mean], fmt="o-", color=colour, label=words, capsize=3
        )
    axis.set_yticks(y, [row["change"] for row in table], fontsize=8)
    axis.invert_yaxis()
    axis.set(xlim=(0, 1.02), xlabel="share")
    axis.grid(alpha=0.3)
    axis.legend(frameon=False, fontsize=8)
