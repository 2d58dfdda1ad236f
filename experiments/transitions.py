"""The transition model, from trials: run them, look at what they cover, export task data.

``run`` fills the trial database (kill it at any moment; the same command goes on),
``status`` shows its coverage, ``export`` turns it into the task data that `irl` learns from.
"""

import importlib.metadata
import platform
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import cache
from itertools import islice
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from tqdm import tqdm

from diagrams.grasp_trial import run_trial
from diagrams.transition_counts import TransitionEntries, count_pairs, transition_entries
from diagrams.trial_database import Campaign, TrialDatabase
from diagrams.trial_record import Outcome, Pair, TrialConfig, TrialRecord
from diagrams.trial_rig import MODEL_FILES, TrialRig
from experiments.command import Output, execute
from experiments.robot_data import MAP, SHIPPED_ROBOT, load_feasibility
from experiments.transition_plots import plot_coverage
from irl.choices import check_range
from irl.files import sha256
from irl.generalisation import Generalisation
from irl.task_data import TaskData, Transitions, save_task
from models.scene import description_hash
from models.task.clusters import clusters, state_preferences
from models.task.features import rotation_features, thesis_features
from models.task.generalisation import RULES, generalisation_groups
from models.task.spaces import GOAL_STATE, GRID_Z, LOST, N_FREE, Kind
from models.task.symmetry import symmetry_classes
from models.task.tables import ACTION_COLUMNS, STATE_COLUMNS, action_rows, state_rows

DATABASE = Path("out/transitions/trials.db")


@dataclass(frozen=True)
class Run:
    """Run the trials that the database does not hold yet."""

    database: Path = DATABASE
    """SQLite file; made if missing."""
    repetitions: int = 60
    """Trials of each class of grasps and drops."""
    workers: int = 2
    """Processes; the trials are the same whatever their number."""
    trial: TrialConfig = field(default_factory=TrialConfig)
    """How a trial runs, and its noise."""
    seed: int = 0
    """Root of every trial's own seed."""
    out: Path = Path("out/transitions")
    """Folder of the results."""


@dataclass(frozen=True)
class Status:
    """Show how much of the feasible pairs the database covers."""

    database: Path = DATABASE
    """SQLite file."""
    seed: int = 0
    """Unused: nothing is drawn."""
    out: Path = Path("out/transitions")
    """Folder of the results."""


@dataclass(frozen=True)
class Export:
    """Write task data from the database."""

    database: Path = DATABASE
    """SQLite file."""
    to: Path = Path("out/transitions/task")
    """Folder of the task data; an older one is replaced as a whole."""
    seed: int = 0
    """Unused: nothing is drawn."""
    out: Path = Path("out/transitions")
    """Folder of the results."""


Config = (
    Annotated[Run, tyro.conf.subcommand("run")]
    | Annotated[Status, tyro.conf.subcommand("status")]
    | Annotated[Export, tyro.conf.subcommand("export")]
)


def main(config: Run | Status | Export, output: Output) -> dict[str, Any]:
    """Tell one of the three stories."""
    if isinstance(config, Run):
        check_range("--repetitions", config.repetitions, 1)
        check_range("--workers", config.workers, 1)
        campaign = Campaign(
            config.trial, config.seed, description_hash(MODEL_FILES), _version("drake")
        )
        database = TrialDatabase(config.database, campaign)
        run_trials(database, planned_pairs(), config)
    else:
        database = TrialDatabase(config.database)
    entries = transition_entries(load_feasibility().mask(), database.trials(), symmetry_classes())
    result = coverage(database, entries)
    with output.file("coverage.png") as path:
        plot_coverage(entries, path)
    if isinstance(config, Export):
        result["task_hash"] = save_task(task_data(database, entries), config.to)
        print(f"task data in {config.to}")
    return result


def planned_pairs() -> list[Pair]:
    """One pair for each class of feasible grasps and drops: the class's representative."""
    classes = symmetry_classes()
    feasible = load_feasibility()
    pairs = []
    for orientation, gripper in classes.representative.tolist():
        if feasible.grasp[:, gripper].any():
            pairs.append(Pair(Kind.GRASP, orientation, gripper))
        pairs += [Pair(Kind.DROP, orientation, gripper, layer) for layer in range(len(GRID_Z))]
    return pairs


