"""Which outcomes of trials depend on how they are simulated: step size and friction.

The same trials, noise and all, run once as they are with friction 0.8, once with a
finer solver, once with friction 0.5. What changes between them is decided by the simulator or by a
number nobody knows to that precision; the transition model should not be trusted on it.
"""

from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from diagrams.trials.database import Campaign, TrialDatabase
from diagrams.trials.plan import Plan
from diagrams.trials.record import Outcome, Pair, TrialConfig, TrialRecord
from experiments.kit.executors import Workers
from experiments.transitions.campaign import ClassTrials, run_campaign
from models.rotations import rotation_vector_to_matrix
from models.task.discretise import nearest_orientation
from models.task.spaces import R_WO, Action, Kind, State
from models.task.trial_classes import TrialClasses

ROTATIONS = 20
"""Classes of rotations that take part; of the other kinds, all do."""
ASPECTS = ("held", "face", "orientation")
"""What is compared: held or free, the face down, and which of the 48 orientations."""

Trials = Mapping[tuple[Pair, int], TrialRecord]


def variants(trial: TrialConfig) -> dict[str, TrialConfig]:
    """The trial as it is with friction 0.8, which comes first, and its variants."""
    reference = replace(trial, friction=(0.8, 0.8))
    if trial.solver == "discrete":
        finer = "half the step", replace(reference, time_step=trial.time_step / 2)
    else:
        errors = [field.name for field in fields(trial) if field.name.endswith("accuracy")]
        tenths = {name: getattr(trial, name) / 10 for name in errors}
        finer = "a tenth of the error", replace(reference, **tenths)
    return {
        "reference": reference,
        finer[0]: finer[1],
        "friction 0.5": replace(reference, friction=(0.5, 0.5)),
    }


def sample_classes(
    classes: TrialClasses, numbers: Iterable[int], rng: np.random.Generator
) -> list[int]:
    """All classes but of rotations, and `ROTATIONS` of these."""
    numbers = list(numbers)
    turns = [n for n in numbers if classes.kind(n) == Kind.ROTATE]
    drawn = rng.choice(turns, min(ROTATIONS, len(turns)), replace=False)
    return sorted({*numbers} - {*turns} | {int(n) for n in drawn})


def run_variants(
    folder: Path,
    campaign: Campaign,
    classes: TrialClasses,
    numbers: list[int],
    repetitions: int,
    workers: Workers,
) -> dict[str, Trials]:
    """Run what the databases in ``folder``, one a variant, do not hold yet.

    Args:
        folder: of the databases.
        campaign: of the reference and, but for the trial, of the variants.
        classes: which pairs share trials.
        numbers: classes to try.
        repetitions: trials of each.
        workers: where trials run.

    Returns:
        Trials by variant.
    """
    plan = Plan(block=1, least=repetitions, most=repetitions)
    tried: dict[str, Trials] = {}
    for name, trial in variants(campaign.trial).items():
        own = replace(campaign, trial=trial)
        database = TrialDatabase(folder / f"{name.replace(' ', '_')}.db", own)
        run_campaign(database, own, ClassTrials(classes, numbers, plan), workers)
        wanted = {*numbers}
        tried[name] = {
            (pair, repetition): record
            for pair, repetition, record in database.trials()
            if pair.number(classes) in wanted and repetition < repetitions
        }
        database.close()
    return tried


def compare(tried: Mapping[str, Trials], classes: TrialClasses) -> list[dict[str, Any]]:
    """One row for each class and variant: in how many trials what has changed.

    Args:
        tried: trials by variant, the reference first.
        classes: which pairs share trials.
    """
    reference, *others = tried
    rows: dict[tuple[int, str], dict[str, Any]] = {}
    for name in others:
        for key, record in tried[name].items():
            base = tried[reference][key]
            if Outcome.FAULT in (base.outcome, record.outcome):
                continue
            pair = key[0]
            number = pair.number(classes)
            row = rows.setdefault(
                (number, name),
                {
                    "class": number,
                    "pair": f"{_words(State.from_index(pair.state))}: "
                    f"{Action.from_index(pair.action)}",
                    "kind": classes.kind(number).name.lower(),
                    "layer": _layer(classes, number),
                    "variant": name,
                    "trials": 0,
                    **dict.fromkeys(ASPECTS, 0),
                    "drift_change_m": 0.0,
                },
            )
            row["trials"] += 1
            for aspect, before, after in zip(
                ASPECTS, _aspects(pair, base), _aspects(pair, record), strict=True
            ):
                row[aspect] += before != after
            change = np.subtract(record.displacement, base.displacement)[:2]
            row["drift_change_m"] = max(row["drift_change_m"], float(np.hypot(*change)))
    return [rows[key] for key in sorted(rows)]


