"""How far the transition model can be trusted: it is compared with trials it was not made from.

``validate`` takes the whole arm, ``rules`` each rule by which a trial speaks for other pairs,
``sensitivity`` the solver's step and friction, ``releases`` the angle at which a cube is let go.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from diagrams.trials.counts import thesis_entries
from diagrams.trials.database import ARM, Campaign, TrialDatabase
from diagrams.trials.record import Pair, Trial
from experiments.kit.command import Output
from experiments.kit.executors import start_workers
from experiments.kit.kept_rows import KeptRows
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import (
    MAP,
    SHIPPED_ROBOT,
    SHIPPED_TASK,
    SHIPPED_TRIALS,
    load_feasibility,
)
from experiments.transitions.campaign import PairTrials, planned_classes, run_campaign
from experiments.transitions.export import to_entries
from experiments.transitions.options import Running, floating_campaign
from experiments.transitions.trust.releases import plot_sweep, run_sweep
from experiments.transitions.trust.rules import (
    draw_rule_pairs,
    find_rules,
    judge,
    plot_rules,
    print_rules,
)
from experiments.transitions.trust.sensitivity import (
    ASPECTS,
    compare,
    plot_sensitivity,
    print_summary,
    run_variants,
    sample_classes,
    summarise,
)
from experiments.transitions.trust.validation import (
    GROUPS,
    draw_pairs,
    plot_validation,
    print_scores,
    scores,
)
from irl.choices import Limits
from irl.files import sha256
from models.scenes.parsing import STATION_FILES, description_hash
from models.task.trial_classes import trial_classes


@dataclass(frozen=True)
class Validate(Running):
    """Compare a model with trials of its own pairs, drawn at random and not used to make it."""

    task: Path = SHIPPED_TASK
    """The folder of the task data that have the model."""
    rig: Literal["arm", "floating"] = ARM
    """What runs the trials: the whole station as the robot would, or the floating gripper."""
    trials: Annotated[int, Limits(len(GROUPS), 100_000)] = 600
    """How many pairs are drawn, a fifth of each kind of action, drops by layer."""
    campaign: Path | None = None
    """The database that the model was made from; if given, thesis 5.9.1 is judged as well."""
    database: Path = Path("out/transitions/validation.db")
    """The SQLite file of these trials; made if it is missing."""
    seed: int = 1
    """The seed of the draw, and the one that every trial's own seed is derived from."""
    out: Path = Path("out/validation")
    """The folder that the results are written to."""


@dataclass(frozen=True)
class Rules(Running):
    """Compare each rule of symmetry, and each of the thesis' kernel, with trials of its pairs."""

    campaign: Path = SHIPPED_TRIALS
    """The database of the trials that the rules carry over."""
    trials: Annotated[int, Limits(1, 100_000)] = 60
    """How many pairs are drawn for each rule."""
    database: Path = Path("out/transitions/rules.db")
    """The SQLite file of these trials; made if it is missing."""
    seed: int = 2
    """The seed of the draw, and the one that every trial's own seed is derived from."""
    out: Path = Path("out/rules")
    """The folder that the results are written to."""


@dataclass(frozen=True)
class Sensitivity(Running):
    """Find out which outcomes change with the solver's step and with friction."""

    repetitions: Annotated[int, Limits(1, 100_000)] = 4
    """How many trials each class has in each variant.
    They have the same noise in each, so that they are compared trial by trial."""
    databases: Path = Path("out/sensitivity/trials")
    """The folder with a SQLite file for each variant; made if it is missing.
    As with run, the same command goes on after a kill."""
    seed: int = 0
    """The seed of the draw of rotations, and the one that every trial's own seed is derived from.
    That is the same in each variant."""
    out: Path = Path("out/sensitivity")
    """The folder that the results are written to."""


@dataclass(frozen=True)
class Releases(Running):
    """Let go of a cube that hangs turned, from level to the next face."""

    angles: Annotated[tuple[float, ...], Limits(-360, 360, some=True)] = tuple(range(0, 91, 5))
    """By how many degrees the cube is turned about the closing axis."""
    repetitions: Annotated[int, Limits(1, 100_000)] = 12
    """How many trials there are of each angle and height."""
    seed: int = 0
    """The seed that every trial's own seed is derived from."""
    out: Path = Path("out/releases")
    """The folder that the results are written to."""


