"""The transition model, from trials: run them, look at what they cover, export task data.

``run`` fills the trial database (kill it at any moment; the same command goes on),
``status`` shows its coverage, ``export`` turns it into the task data that `irl` learns from, and
``validate`` holds such a model against new trials with the whole arm, and ``sensitivity`` tells
which outcomes hang on how a trial is simulated.
"""

from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro

from diagrams.transition_counts import (
    TransitionEntries,
    Trial,
    count_pairs,
    thesis_entries,
    transition_entries,
)
from diagrams.trial_database import ARM, Campaign, TrialDatabase
from diagrams.trial_plan import Plan
from diagrams.trial_record import Outcome, TrialConfig
from diagrams.trial_rig import MODEL_FILES
from experiments.command import Output, execute
from experiments.executors import start_workers
from experiments.model_validation import draw_pairs, plot_validation, print_scores, scores
from experiments.robot_data import MAP, SHIPPED_ROBOT, SHIPPED_TASK, load_feasibility
from experiments.sensitivity import ASPECTS, compare, plot_sensitivity, run_variants, sample_classes
from experiments.transition_export import save_tables, task_data
from experiments.transition_plots import plot_coverage
from experiments.trial_campaign import ClassTrials, PairTrials, planned_classes, run_campaign
from irl.choices import check_range
from irl.files import sha256
from irl.task_data import load_task, save_task
from models.scene import STATION_FILES, description_hash
from models.task.spaces import Kind
from models.task.trial_classes import TrialClasses, trial_classes

DATABASE = Path("out/transitions/trials.db")


@dataclass(frozen=True)
class Running:
    """What the commands that run trials share."""

    workers: int = 2
    """Processes; the trials are the same whatever their number."""
    cluster: str = ""
    """Address of a dask scheduler that runs the trials instead, such as tcp://host:8786."""
    trial: TrialConfig = field(default_factory=TrialConfig)
    """How a trial runs, and its noise."""


@dataclass(frozen=True)
class Run(Running):
    """Run the trials that the plan wants and the database does not hold yet."""

    database: Path = DATABASE
    """SQLite file; made if missing."""
    hours: float | None = None
    """Longest time to run for; by default, until the plan is fulfilled."""
    plan: Plan = field(default_factory=Plan)
    """How many trials a class of pairs needs."""
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
    tables: bool = False
    """Also write the model in the shape of thesis 5.9, as CSV and JSON."""
    seed: int = 0
    """Unused: nothing is drawn."""
    out: Path = Path("out/transitions")
    """Folder of the results."""


@dataclass(frozen=True)
class Validate(Running):
    """Hold a model against trials of its own pairs, drawn at random and not used to make it."""

    task: Path = SHIPPED_TASK
    """Task data with the model."""
    rig: Literal["arm", "floating"] = ARM
    """The whole station, as the robot would do it; or the floating gripper of the trials."""
    trials: int = 600
    """Pairs to draw, a quarter of each kind of action."""
    campaign: Path | None = None
    """Database that the model was made from, to judge the kernel of thesis 5.9.1 as well."""
    database: Path = Path("out/transitions/validation.db")
    """SQLite file of these trials; made if missing."""
    seed: int = 1
    """Of the draw, and root of every trial's own seed."""
    out: Path = Path("out/validation")
    """Folder of the results."""


@dataclass(frozen=True)
class Sensitivity(Running):
    """Find out which outcomes change with the solver's step and with friction."""

    repetitions: int = 4
    """Trials of each class, of each variant."""
    databases: Path = Path("out/sensitivity/trials")
    """Folder of a SQLite file for each variant; made if missing."""
    seed: int = 0
    """Of the draw of classes, and root of every trial's own seed."""
    out: Path = Path("out/sensitivity")
    """Folder of the results."""


Config = (
    Annotated[Run, tyro.conf.subcommand("run")]
    | Annotated[Status, tyro.conf.subcommand("status")]
    | Annotated[Export, tyro.conf.subcommand("export")]
    | Annotated[Validate, tyro.conf.subcommand("validate")]
    | Annotated[Sensitivity, tyro.conf.subcommand("sensitivity")]
)


