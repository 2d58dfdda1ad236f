"""``rewards``: hidden rewards that learners were not made for (`experiments.grasping`).

Rewards are drawn by `experiments.grasping.hidden.drawn`. Every learner is shown runs to their
ends, from starts drawn by chance, and judged over all free states, from the worst of them, and by
its choices in every state that it was not shown. ``goal_posterior`` asks questions besides, those
that are expected to tell most.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from experiments.grasping.hidden.lessons import LEARNERS, Setting, lesson, shared_setting
from experiments.kit.command import Output
from experiments.kit.executors import MOST_WORKERS, run_jobs, start_workers
from experiments.kit.kept_rows import KeptRows
from experiments.kit.shipped_data import SHIPPED_TASK
from irl.choices import Limits, Members, Settings
from irl.metrics import bootstrap_interval

MEASURED = ("success_mdp", "worst_start", "accuracy_optimal_all", "labels")
Job = tuple[tuple[str, ...], int, float]
"""Who learns in one lesson, the reward's number, and the share of wrong labels."""


@dataclass(frozen=True)
class Rewards(Settings):
    """Learn twenty hidden rewards that no learner was made for."""

    task: Path = SHIPPED_TASK
    """The folder of the task data."""
    number: Annotated[int, Limits(1, 100_000)] = 20
    """How many rewards are drawn."""
    learners: Annotated[tuple[str, ...], Members(tuple(LEARNERS))] = tuple(LEARNERS)
    """Who learns them: goal_posterior from one trajectory and answers, student, a VR network, from
    what that then knows, goal_posterior_two from two trajectories, planning and fa_mlirl from
    five."""
    noise: Annotated[tuple[float, ...], Limits(0, 1)] = (0.1, 0.3)
    """The shares of wrong labels of further lessons."""
    questions: Annotated[int, Limits(0, 1000)] = 16
    """How many questions goal_posterior asks."""
    workers: Annotated[int, Limits(1, MOST_WORKERS)] = 2
    """How many processes; the results do not depend on it."""
    cluster: str = ""
    """The address of a dask scheduler that runs them instead, such as tcp://host:8786."""
    seed: int = 0
    """The seed of rewards and lessons. Settings were chosen on those of 1000."""
    out: Path = field(default_factory=lambda: Path("out/grasping/rewards"))
    """The folder that the results are written to."""


def run_rewards(config: Rewards, output: Output) -> dict[str, Any]:
    """Give every lesson that is still missing, and tabulate."""
    setting = Setting(config.task, config.seed, config.questions)
    identity = {
        "task": setting.task.task_hash,
        "seed": config.seed,
        "questions": config.questions,
    }
    kept = KeptRows(output, identity)
    jobs = list(product(together(config.learners), range(config.number), (0.0, *config.noise)))
    every = lessons(setting, jobs, kept, config)
    rows = [row for name in config.learners for row in every if row["method"] == name]
    clean = [row for row in rows if row["label_noise"] == 0]
    noisy = [row for row in rows if row["label_noise"] > 0]
    result = {"rows": clean, "noisy_rows": noisy, "summary": summary(rows)}
    show(result["summary"])
    kept.forget()
    return result


def together(learners: Sequence[str]) -> list[tuple[str, ...]]:
    """Who learns in a lesson of its own; the student is taught what its teacher's one led to."""
    pair = ("goal_posterior", "student")
    if not set(pair) <= set(learners):
        return [(name,) for name in learners]
    return [pair, *((name,) for name in learners if name not in pair)]


def lessons(
    setting: Setting, jobs: Sequence[Job], kept: KeptRows, config: Rewards
) -> list[dict[str, Any]]:
    """Rows of all jobs in their order, those that an interrupted run had kept included."""
    # The matrices are small: a second thread would only get in another worker's way.
    os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"
    done: dict[Job, list[dict[str, Any]]] = {}
    for each in kept.rows:
        names, number, noise = each["job"]
        done[tuple(names), number, noise] = each["rows"]
    missing = iter([job for job in jobs if job not in done])
    with start_workers(config.workers, config.cluster) as workers:
        arguments = (str(setting.folder), setting.seed, setting.questions)
        for job, rows in run_jobs(
            workers,
            lambda: next(missing, None),
            lambda job: workers.executor.submit(run_lesson, *arguments, job),
        ):
            kept.add({"job": list(job), "rows": rows})
            done[job] = rows
    return [row for job in jobs for row in done[job]]


def run_lesson(folder: str, seed: int, questions: int, job: Job) -> list[dict[str, Any]]:
    """One lesson in a worker, which reads the task once."""
    return lesson(shared_setting(folder, seed, questions), *job)


def summary(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Means, 95 % intervals and the worst, by learner, answers, noise, and kind of goal.

    Rewards with a cost that no learner has a name for are told apart from the others.
    """
    told = []
    for name, answers, noise in dict.fromkeys(
        (row["method"], row["answers"], row["label_noise"]) for row in rows
    ):
        same = [
            row
            for row in rows
            if (row["method"], row["answers"], row["label_noise"]) == (name, answers, noise)
        ]
        groups = {
            "all": same,
            "named costs": [row for row in same if "tilt" not in row["costs"]],
            "a cost without a name": [row for row in same if "tilt" in row["costs"]],
        } | {kind: [r for r in same if r["kind"] == kind] for kind in ("free", "held", "region")}
        for group, some in groups.items():
            if some:
                entry = {"method": name, "answers": answers, "label_noise": noise}
                entry |= {"rewards": group, "number": len(some)}
                told.append(entry | {m: _spread([row[m] for row in some]) for m in MEASURED})
    return told


def _spread(values: Sequence[float]) -> dict[str, float]:
    low, high = bootstrap_interval(np.array(values), np.random.default_rng(0), resamples=2000)
    worst, most = float(min(values)), float(max(values))
    return {"mean": float(np.mean(values)), "low": low, "high": high, "least": worst, "most": most}


def show(entries: Sequence[dict[str, Any]]) -> None:
    """Print the summary as a table."""
    print(
        f"{'learner':19}{'answers':>8}{'wrong':>7}  {'rewards':22}{'n':>4}"
        f"{'success':>9}{'least':>7}{'worst start':>13}{'accuracy':>10}{'least':>7}{'labels':>8}"
    )
    for e in entries:
        s, w, a, n = (e[name] for name in MEASURED)
        print(
            f"{e['method']:19}{e['answers']:8d}{e['label_noise']:7.0%}  {e['rewards']:22}"
            f"{e['number']:4d}{s['mean']:9.3f}{s['least']:7.3f}{w['mean']:13.3f}"
            f"{a['mean']:10.3f}{a['least']:7.3f}{n['mean']:8.1f}"
        )