def run_pairs(config: Validate | Rules, campaign: Campaign, pairs: Iterable[Pair]) -> list[Trial]:
    """Run what the database does not hold yet of one trial of each pair; all trials in it."""
    with start_workers(config.workers, config.cluster) as workers:
        database = TrialDatabase(config.database, campaign)
        run_campaign(database, campaign, PairTrials(pairs), workers)
    return list(database.trials())


def validate(config: Validate, output: Output) -> dict[str, Any]:
    """Compare the model with trials of pairs drawn at random."""
    model = to_entries(load_robot_task(config.task).transitions)
    campaign = floating_campaign(config.trial, config.seed)
    if config.rig == ARM:
        models, map_hash = description_hash(STATION_FILES), sha256(SHIPPED_ROBOT / MAP)
        campaign = Campaign(config.trial, config.seed, models, version("drake"), ARM, map_hash)
    drawn = draw_pairs(model, config.trials, np.random.default_rng(config.seed))
    # The database may hold trials of another draw, of a run with more or fewer of them.
    wanted = set(drawn)
    trials = [trial for trial in run_pairs(config, campaign, drawn) if trial.pair in wanted]
    result = scores(model, trials)
    print_scores(result)
    if config.campaign is not None:
        feasible, tried = load_feasibility().mask(), TrialDatabase(config.campaign).trials()
        result["thesis_kernel"] = scores(thesis_entries(feasible, tried), trials)
        print("by the kernel of thesis 5.9.1, for as many pairs as it covers:")
        print_scores(result["thesis_kernel"])
    with output.figure("validation.png") as figure:
        plot_validation(figure, result)
    return result


def rules(config: Rules, output: Output) -> dict[str, Any]:
    """Try pairs that follow from a campaign by one rule alone."""
    classes, feasible = trial_classes(), load_feasibility().mask()
    found = find_rules(feasible, list(TrialDatabase(config.campaign).trials()), classes)
    rng = np.random.default_rng(config.seed)
    drawn = [draw_rule_pairs(rule, config.trials, rng) for rule in found]
    campaign = floating_campaign(config.trial, config.seed)
    every = list(dict.fromkeys(pair for pairs in drawn for pair in pairs))
    rows = judge(found, drawn, run_pairs(config, campaign, every))
    print_rules(rows)
    with output.figure("rules.png") as figure:
        plot_rules(figure, rows)
    return {"rows": rows}


def sensitivity(config: Sensitivity, output: Output) -> dict[str, Any]:
    """Run the variants and tabulate what changes between them."""
    classes = trial_classes()
    numbers = sample_classes(
        classes,
        planned_classes(classes, load_feasibility().mask()),
        np.random.default_rng(config.seed),
    )
    campaign = floating_campaign(config.trial, config.seed)
    with start_workers(config.workers, config.cluster) as workers:
        tried = run_variants(
            config.databases, campaign, classes, numbers, config.repetitions, workers
        )
    rows = compare(tried, classes)
    for row in rows:
        if any(row[aspect] for aspect in ASPECTS):
            changed = ", ".join(f"{aspect} {row[aspect]}" for aspect in ASPECTS)
            layer = "" if row["layer"] is None else f" from the {row['layer']} layer"
            print(f"{row['variant']:>14}  {row['pair']}{layer}: of {row['trials']} {changed}")
    total = summarise(rows)
    print_summary(total)
    with output.figure("sensitivity.png") as figure:
        plot_sensitivity(figure, rows)
    return {"summary": total, "rows": rows}


def releases(config: Releases, output: Output) -> dict[str, Any]:
    """Find out at what angle a cube falls over."""
    angles = sorted(set(config.angles))
    identity = {
        "angles": angles,
        "repetitions": config.repetitions,
        "campaign": floating_campaign(config.trial, config.seed).content(),
    }
    kept = KeptRows(output, identity)
    with start_workers(config.workers, config.cluster) as workers:
        rows = run_sweep(config.trial, angles, config.repetitions, config.seed, workers, kept)
    for row in rows:
        print(
            f"z = {row['height_m']:g} m, {row['angle_deg']:4g}°: of {row['trials']} "
            f"back {row['back']}, over {row['over']}, elsewhere {row['elsewhere']}; "
            f"drift {1e3 * row['drift_median_m']:.1f} mm"
        )
    with output.figure("releases.png") as figure:
        plot_sweep(figure, rows)
    kept.forget()
    return {"rows": rows}