def main(config: Run | Status | Export | Validate | Sensitivity, output: Output) -> dict[str, Any]:
    """Tell one of the stories."""
    if isinstance(config, Validate):
        return validate(config, output)
    if isinstance(config, Sensitivity):
        return sensitivity(config, output)
    classes, feasible = trial_classes(), load_feasibility().mask()
    if isinstance(config, Run):
        database = run(config, classes, feasible)
    else:
        database = TrialDatabase(config.database)
    trials = list(database.trials())
    entries = transition_entries(feasible, trials, classes)
    result = coverage(trials, entries)
    with output.file("coverage.png") as path:
        plot_coverage(entries, path)
    if isinstance(config, Export):
        result["task_hash"] = save_task(task_data(database, entries), config.to)
        print(f"task data in {config.to}")
        if config.tables:
            save_tables(entries, output)
    return result


def run(config: Run, classes: TrialClasses, feasible: np.ndarray) -> TrialDatabase:
    """Run the campaign; the database, with its trials in it."""
    check_range("--workers", config.workers, 1)
    if config.hours is not None:
        check_range("--hours", config.hours, 0)
    campaign = Campaign(config.trial, config.seed, description_hash(MODEL_FILES), version("drake"))
    source = ClassTrials(classes, planned_classes(classes, feasible), config.plan)
    with start_workers(config.workers, config.cluster) as workers:
        database = TrialDatabase(config.database, campaign)
        run_campaign(database, campaign, source, workers, config.hours)
    return database


def validate(config: Validate, output: Output) -> dict[str, Any]:
    """Hold the model against trials of pairs drawn at random."""
    check_range("--trials", config.trials, len(Kind))
    check_range("--workers", config.workers, 1)
    task = load_task(config.task)
    arm = config.rig == ARM
    campaign = Campaign(
        config.trial,
        config.seed,
        description_hash(STATION_FILES if arm else MODEL_FILES),
        version("drake"),
        config.rig,
        sha256(SHIPPED_ROBOT / MAP) if arm else "",
    )
    drawn = draw_pairs(task.transitions, config.trials, np.random.default_rng(config.seed))
    with start_workers(config.workers, config.cluster) as workers:
        database = TrialDatabase(config.database, campaign)
        run_campaign(database, campaign, PairTrials(drawn), workers)
    trials = [trial for trial in database.trials() if trial[0] in set(drawn)]
    result = scores(task.transitions, trials)
    print_scores(result)
    if config.campaign is not None:
        feasible, tried = load_feasibility().mask(), TrialDatabase(config.campaign).trials()
        result["thesis_kernel"] = scores(thesis_entries(feasible, tried), trials)
        print("by the kernel of thesis 5.9.1, for as many pairs as it covers:")
        print_scores(result["thesis_kernel"])
    with output.file("validation.png") as path:
        plot_validation(result, path)
    return result


def sensitivity(config: Sensitivity, output: Output) -> dict[str, Any]:
    """Run the variants and tabulate what changes between them."""
    check_range("--repetitions", config.repetitions, 1)
    check_range("--workers", config.workers, 1)
    classes = trial_classes()
    numbers = sample_classes(
        classes,
        planned_classes(classes, load_feasibility().mask()),
        np.random.default_rng(config.seed),
    )
    campaign = Campaign(config.trial, config.seed, description_hash(MODEL_FILES), version("drake"))
    with start_workers(config.workers, config.cluster) as workers:
        tried = run_variants(
            config.databases, campaign, classes, numbers, config.repetitions, workers
        )
    rows = compare(tried, classes)
    for row in rows:
        if any(row[aspect] for aspect in ASPECTS):
            changed = ", ".join(f"{aspect} {row[aspect]}" for aspect in ASPECTS)
            print(f"{row['variant']:>14}  {row['pair']}: of {row['trials']} changed {changed}")
    with output.file("sensitivity.png") as path:
        plot_sensitivity(rows, path)
    return {"rows": rows}


def coverage(trials: list[Trial], entries: TransitionEntries) -> dict[str, Any]:
    """Count and print pairs by kind of action and evidence."""
    counts = count_pairs(entries)
    records = [record for _, _, record in trials]
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


if __name__ == "__main__":
    execute(Config, main)  # type: ignore[arg-type]
