"""The transition model, from trials: run them, look at what they cover, export task data.

``run`` fills the trial database (kill it at any moment; the same command goes on),
``status`` shows its coverage and what the trials tell of the physics, ``export`` turns it into the
task data that `irl` learns from. ``validate``, ``rules``, ``sensitivity``, ``releases`` and
``drift`` tell how far to trust it (`experiments.transitions.trust`).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
import tyro

from diagrams.trials.counts import TransitionEntries, count_pairs, transition_entries
from diagrams.trials.database import TrialDatabase
from diagrams.trials.plan import Plan
from diagrams.trials.record import Outcome, Trial
from experiments.kit.command import Output
from experiments.kit.executors import start_workers
from experiments.kit.options import about
from experiments.kit.shipped_data import SHIPPED_TRIALS, load_feasibility
from experiments.transitions.campaign import ClassTrials, planned_classes, run_campaign
from experiments.transitions.coverage import coverage_by_gripper, plot_coverage, print_coverage
from experiments.transitions.export import save_tables, task_data
from experiments.transitions.memory import print_two_turns, two_turns
from experiments.transitions.options import Running, floating_campaign
from experiments.transitions.physics import physics, print_physics
from experiments.transitions.trust.checks import (
    Releases,
    Rules,
    Sensitivity,
    Validate,
    releases,
    rules,
    sensitivity,
    validate,
)
from experiments.transitions.trust.drift import Drift, drift
from irl.choices import Limits
from irl.errors import InputError
from irl.files import atomic_path
from irl.task_data import require_replaceable, save_task
from models.task.trial_classes import TrialClasses, trial_classes

DATABASE = Path("out/transitions/trials.db")


@dataclass(frozen=True)
class Run(Running):
    """Run the trials that the plan wants and the database does not hold yet."""

    database: Path = DATABASE
    """The SQLite file of the trials; made if it is missing."""
    hours: Annotated[float | None, Limits(0, 1e6)] = None
    """For how many hours to run at most; by default, until the plan is fulfilled."""
    plan: Plan = field(default_factory=Plan)
    """How many trials each class of pairs needs."""
    seed: int = 0
    """The seed that every trial's own seed is derived from."""
    out: Path = Path("out/transitions")
    """The folder that the results are written to."""


@dataclass(frozen=True)
class Status:
    """Show how much of the feasible pairs the database covers."""

    looks_on: ClassVar[bool] = True  # run may be at work in the same folder

    database: Path | None = None
    """The SQLite file of the trials; by default that of run, or if missing the shipped one."""
    seed: int = 0
    """The seed; nothing is drawn here, so it has no effect."""
    out: Path = Path("out/transitions")
    """The folder that the results are written to."""


@dataclass(frozen=True)
class Export:
    """Write task data from the database."""

    database: Path = DATABASE
    """The SQLite file of the trials."""
    to: Path = Path("out/transitions/task")
    """The folder that the task data are written to; an older one is replaced as a whole."""
    archive: Path | None = None
    """Where to copy the database to, compact and in one file; by default it is not copied."""
    tables: bool = False
    """Whether to write the model also in the shape of thesis 5.9, as CSV and JSON."""
    seed: int = 0
    """The seed; nothing is drawn here, so it has no effect."""
    out: Path = Path("out/transitions")
    """The folder that the results are written to."""


Config = (
    Annotated[Run, tyro.conf.subcommand("run")]
    | Annotated[Status, tyro.conf.subcommand("status")]
    | Annotated[Export, tyro.conf.subcommand("export")]
    | Annotated[Validate, tyro.conf.subcommand("validate")]
    | Annotated[Rules, tyro.conf.subcommand("rules")]
    | Annotated[Sensitivity, tyro.conf.subcommand("sensitivity")]
    | Annotated[Releases, tyro.conf.subcommand("releases")]
    | Annotated[Drift, tyro.conf.subcommand("drift")]
)
Check = Validate | Rules | Sensitivity | Releases | Drift
CHECKS: dict[type, Callable[..., dict[str, Any]]] = {
    Validate: validate,
    Rules: rules,
    Sensitivity: sensitivity,
    Releases: releases,
    Drift: drift,
}


def main(config: Run | Status | Export | Check, output: Output) -> dict[str, Any]:
    """Tell one of the stories."""
    if type(config) in CHECKS:
        return CHECKS[type(config)](config, output)
    if isinstance(config, Export):
        with about("--to"):
            if config.to.resolve() == output.folder.resolve():
                raise InputError("is the folder of --out; name another, such as one within it")
            require_replaceable(config.to)
        if config.archive is not None and not config.archive.parent.is_dir():
            raise InputError(f"{config.archive.parent}: no such folder", place="--archive")
    classes, feasible = trial_classes(), load_feasibility().mask()
    if isinstance(config, Run):
        database = run(config, classes, feasible)
    else:
        database = TrialDatabase(config.database or own_or_shipped())  # type: ignore[union-attr]
    trials = list(database.trials())
    entries = transition_entries(feasible, trials, classes)
    result = coverage(trials, entries)
    with output.figure("coverage.png") as figure:
        plot_coverage(figure, entries)
    if isinstance(config, Status):
        result["physics"] = physics(trials, entries, classes)
        print_physics(result["physics"])
        result["two_turns"] = two_turns(entries)
        print_two_turns(result["two_turns"])
    if isinstance(config, Export):
        result["task_hash"] = save_task(task_data(database, entries), config.to)
        print(
            f"task data in {config.to}; its demonstrations.csv has a header alone, for the model "
            "comes without any: whoever learns asks a teacher"
        )
        if config.tables:
            save_tables(entries, output)
        if config.archive is not None:
            with atomic_path(config.archive) as path:
                database.copy(path)
    return result


def run(config: Run, classes: TrialClasses, feasible: np.ndarray) -> TrialDatabase:
    """Run the campaign; the database, with its trials in it."""
    campaign = floating_campaign(config.trial, config.seed)
    source = ClassTrials(classes, planned_classes(classes, feasible), config.plan)
    with start_workers(config.workers, config.cluster) as workers:
        database = TrialDatabase(config.database, campaign)
        run_campaign(database, campaign, source, workers, config.hours)
    return database


def own_or_shipped() -> Path:
    """The database that `run` fills by default; if it is missing the shipped one, and say so."""
    if DATABASE.is_file():
        return DATABASE
    print(f"{DATABASE} is missing ('run' makes it); these are the shipped trials, {SHIPPED_TRIALS}")
    return SHIPPED_TRIALS


def coverage(trials: list[Trial], entries: TransitionEntries) -> dict[str, Any]:
    """Count and print pairs by kind of action, evidence and gripper orientation."""
    counts = count_pairs(entries)
    by_gripper = coverage_by_gripper(entries)
    faults = sum(trial.record.outcome == Outcome.FAULT for trial in trials)
    print_coverage(counts, by_gripper)
    print(f"{len(trials)} trials, {faults} simulator faults")
    by_evidence = {
        name: sum(kind[name] for kind in counts.values())
        for name in ("measured", "kernel", "estimated")
    }
    return {
        "feasible_pairs": sum(by_evidence.values()),
        **by_evidence,
        "by_action": counts,
        "by_gripper": by_gripper,
        "trials": len(trials),
        "cpu_s": sum(trial.record.cpu_s for trial in trials),
        "faults": faults,
    }
