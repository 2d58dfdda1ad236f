"""What another release of the simulator makes of the same trials: outcomes, states and places.

A sample of a campaign, noise and all, runs again under other releases of Drake, each in an
environment of its own (`make drift` builds them), and is compared with the campaign's rows trial by
trial.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from diagrams.trials.database import Campaign, TrialDatabase
from diagrams.trials.plan import Plan
from diagrams.trials.record import Outcome, Pair, TrialRecord
from experiments.kit.command import Output
from experiments.kit.executors import MOST_WORKERS
from experiments.kit.shipped_data import SHIPPED_TRIALS
from experiments.transitions.campaign import ClassTrials, run_campaign
from experiments.transitions.elsewhere import start_elsewhere, trial_config
from experiments.transitions.options import floating_campaign
from irl.choices import Limits, Settings
from irl.errors import InputError
from irl.identity import require_same_work
from models.task.spaces import Kind
from models.task.trial_classes import TrialClasses, trial_classes

PLACE = 1e-3
"""How far apart the cube must lie in the end for its place to count as another [m]."""
ASPECTS = ("outcomes", "states", "places")
"""What may change: held or free; the state identified; where the cube lies, by `PLACE` or more."""

Trials = Mapping[tuple[Pair, int], TrialRecord]


@dataclass(frozen=True)
class Drift(Settings):
    """Run a sample of a campaign under other releases of Drake, and count what changes."""

    pythons: tuple[Path, ...]
    """The interpreters of the environments that have them."""
    campaign: Path = SHIPPED_TRIALS
    """The database of the trials that are run again."""
    repetitions: Annotated[int, Limits(1, 100_000)] = 2
    """How many trials of each class are run again, the first of those there are."""
    databases: Path = Path("out/drift/trials")
    """The folder with a SQLite file for each release; made if it is missing.
    As with run, the same command goes on after a kill."""
    workers: Annotated[int, Limits(1, MOST_WORKERS)] = 2
    """How many processes run trials; the trials are the same whatever their number."""
    seed: int = 0
    """The seed; nothing is drawn here, so it has no effect."""
    out: Path = Path("out/drift")
    """The folder that the results are written to."""


def drift(config: Drift, output: Output) -> dict[str, Any]:
    """Run the sample under each release and tabulate what changes."""
    if not config.pythons:
        raise InputError("needs one interpreter or more", place="--pythons")
    classes = trial_classes()
    stored = TrialDatabase(config.campaign)
    campaign = replace(
        floating_campaign(trial_config(stored.content), stored.content["seed"]),
        drake=stored.content["drake"],
    )
    require_same_work(
        config.campaign,
        stored.content,
        campaign.content(),
        "run the campaign anew with these models, or give its database as --campaign",
    )
    sample = {
        (pair, repetition): record
        for pair, repetition, record in stored.trials()
        if repetition < config.repetitions
    }
    releases = [_release(config, python, campaign, sample, classes) for python in config.pythons]
    rows = [row for release in releases for row in release]
    print_rows(campaign.drake, rows)
    return {"campaign_drake": campaign.drake, "trials": len(sample), "rows": rows}


def _release(
    config: Drift, python: Path, campaign: Campaign, sample: Trials, classes: TrialClasses
) -> list[dict[str, Any]]:
    """Run what the database of a release does not hold yet; what it changes."""
    numbers = sorted({pair.number(classes) for pair, _ in sample})
    plan = Plan(block=1, least=config.repetitions, most=config.repetitions)
    with start_elsewhere(python, config.workers) as (workers, versions):
        own = replace(campaign, drake=versions["drake"])
        database = TrialDatabase(config.databases / f"drake_{own.drake}.db", own)
        run_campaign(database, own, ClassTrials(classes, numbers, plan), workers)
    tried = {(pair, repetition): record for pair, repetition, record in database.trials()}
    database.close()
    return [versions | row for row in compare(sample, tried, classes)]


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


def print_rows(campaign_drake: str, rows: Iterable[Mapping[str, Any]]) -> None:
    """One line for each row of `compare`."""
    print(f"compared with the campaign's trials, made with Drake {campaign_drake}:")
    heads = "".join(f"{aspect:>10}" for aspect in ASPECTS)
    print(f"{'Drake':>9}  {'action':10} {'trials':>6}{heads} changed  to the bit  largest move")
    for row in rows:
        cells = "".join(f"{row[aspect]:10d}" for aspect in ASPECTS)
        print(
            f"{row['drake']:>9}  {row['action']:10} {row['trials']:6d}{cells} "
            f"{row['same_bits']:20d} {row['place_change_max_m']:11.1e} m"
        )
