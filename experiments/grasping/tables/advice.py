"""``advice``: what advice about actions and about states is worth, from few labels to many.

And what it costs if some of the answers are wrong (thesis 6.1; `irl.experts.MistakenExpert`), by
what is made of them: the demo's way, which doubts them, obeying them, and the thesis' way.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from experiments.grasping.tables.learners import OURS
from experiments.grasping.tables.lesson import ADVICE, MEASURED, Lesson, per_seed, shared_teacher
from experiments.grasping.tables.options import Measurement, spread, told
from experiments.kit.command import Output
from experiments.kit.jobs import rows_of
from experiments.kit.kept_rows import KeptRows
from irl.choices import Limits
from irl.experts import MistakenExpert, OracleExpert
from models.task.spaces import N_STATES

GAINED = ("accuracy_optimal_all", "success_mdp")
FORMS: Mapping[str, Mapping[str, str]] = {
    "doubt": {"avoid": "doubt", "prefer": "ignore"},
    "mask": {"avoid": "mask", "prefer": "ignore"},
    "thesis": {"avoid": "thesis", "prefer": "thesis"},
}
"""What is made of advice about actions: choices of `irl.active.ActiveConfig`."""


@dataclass(frozen=True)
class AdviceGains(Measurement):
    """Give the demo's learner advice of each kind, and see what it gains and what it loses."""

    labels: Annotated[tuple[int, ...], Limits(1, N_STATES)] = (7, 30, 160)
    """How many states are demonstrated; 160 are 1 % of them."""
    wrong: Annotated[tuple[float, ...], Limits(0, 1)] = (0.0, 0.1, 0.3)
    """The shares of wrong answers about clusters, in a table by what is made of them."""
    out: Path = field(default_factory=lambda: Path("out/grasping/advice"))
    """The folder that the results are written to."""


def run_advice(config: AdviceGains, output: Output) -> dict[str, Any]:
    """Teach what is still missing, and compare what was learnt with and without advice."""
    teacher = shared_teacher(str(config.task))
    kept = KeptRows(output, {"task": teacher.task.task_hash, "wrong": list(config.wrong)})
    outcomes = rows_of(
        # Seed by seed, so that an interrupted run has whole tables of fewer seeds.
        [(labels, seed) for seed, labels in product(config.all_seeds, config.labels)],
        partial(advised, str(config.task), config.wrong),
        kept,
        workers=config.workers,
        cluster=config.cluster,
    )
    rows = [row for outcome in outcomes for row in outcome]
    table = [gains(rows, labels=n, advice=kind) for n in config.labels for kind in ADVICE]
    cells = product(config.labels, FORMS, config.wrong)
    wrong = [gains(rows, labels=n, advice=form, wrong=share) for n, form, share in cells]
    show(table)
    if wrong:
        print("by what is made of advice about actions:")
        show(wrong)
    kept.forget()
    return {"rows": table, "wrong_rows": wrong, "seeds": list(config.all_seeds)}


def advised(folder: str, wrong: Sequence[float], job: tuple[int, int]) -> list[dict[str, Any]]:
    """One training, and what comes of it by kind of advice; and with wrong advice, by its form."""
    labels, seed = job
    way = OURS.with_learning(demonstrations=labels)
    lesson = Lesson.begin(shared_teacher(folder), way, seed)
    learnt, common = lesson.learn(0), {"shown": labels, "seed": seed}
    rows = [{**common, "wrong": 0.0, **lesson.row(learnt, advice)} for advice in ADVICE]
    oracle, starts = lesson.teacher.oracle, lesson.teacher.task.start_states
    for share in wrong:
        rng = np.random.default_rng([seed, 3, round(1000 * share)])
        told = lesson.told_by(MistakenExpert(OracleExpert(oracle, starts), share, rng))
        for form, choices in FORMS.items():
            with_it = replace(lesson, learner=lesson.learner.with_active(**choices))
            judged = lesson.judged(learnt, with_it.values(learnt, learnt.f, told))
            rows.append({**common, "wrong": share, "advice": form, **judged})
    return rows


def gains(
    rows: Sequence[dict[str, Any]], *, labels: int, advice: str, wrong: float = 0.0
) -> dict[str, Any]:
    """Measures by seed, what advice adds on the same seeds, and the most success it cost."""
    own, without = (
        [row for row in rows if (row["shown"], row["advice"], row["wrong"]) == (labels, *kind)]
        for kind in ((advice, wrong), ("none", 0.0))
    )
    added = {
        name: [a[name] - b[name] for a, b in zip(own, without, strict=True)] for name in GAINED
    }
    return {
        "labels": labels,
        "advice": advice,
        "wrong": wrong,
        **per_seed(own, MEASURED),
        "gain": {name: spread(values) for name, values in added.items()},
        "success_lost_at_most": max(0.0, -min(added["success_mdp"])),
    }


def show(table: Sequence[dict[str, Any]]) -> None:
    """Print means with intervals, and gains in points."""
    print(
        f"{'labels':>6} {'advice':8}{'wrong':>5}{'as good':>24}{'gain':>20}"
        f"{'success':>24}{'gain':>20}"
    )
    for row in table:
        line = f"{row['labels']:6d} {row['advice']:8}{row['wrong']:5.0%}"
        for name in GAINED:
            gain, low, high = (100 * value for value in row["gain"][name])
            line += f"{told(row[name]):>24}" + f"{gain:+.1f} [{low:+.1f}, {high:+.1f}]".rjust(20)
        print(line)