def run_trials(database: TrialDatabase, pairs: list[Pair], config: Run) -> None:
    """Run what is missing, breadth first, each trial committed as it ends."""
    done = database.done()
    todo = [
        (pair, repetition)
        for repetition in range(config.repetitions)
        for pair in pairs
        if (pair, repetition) not in done
    ]
    total = config.repetitions * len(pairs)
    jobs = iter(todo)
    with (
        ProcessPoolExecutor(config.workers, mp_context=get_context("spawn")) as pool,
        tqdm(total=total, initial=total - len(todo), unit="trial", desc="trials") as bar,
    ):
        # A short queue: a kill loses little, and results are committed in order.
        waiting = [
            (job, pool.submit(work, config.trial, config.seed, *job))
            for job in islice(jobs, 2 * config.workers)
        ]
        while waiting:
            (pair, repetition), future = waiting.pop(0)
            database.add(pair, repetition, future.result())
            bar.update()
            for job in islice(jobs, 1):
                waiting.append((job, pool.submit(work, config.trial, config.seed, *job)))


def work(config: TrialConfig, seed: int, pair: Pair, repetition: int) -> TrialRecord:
    """Run one trial in this process; its seed follows from the campaign's and its own key."""
    key = (int(pair.kind), pair.orientation, pair.gripper, pair.layer, repetition)
    sequence = np.random.SeedSequence(seed, spawn_key=key)
    return run_trial(_rig(config.time_step), config, pair, sequence)


@cache
def _rig(time_step: float) -> TrialRig:
    return TrialRig(time_step)


def coverage(database: TrialDatabase, entries: TransitionEntries) -> dict[str, Any]:
    """Count and print pairs by kind of action and evidence."""
    counts = count_pairs(entries)
    records = [record for _, _, record in database.trials()]
    by_evidence = {
        name: sum(kind[name] for kind in counts.values())
        for name in ("measured", "kernel", "estimated")
    }
    print(f"{'action':>10} {'measured':>9} {'kernel':>9} {'estimated':>10}")
    for kind, row in counts.items():
        print(f"{kind:>10} {row['measured']:9d} {row['kernel']:9d} {row['estimated']:10d}")
    faults = sum(record.outcome == Outcome.FAULT for record in records)
    print(f"{len(records)} trials, {faults} simulator faults")
    return {
        "feasible_pairs": sum(by_evidence.values()),
        **by_evidence,
        "by_action": counts,
        "trials": len(records),
        "cpu_s": sum(record.cpu_s for record in records),
        "faults": faults,
    }


def task_data(database: TrialDatabase, entries: TransitionEntries) -> TaskData:
    """Gather everything `irl` needs of the grasping task."""
    feasible = load_feasibility().mask()
    preferences = state_preferences(entries.state, entries.next_state)
    return TaskData(
        name="grasp",
        states=_table(STATE_COLUMNS, state_rows()),
        actions=_table(ACTION_COLUMNS, action_rows()),
        transitions=Transitions(*entries),
        goal_states=np.array([GOAL_STATE]),
        start_states=np.arange(N_FREE),
        gamma=0.95,
        features={"thesis": thesis_features(), "rotation": rotation_features()},
        clusters=clusters(),
        preferred=preferences["preferred"],
        avoided=preferences["avoided"],
        generalisation=Generalisation(*generalisation_groups(feasible), rule_names=list(RULES)),
        fixed_vr={LOST: -1.0},
        provenance={
            "campaign": database.content,
            "campaign_hash": database.hash,
            "trials": len(database.done()),
            "reachability_map": sha256(SHIPPED_ROBOT / MAP),
            "packages": {name: _version(name) for name in ("drake", "numpy")},
            "python": platform.python_version(),
        },
    )


def _table(columns: Iterable[str], rows: Iterable[tuple[str, ...]]) -> list[dict[str, str]]:
    """Rows by column name; the index is the place in the list."""
    table = [dict(zip(columns, row, strict=True)) for row in rows]
    return [{name: value for name, value in row.items() if name != "index"} for row in table]


def _version(package: str) -> str:
    return importlib.metadata.version(package)


if __name__ == "__main__":
    execute(Config, main)  # type: ignore[arg-type]
