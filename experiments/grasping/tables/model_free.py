"""``model_free``: moves that were tried at random in place of the transition model (thesis 7.3).

The robot first acts by chance for a while; what came of it is counted, and the demonstrations' own
moves with it. A pair that was never tried is not in the model that is counted, and is never chosen.
"""

from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from pathlib import Path
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
from irl.collection import demonstrate_to_the_end
from irl.demonstrations import Demonstrations
from irl.mdp import TransitionModel
from irl.metrics import accuracy_on_unseen, success_mdp
from irl.problem import LearningProblem
from irl.teacher import Teacher

EPISODE, WALKERS = 20, 1000
JUDGED = ("success_mdp", "accuracy_optimal_all")


@dataclass(frozen=True)
class ModelFree(Measurement):
    """Learn from moves tried at random in place of the transition model."""

    seeds: Annotated[int, Limits(1, 100_000)] = 5
    """How many seeds there are."""
    transitions: Annotated[tuple[int, ...], Limits(1, 100_000_000)] = (20_000, 100_000, 500_000)
    """How many moves are tried at random."""
    trajectories: Annotated[tuple[int, ...], Limits(1, 100_000)] = (5, 50)
    """How many trajectories are demonstrated."""
    out: Path = field(default_factory=lambda: Path("out/grasping/model_free"))
    """The folder that the results are written to."""


def run_model_free(config: ModelFree, output: Output) -> dict[str, Any]:
    """Learn what is still missing, and tabulate."""
    teacher = shared_teacher(str(config.task))
    kept = KeptRows(output, {"task": teacher.task.task_hash})
    rows = rows_of(
        list(product(config.transitions, config.trajectories, config.all_seeds)),
        partial(learnt_from_moves, str(config.task)),
        kept,
        workers=config.workers,
        cluster=config.cluster,
    )
    table: list[dict[str, Any]] = []
    for moves, runs in product(config.transitions, config.trajectories):
        same = [r for r in rows if (r["transitions"], r["trajectories"]) == (moves, runs)]
        case = {"transitions": moves, "trajectories": runs}
        table.append(case | per_seed(same, (*JUDGED, "pairs_seen", "labels")))
    for row in table:
        print(
            f"{row['transitions']:9,} moves, {row['trajectories']:4d} trajectories",
            *(told(row[name]) for name in JUDGED),
        )
    kept.forget()
    return {"rows": table, "seeds": list(config.all_seeds)}


def learnt_from_moves(folder: str, job: tuple[int, int, int]) -> dict[str, Any]:
    """One lesson: moves by chance, then trajectories, then the network on what was counted."""
    moves, runs, seed = job
    teacher, rng = shared_teacher(folder), np.random.default_rng(seed)
    task, learning = teacher.task, OURS.learning
    tried = wander(task.model, task.start_states, moves, rng)
    starts = rng.choice(task.start_states, runs)
    shown = demonstrate_to_the_end(teacher.oracle, starts, rng)
    model = counted(task.model, np.concatenate([tried, moves_of(shown, task.model, rng)]))
    problem = LearningProblem(
        model,
        network_features(task, learning.features),
        gamma=task.gamma,
        fixed_vr=task.fixed_vr,
        start_states=task.start_states,
    )
    config = replace(learning.active, budget=0, max_demonstrated=None)
    q = active_fa_mlirl(problem, shown, Teacher(teacher.oracle), config, rng=rng).q
    action = np.where(np.isfinite(q).any(axis=1), q.argmax(axis=1), -1)
    return {
        "transitions": moves,
        "trajectories": runs,
        "seed": seed,
        "labels": len(shown),
        "pairs_seen": model.n_pairs / task.model.n_pairs,
        "success_mdp": success_mdp(task.model, action, task.goal_states, task.start_states),
        "accuracy_optimal_all": accuracy_on_unseen(
            action, shown.state, teacher.oracle, task.start_states
        ).value,
    }


def wander(
    model: TransitionModel, starts: np.ndarray, number: int, rng: np.random.Generator
) -> np.ndarray:
    """Moves (state, action, next state) of a policy by chance, int64 ``[number, 3]``.

    Episodes begin in starts drawn evenly, and end after ``EPISODE`` moves or where nothing can be
    done.
    """
    moves: list[np.ndarray] = []
    done = 0
    while done < number:
        state = rng.choice(starts, WALKERS)
        for _ in range(EPISODE):
            state = state[model.widths[state] > 0]
            row = model.first_pair[state] + rng.integers(model.widths[state])
            after = successors(model, row, rng)
            moves.append(np.stack([state, model.pair_action[row], after], axis=1))
            done += state.size
            state = after
    return np.concatenate(moves)[:number].astype(np.int64)


def successors(model: TransitionModel, rows: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """What pairs, by their rows, lead to: one draw each."""
    P = model.P
    total = np.concatenate([[0.0], np.cumsum(P.data)])
    first, last = P.indptr[rows], P.indptr[rows + 1] - 1
    drawn = total[first] + rng.random(rows.size) * (total[last + 1] - total[first])
    entry = np.searchsorted(total, drawn, side="right") - 1
    return P.indices[np.clip(entry, first, last)]


def moves_of(shown: Demonstrations, model: TransitionModel, rng: np.random.Generator) -> np.ndarray:
    """What came of each demonstrated pair, drawn once more where nobody noted it."""
    after = successors(model, model.pair_index(shown.state, shown.action), rng)
    return np.stack([shown.state, shown.action, after], axis=1)


def counted(model: TransitionModel, moves: np.ndarray) -> TransitionModel:
    """A model of the moves seen; states and actions as of another."""
    seen, count = np.unique(moves, axis=0, return_counts=True)
    pair = seen[:, 0] * model.n_actions + seen[:, 1]
    _, group = np.unique(pair, return_inverse=True)
    probability = count / np.bincount(group, count)[group]
    return TransitionModel.from_entries(
        model.n_states, model.n_actions, seen[:, 0], seen[:, 1], seen[:, 2], probability
    )
