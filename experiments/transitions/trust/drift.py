"""What another release of the simulator makes of the same trials: outcomes, states and places.

The same trials, noise and all, run here and under other releases of Drake, each in an environment
of its own (`make drift` builds them), and are compared one by one. By default the discrete solver
runs them, which every release has; Drake's CENIC is young.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from diagrams.trials.database import Campaign, TrialDatabase
from diagrams.trials.plan import Plan
from diagrams.trials.record import Outcome, Pair, TrialConfig, TrialRecord
from experiments.kit.command import Output
from experiments.kit.executors import MOST_WORKERS, Workers, start_workers
from experiments.kit.shipped_data import load_feasibility
from experiments.transitions.campaign import ClassTrials, planned_classes, run_campaign
from experiments.transitions.options import floating_campaign
from experiments.transitions.trust.elsewhere import start_elsewhere
from irl.choices import Limits, Settings
from irl.errors import InputError
from models.task.spaces import Kind
from models.task.trial_classes import TrialClasses, trial_classes

PLACE = 1e-3
"""How far apart the cube must lie in the end for its place to count as another [m]."""
ASPECTS = ("outcomes", "states", "places")
"""What may change: held or free; the state identified; where the cube lies, by `PLACE` or more."""

Trials = Mapping[tuple[Pair, int], TrialRecord]


@dataclass(frozen=True)
class Drift(Settings):
    """Run the same trials here and under other releases of Drake, and count what changes."""

    pythons: tuple[Path, ...]
    """The interpreters of the environments that have them."""
    trial: TrialConfig = field(default_factory=lambda: TrialConfig(solver="discrete"))
    """How a trial runs, and what noise it has."""
    repetitions: Annotated[int, Limits(1, 100_000)] = 2
    """How many trials there are of each class."""
    databases: Path = Path("out/drift/trials")
    """The folder with a SQLite file for each release, and one for here; made if it is missing.
    As with run, the same command goes on after a kill."""
    workers: Annotated[int, Limits(1, MOST_WORKERS)] = 2
    """How many processes run trials; the trials are the same whatever their number."""
    seed: int = 0
    """The seed that every trial's own seed is derived from."""
    out: Path = Path("out/drift")
    """The folder that the results are written to."""


def drift(config: Drift, output: Output) -> dict[str, Any]:
    """Run the sample under each release and tabulate what changes."""
    if not config.pythons:
        raise InputError("needs one interpreter or more", place="--pythons")
    campaign = floating_campaign(config.trial, config.seed)
    with start_workers(config.workers) as workers:
        here = _run(config, "here", campaign, workers)
    rows = []
    for python in config.pythons:
        with start_elsewhere(python, config.workers) as (workers, versions):
            other = replace(campaign, drake=versions["drake"])
            there = _run(config, f"drake_{other.drake}", other, workers)
        rows += [versions | row for row in compare(here, there, trial_classes())]
    print_rows(campaign.drake, rows)
    return {"drake": campaign.drake, "trials": len(here), "rows": rows}


def _run(config: Drift, name: str, campaign: Campaign, workers: Workers) -> Trials:
    """Run what the database of that name does not hold yet; the sample's trials in it."""
    classes = trial_classes()
    numbers = planned_classes(classes, load_feasibility().mask())
    plan = Plan(block=1, least=config.repetitions, most=config.repetitions)
    database = TrialDatabase(config.databases / f"{name}.db", campaign)
    run_campaign(database, campaign, ClassTrials(classes, numbers, plan), workers)
    trials = {
        (pair, repetition): record
        for pair, repetition, record in database.trials()
        if repetition < config.repetitions
    }
    database.close()
    return trials


def compare(before: Trials, after: Trials, classes: TrialClasses) -> list[dict[str, Any]]:
    """One row for each kind of action and one for all: in how many trials what has changed.

    Args:
        before: trials by pair and repetition.
        after: the same trials elsewhere; those it lacks are left out.
        classes: which pairs share trials.
    """
    both = [key for key in before if key in after]
    kinds = {key: classes.kind(key[0].number(classes)) for key in both}
    groups = {kind.name.lower(): [key for key in both if kinds[key] == kind] for kind in Kind}
    return [
        {"action": name, **_count((before[key], after[key]) for key in keys)}
        for name, keys in (groups | {"all": both}).items()
    ]


def _count(trials: Iterable[tuple[TrialRecord, TrialRecord]]) -> dict[str, Any]:
    """What changed between the two records of each trial; faults judge nothing."""
    every = list(trials)
    judged = [both for both in every if Outcome.FAULT not in (each.outcome for each in both)]
    moved = [
        float(np.linalg.norm(np.subtract(after.displacement, before.displacement)))
        for before, after in judged
    ]
    return {
        "trials": len(judged),
        "faults": len(every) - len(judged),
        "outcomes": sum(a.outcome != b.outcome for a, b in judged),
        "states": sum(a.next_state != b.next_state for a, b in judged),
        "places": sum(each >= PLACE for each in moved),
        "same_bits": sum(replace(a, cpu_s=0.0) == replace(b, cpu_s=0.0) for a, b in judged),
        "place_change_median_m": float(np.median(moved)) if moved else 0.0,
        "place_change_max_m": max(moved, default=0.0),
    }


def print_rows(drake: str, rows: Iterable[Mapping[str, Any]]) -> None:
    """One line for each row of `compare`."""
    print(f"compared with the same trials here, with Drake {drake}:")
    heads = "".join(f"{aspect:>10}" for aspect in ASPECTS)
    print(f"{'Drake':>9}  {'action':10} {'trials':>6}{heads} changed  to the bit  largest move")
    for row in rows:
        cells = "".join(f"{row[aspect]:10d}" for aspect in ASPECTS)
        print(
            f"{row['drake']:>9}  {row['action']:10} {row['trials']:6d}{cells} "
            f"{row['same_bits']:20d} {row['place_change_max_m']:11.1e} m"
        )