def summarise(rows: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """One row for each variant and kind of action, drops by layer: in how many trials what changed.

    Args:
        rows: as `compare` gives them.
    """
    total: dict[tuple[str, str], dict[str, Any]] = {}
    for row in rows:
        action = row["kind"] if row["layer"] is None else f"{row['kind']}, {row['layer']} layer"
        own = total.setdefault(
            (row["variant"], action),
            {"variant": row["variant"], "action": action, "classes": 0, "trials": 0}
            | dict.fromkeys(ASPECTS, 0)
            | {"drift_change_m": 0.0},
        )
        own["classes"] += 1
        for key in ("trials", *ASPECTS):
            own[key] += row[key]
        own["drift_change_m"] = max(own["drift_change_m"], row["drift_change_m"])
    return list(total.values())


def print_summary(rows: Iterable[Mapping[str, Any]]) -> None:
    """One line for each row of `summarise`."""
    heads = "".join(f"{aspect:>12}" for aspect in ASPECTS)
    print(f"{'variant':>14}  {'action':20} {'trials':>6}{heads} changed, largest change of place")
    for row in rows:
        cells = "".join(f"{row[aspect]:12d}" for aspect in ASPECTS)
        print(
            f"{row['variant']:>14}  {row['action']:20} {row['trials']:6d}{cells} "
            f"{1e3 * row['drift_change_m']:8.1f} mm"
        )


def plot_sensitivity(figure: Figure, rows: list[dict[str, Any]]) -> None:
    """Draw the share of changed trials by kind of action, drops by layer, aspect and variant."""
    total = {(row["variant"], row["action"]): row for row in summarise(rows)}
    names = list(dict.fromkeys(name for name, _ in total))
    actions = list(dict.fromkeys(action for _, action in total))
    figure.set_size_inches(6 * len(names), 4)
    panels = figure.subplots(1, len(names), sharey=True, squeeze=False)[0]
    for panel, name in zip(panels, names, strict=True):
        for offset, aspect in enumerate(ASPECTS):
            found = [total[name, action] for action in actions]
            share = [row[aspect] / max(1, row["trials"]) for row in found]
            place = np.arange(len(actions)) + 0.26 * (offset - 1)
            panel.bar(place, share, width=0.24, label=f"{aspect} changed")
        panel.set_xticks(range(len(actions)), [a.replace(", ", ",\n") for a in actions])
        panel.set(title=name, ylim=(0, 1))
        panel.grid(axis="y", alpha=0.3)
    panels[0].set_ylabel("share of trials")
    panels[-1].legend(loc="upper left")


def _aspects(pair: Pair, record: TrialRecord) -> tuple[Outcome, int, int]:
    before = R_WO[State.from_index(pair.state).orientation]
    after, _ = nearest_orientation(rotation_vector_to_matrix(record.turn) @ before)
    # The vertical in the cube's frame names the face that is up, and so the one down.
    up = R_WO[int(after)][2]
    face = int(np.abs(up).argmax())
    return record.outcome, face if up[face] > 0 else face + 3, int(after)


def _layer(classes: TrialClasses, number: int) -> str | None:
    if classes.kind(number) != Kind.DROP:
        return None
    return ("lower", "upper")[classes.within(number)[1]]


def _words(state: State) -> str:
    hand = "free" if state.gripper is None else f"in hand {state.gripper}"
    return f"orientation {state.orientation}, {hand}"
