"""``larger``: a larger problem (thesis 7.3): the same cube, and a switch that must be set besides.

A switch of k positions stands beside the table. While the hand holds nothing it can be pressed, and
is then in the next position; the goal counts in the first position alone. That makes k times as
many states, k times as many feasible pairs, and one action more.
"""

from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from pathlib import Path
from time import process_time
from typing import Annotated, Any

import numpy as np

from experiments.grasping.learning import network_features
from experiments.grasping.tables.learners import OURS
from experiments.grasping.tables.lesson import per_seed, shared_teacher
from experiments.grasping.tables.options import Measurement, told
from experiments.kit.command import Output
from experiments.kit.jobs import rows_of
from experiments.kit.kept_rows import KeptRows
from irl.active import active_fa_mlirl
from irl.choices import Limits
from irl.collection import by_trusted_rules, runs_from
from irl.demonstrators import OracleDemonstrator
from irl.mdp import TransitionModel
from irl.metrics import accuracy_on_unseen, success_mdp
from irl.problem import LearningProblem
from irl.task_data import TaskData
from irl.teacher import Teacher
from models.task.spaces import LOST, N_FREE, N_STATES

JUDGED = ("success_mdp", "accuracy_optimal_all")
SHARE = 0.01
"""Of the states that are demonstrated."""


@dataclass(frozen=True)
class Larger(Measurement):
    """Learn with a switch beside the table, and so with several times as many states."""

    seeds: Annotated[int, Limits(1, 100_000)] = 3
    """How many seeds there are."""
    positions: Annotated[tuple[int, ...], Limits(1, 100)] = (1, 2, 4)
    """How many positions the switch has."""
    out: Path = field(default_factory=lambda: Path("out/grasping/larger"))
    """The folder that the results are written to."""


def run_larger(config: Larger, output: Output) -> dict[str, Any]:
    """Learn what is still missing, and tabulate."""
    teacher = shared_teacher(str(config.task))
    kept = KeptRows(output, {"task": teacher.task.task_hash})
    rows = rows_of(
        list(product(config.positions, config.all_seeds)),
        partial(learnt_with_switch, str(config.task)),
        kept,
        workers=config.workers,
        cluster=config.cluster,
    )
    table: list[dict[str, Any]] = []
    for positions in config.positions:
        same = [row for row in rows if row["positions"] == positions]
        case = {name: same[0][name] for name in ("positions", "states", "labels")}
        table.append(case | per_seed(same, (*JUDGED, "seconds")))
    for row in table:
        print(f"{row['states']:9,} states", *(told(row[name]) for name in JUDGED))
    kept.forget()
    return {"rows": table, "seeds": list(config.all_seeds)}


def learnt_with_switch(folder: str, job: tuple[int, int]) -> dict[str, Any]:
    """One lesson with a switch of so many positions; no questions, no rules."""
    positions, seed = job
    task, rng = shared_teacher(folder).task, np.random.default_rng(seed)
    problem, mind = with_switch(task, positions)
    labels = int(SHARE * N_STATES * positions)
    runs = runs_from(mind, problem.start_states, rng)
    shown, answers, _ = by_trusted_rules(Teacher(mind), runs, labels, 1.0)
    active = OURS.learning.active
    training = replace(active.initial, bellman_batch=problem.model.n_states)
    config = replace(active, initial=training, budget=0, max_demonstrated=None)
    began = process_time()
    q = active_fa_mlirl(problem, shown, answers, config, rng=rng).q
    seconds = process_time() - began
    action = np.where(np.isfinite(q).any(axis=1), q.argmax(axis=1), -1)
    starts = problem.start_states
    return {
        "positions": positions,
        "states": N_STATES * positions,
        "seed": seed,
        "labels": labels,
        "success_mdp": success_mdp(problem.model, action, mind.goal_states, starts),
        "accuracy_optimal_all": accuracy_on_unseen(action, shown.state, mind, starts).value,
        "seconds": seconds,
    }


def with_switch(task: TaskData, positions: int) -> tuple[LearningProblem, OracleDemonstrator]:
    """The task with a switch, and who wants cube and switch at their places.

    A state is p · n + s: the switch in position p, the rest as in state s of the task's n.
    """
    model, n = task.model, task.model.n_states
    entries, shift = model.P.tocoo(), n * np.arange(positions)[:, np.newaxis]
    free = np.arange(N_FREE)
    pressed = np.roll(shift, -1, axis=0)
    press = np.full(N_FREE, model.n_actions)
    parts = [
        (model.pair_state[entries.row] + shift, free + shift),
        (model.pair_action[entries.row] + 0 * shift, press + 0 * shift),
        (entries.col + shift, free + pressed),
        (entries.data + 0.0 * shift, np.ones(N_FREE) + 0.0 * shift),
    ]
    state, action, after, probability = (
        np.concatenate([each.ravel() for each in part]) for part in parts
    )
    whole = TransitionModel.from_entries(
        n * positions, model.n_actions + 1, state, action, after, probability
    )
    place = np.repeat(np.eye(positions, dtype=np.float32), n, axis=0)
    features = np.tile(network_features(task, OURS.learning.features), (positions, 1))
    starts = (task.start_states + shift).ravel()
    problem = LearningProblem(
        whole,
        np.concatenate([features, place], axis=1),
        gamma=task.gamma,
        fixed_vr={int(state): -1.0 for state in LOST + shift.ravel()},
        start_states=starts,
    )
    mind = OracleDemonstrator(
        whole,
        task.goal_states,
        gamma=task.gamma,
        lost_states=LOST + shift.ravel(),
        surprise=0.5,
        tolerance=0.005,
    )
    return problem, mind
