"""``clusters``: what an answer about a cluster brings, by who drew the clusters (thesis 7.2, 7.3).

The twenty of Table 5.4, their intersections, and clusters that k-means finds: on features, or on
action values that were just learnt, so that states in which the learner would do alike go
together.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from experiments.grasping.tables.learners import OURS
from experiments.grasping.tables.lesson import Lesson, shared_teacher
from experiments.grasping.tables.options import Measurement, spread
from experiments.kit.command import Output
from experiments.kit.jobs import rows_of
from experiments.kit.kept_rows import KeptRows
from irl.active import Result
from irl.advice import Advice
from irl.choices import Limits
from irl.clusters import found, with_intersections
from irl.uncertainty import entropy
from models.task.spaces import N_STATES


@dataclass(frozen=True)
class Clusters(Measurement):
    """Ask about clusters that were drawn in other ways, as many answers each."""

    labels: Annotated[int, Limits(1, N_STATES)] = 30
    """How many states are demonstrated."""
    answers: Annotated[tuple[int, ...], Limits(1, 10_000)] = (5, 20, 80)
    """How many clusters are answered, those of the highest mean entropy."""
    numbers: Annotated[tuple[int, ...], Limits(1, 10_000)] = (20, 100)
    """How many clusters are found."""
    out: Path = field(default_factory=lambda: Path("out/grasping/clusters"))
    """The folder that the results are written to."""


def run_clusters(config: Clusters, output: Output) -> dict[str, Any]:
    """Teach what is still missing, and tabulate."""
    teacher = shared_teacher(str(config.task))
    identity = {"task": teacher.task.task_hash, "labels": config.labels}
    identity |= {"answers": list(config.answers), "numbers": list(config.numbers)}
    kept = KeptRows(output, identity)
    outcomes = rows_of(
        [(seed,) for seed in config.all_seeds],
        partial(answered, str(config.task), config.labels, config.answers, config.numbers),
        kept,
        workers=config.workers,
        cluster=config.cluster,
    )
    rows = [row for outcome in outcomes for row in outcome]
    table: list[dict[str, Any]] = []
    for drawn, answers in dict.fromkeys((row["drawn"], row["answers"]) for row in rows):
        same = [r for r in rows if (r["drawn"], r["answers"]) == (drawn, answers)]
        measures = ("clusters", "excluded", "gain", "lost")
        case = {name: spread([row[name] for row in same]) for name in measures}
        table.append({"drawn": drawn, "answers": answers, **case})
    print(f"{'clusters':34}{'answers':>8}{'excluded':>10}{'gain':>8}")
    for row in table:
        print(
            f"{row['drawn']:34}{row['answers']:8d}{row['excluded'][0]:10.1%}"
            f"{100 * row['gain'][0]:+8.1f}"
        )
    kept.forget()
    return {"rows": table, "seeds": list(config.all_seeds), "labels": config.labels}


def answered(
    folder: str, labels: int, answers: tuple[int, ...], numbers: tuple[int, ...], job: tuple[int]
) -> list[dict[str, Any]]:
    """One training, and what answers about each kind of clusters add to it."""
    (seed,) = job
    # All answers are right, and obeyed: what they bring is then a matter of the clusters alone.
    way = OURS.with_learning(demonstrations=labels).with_active(avoid="mask")
    lesson = Lesson.begin(shared_teacher(folder), way, seed)
    learnt = lesson.learn(0)
    plain = lesson.row(learnt)
    rows = []
    for drawn, clusters in kinds(lesson, learnt, numbers).items():
        for number in answers:
            told = advice_about(lesson, learnt, clusters, number)
            row = lesson.judged(learnt, lesson.values(learnt, learnt.f, told))
            mask = lesson.problem.model.mask
            rows.append(
                {
                    "drawn": drawn,
                    "clusters": len(clusters),
                    "answers": number,
                    "excluded": float(told.avoided[mask].mean()),
                    "gain": row["accuracy_optimal_all"] - plain["accuracy_optimal_all"],
                    "lost": plain["success_mdp"] - row["success_mdp"],
                }
            )
    return rows


def kinds(
    lesson: Lesson, learnt: Result, numbers: tuple[int, ...]
) -> dict[str, Mapping[str, np.ndarray]]:
    """Clusters by how they were drawn."""
    task, rng = lesson.teacher.task, np.random.default_rng([lesson.seed, 3])
    drawn: dict[str, Mapping[str, np.ndarray]] = {
        "the twenty of Table 5.4": task.clusters,
        "these and their intersections": with_intersections(task.clusters, 1, 20),
    }
    features, q = task.feature("rotation"), lesson.problem.model.q_values(learnt.f, learnt.caution)
    for number in numbers:
        drawn[f"{number} found on features"] = found(features, number, rng)
        drawn[f"{number} found on action values"] = found(q, number, rng)
    return drawn


def advice_about(
    lesson: Lesson, learnt: Result, clusters: Mapping[str, np.ndarray], number: int
) -> Advice:
    """What the expert says of so many clusters, those of the highest mean entropy (4.1)."""
    model, expert = lesson.problem.model, lesson.teacher.answers().expert
    assert expert is not None
    doubt = entropy(model.q_values(learnt.f, learnt.caution), OURS.learning.active.query_beta)
    told = Advice.none(model.n_states, model.n_actions)
    by_doubt = sorted(clusters, key=lambda name: -doubt[clusters[name]].mean())
    for name in by_doubt[:number]:
        answer = expert.advise(name, clusters[name])
        told = told.add(clusters[name], answer.preferred, answer.avoided)
    return told
