"""``planning``: what the planning learner makes of one trajectory, and of labels often wrong.

About the reward of `demo`, which it is told nothing of but the runs: as it was learnt, and pruned
where that explains as many labels, which is the method's default (`irl.baselines.pruned_rewards`).
Each with the caution that goes with it (`irl.caution`).
"""

import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from experiments.grasping.hidden.lessons import LEAST_LABELS
from experiments.grasping.teacher import GraspTeacher, TeacherConfig
from experiments.kit.command import Output
from experiments.kit.kept_rows import KeptRows
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK
from irl.baselines.pruned_rewards import pruned
from irl.baselines.sparse_planning import SparseConfig, sparse_planning
from irl.caution import learn_caution
from irl.choices import Limits, Settings
from irl.collection import runs_from
from irl.demonstrations import Demonstrations
from irl.metrics import accuracy_on_unseen, bootstrap_interval, success_mdp
from irl.planning import value_iteration
from irl.policy import Policy
from irl.task_data import TaskData

MEASURED = ("labels", "accuracy_optimal_all", "success_mdp", "seconds")


@dataclass(frozen=True)
class Planning(Settings):
    """Plan for a reward learnt from one trajectory, and from labels of which many are wrong."""

    task: Path = SHIPPED_TASK
    """The folder of the task data."""
    seeds: Annotated[int, Limits(1, 100_000)] = 10
    """How many seeds, from --seed on."""
    labels: Annotated[int, Limits(0, 100_000)] = 300
    """How many labels there are at least of which some are wrong; 0 leaves these lessons out."""
    noise: Annotated[float, Limits(0, 1)] = 0.3
    """The share of those that are wrong."""
    seed: int = 0
    """The first seed. Settings were chosen on those from 100 on."""
    out: Path = field(default_factory=lambda: Path("out/grasping/planning"))
    """The folder that the results are written to."""


def run_planning(config: Planning, output: Output) -> dict[str, Any]:
    """Learn what is still missing, and tabulate."""
    task = load_robot_task(config.task)
    identity = {"task": task.task_hash, "labels": config.labels, "noise": config.noise}
    kept = KeptRows(output, identity)
    done = {row["seed"]: row for row in kept.rows}
    for seed in range(config.seed, config.seed + config.seeds):
        if seed not in done:
            done[seed] = {"seed": seed, "rows": _of_seed(task, config, seed)}
            kept.add(done[seed])
    rows = [
        {"seed": seed, **row}
        for seed in range(config.seed, config.seed + config.seeds)
        for row in done[seed]["rows"]
    ]
    summary = summarised(rows)
    kept.forget()
    return {"rows": rows, "summary": summary}


def _of_seed(task: TaskData, config: Planning, seed: int) -> list[dict[str, Any]]:
    rows = [*learnt_from(task, TeacherConfig(), LEAST_LABELS, np.random.default_rng([seed, 0]))]
    if config.labels:
        noisy = TeacherConfig(label_noise=config.noise)
        rows += learnt_from(task, noisy, config.labels, np.random.default_rng([seed, 1]))
    return rows


def learnt_from(
    task: TaskData, config: TeacherConfig, least: int, rng: np.random.Generator
) -> list[dict[str, Any]]:
    """Rewards from the first runs that give as many labels between them, each of two or more.

    Returns:
        A row of the reward as it was learnt, and one of what pruning leaves of it.
    """
    oracle = GraspTeacher(task, config).oracle
    runs, labels = [], 0
    for run in runs_from(oracle, task.start_states, rng):
        if labels >= least:
            break
        if len(run) >= LEAST_LABELS and len(run.ends):
            runs.append(run)
            labels += len(run)
    shown = Demonstrations.concatenate(runs)
    sure = replace(oracle, label_noise=0.0)
    began = time.process_time()
    every = SparseConfig(prune=False)
    reward, _ = sparse_planning(task.model, shown, gamma=task.gamma, config=every)
    took = time.process_time() - began
    found = {"as learnt": reward, "pruned": pruned(task.model, shown, reward, task.gamma)}
    rows = []
    for name, each in found.items():
        before = time.process_time()
        caution = learn_caution(task.model, shown, each, task.gamma)
        spent = took + time.process_time() - before
        doubt = caution * task.model.surprise
        _, q = value_iteration(task.model, each, task.gamma, pair_reward=-doubt)
        action = Policy.from_q(q, task.model.mask).action
        seen, starts = np.union1d(shown.state, shown.ends[:, 2]), task.start_states
        rows.append(
            {"reward": name, "label_noise": config.label_noise, "labels": len(shown)}
            | {"accuracy_optimal_all": accuracy_on_unseen(action, seen, sure, starts).value}
            | {"success_mdp": success_mdp(task.model, action, task.goal_states, starts)}
            | {"rewarded": int(np.count_nonzero(each)), "caution": caution, "seconds": spent}
        )
    return rows


def summarised(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Means with 95 % intervals, and the worst, by reward and share of wrong labels."""
    told = []
    for kind in dict.fromkeys((row["label_noise"], row["reward"]) for row in rows):
        some = [row for row in rows if (row["label_noise"], row["reward"]) == kind]
        entry: dict[str, Any] = {"label_noise": kind[0], "reward": kind[1], "seeds": len(some)}
        for name in MEASURED:
            values = np.array([row[name] for row in some], dtype=np.float64)
            low, high = bootstrap_interval(values, np.random.default_rng(0), resamples=2000)
            entry[name] = {"mean": float(values.mean()), "low": low, "high": high}
            entry[name] |= {"least": float(values.min()), "most": float(values.max())}
        told.append(entry)
        accuracy, success = entry["accuracy_optimal_all"], entry["success_mdp"]
        print(
            f"{kind[0]:4.0%} wrong, {kind[1]:9} {len(some):3d} seeds {entry['labels']['mean']:6.1f}"
            f" labels: accuracy {accuracy['mean']:.4f} [{accuracy['low']:.4f}, "
            f"{accuracy['high']:.4f}], least {accuracy['least']:.4f}; success "
            f"{success['mean']:.4f}, least {success['least']:.4f}; "
            f"{entry['seconds']['mean']:.1f} s"
        )
    return told
