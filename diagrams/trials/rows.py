"""A trial as a row of the database, and back: what a row may hold, and the digest that seals it."""

import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, fields
from functools import cache
from typing import Any

from diagrams.trials.record import Noise, Outcome, Pair, Trial, TrialRecord, spawn_key
from models.errors import ModelError
from models.task.spaces import LOST, N_ACTIONS, N_FREE, N_STATES, Action, Kind
from models.task.trial_classes import trial_classes

KEY = ("state", "action", "repetition")
"""What tells the trials of a campaign apart."""
DIGEST = "digest"

_VECTORS = ("turn", "displacement")
_PLAIN = (
    "outcome",
    "next_state",
    "snap_angle",
    "drift",
    "lift_height",
    "clearance",
    "slip",
    "in_hand_rotation",
    "pad_force",
    "opening",
    "speed",
    "draws",
    "fault",
    "cpu_s",
)
_INTEGERS = {
    "state": (0, N_STATES - 1),
    "action": (0, N_ACTIONS - 1),
    "repetition": (0, 2**31 - 1),
    "class": (0, 2**31 - 1),
    "next_state": (-1, LOST),
    "draws": (0, 2**31 - 1),
}
_FAR = 1e7
"""Farther, faster and stronger than any cube that falls as long as a trial may last [m, m/s, N]."""
_HALF_TURN = math.pi + 1e-6
_REALS = {
    **{f"turn_{axis}": (-_HALF_TURN, _HALF_TURN) for axis in "xyz"},
    **{f"displacement_{axis}": (-_FAR, _FAR) for axis in "xyz"},
    "snap_angle": (0.0, _HALF_TURN),
    "drift": (0.0, _FAR),
    "lift_height": (-_FAR, _FAR),
    "clearance": (-_FAR, _FAR),
    "slip": (0.0, _FAR),
    "in_hand_rotation": (0.0, _HALF_TURN),
    "pad_force": (-_FAR, _FAR),
    "opening": (-1.0, 1.0),
    "speed": (0.0, _FAR),
    "cpu_s": (0.0, math.inf),
}
_NOISE = {field.name for field in fields(Noise)}
_LATER = "restitution"
"""Of the noise, what trials up to version 3 did not draw and the discrete solver does not."""
_TEXTS = ("configuration", "seed", "outcome", "noise", "fault")


def to_row(
    campaign: str, seed: int, pair: Pair, repetition: int, record: TrialRecord
) -> dict[str, Any]:
    """Values by column, the digest last.

    Args:
        campaign: its hash.
        seed: the campaign's.
        pair: what was tried.
        repetition: counts the trials of the pair's class.
        record: what came of it.
    """
    row: dict[str, Any] = {
        "configuration": campaign,
        "state": pair.state,
        "action": pair.action,
        "repetition": repetition,
        "class": _class(pair),
        "seed": _seed(seed, pair, repetition),
        "noise": json.dumps(asdict(record.noise) if record.noise else {}),
    }
    row |= {name: getattr(record, name) for name in _PLAIN}
    row["outcome"] = str(row["outcome"])
    for name in _VECTORS:
        values = zip("xyz", getattr(record, name), strict=True)
        row |= {f"{name}_{axis}": value for axis, value in values}
    row |= {name: float(row[name]) for name in _REALS}  # as SQLite keeps them
    return row | {DIGEST: row_digest(row)}


def to_trial(row: Mapping[str, Any]) -> Trial:
    """The trial that a sound row holds."""
    values: dict[str, Any] = {name: row[name] for name in _PLAIN}
    values |= {name: tuple(row[f"{name}_{axis}"] for axis in "xyz") for name in _VECTORS}
    noise = json.loads(row["noise"])
    values |= {
        "outcome": Outcome(row["outcome"]),
        "noise": Noise(**noise) if noise else None,
    }
    record = TrialRecord(**values)
    return Trial(Pair(row["state"], row["action"]), row["repetition"], record)


def row_digest(row: Mapping[str, Any]) -> str:
    """SHA-256 of all that a row says, its own digest aside."""
    said = {name: value for name, value in row.items() if name != DIGEST}
    return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()


def require_row(row: Mapping[str, Any], campaign: str, seed: int) -> None:
    """Refuse a row that cannot be a trial of a campaign, or whose digest is not its own.

    Args:
        row: values by column; without the column ``digest`` that is not looked at.
        campaign: the campaign's hash.
        seed: the campaign's.

    Raises:
        ModelError: naming the column, what it holds and what was wanted.
    """
    for column, wanted in _faults(row, campaign, seed):
        raise ModelError(f"column {column!r} is {row[column]!r:.70}; wanted {wanted}")


def _faults(row: Mapping[str, Any], campaign: str, seed: int) -> Iterator[tuple[str, str]]:
    """Columns that are wrong and what they should hold; later ones trust those before."""
    for name in _TEXTS:
        if not isinstance(row[name], str):
            yield name, "text"
    for ranges, kind in ((_INTEGERS, int), (_REALS, float)):
        for name, (low, high) in ranges.items():
            # Comparisons with NaN are false.
            if type(row[name]) is not kind or not low <= row[name] <= high:
                yield name, f"{'an integer' if kind is int else 'a number'} in {low:.9g}…{high:.9g}"
    if row["configuration"] != campaign:
        yield "configuration", f"{campaign}, the campaign of the file"
    yield from _key_faults(row, seed)
    yield from _outcome_faults(row)
    if DIGEST in row and row[DIGEST] != row_digest(row):
        yield DIGEST, f"{row_digest(row)}, that of the row's content: the row was altered"


def _key_faults(row: Mapping[str, Any], seed: int) -> Iterator[tuple[str, str]]:
    pair = Pair(row["state"], row["action"])
    if _is_grasp(pair.action) != (pair.state < N_FREE):
        yield "action", "a grasp of a free cube, or another action with a held one"
    if row["class"] != _class(pair):
        yield "class", f"{_class(pair)}, the class of its pair"
    if row["seed"] != _seed(seed, pair, row["repetition"]):
        yield "seed", f"{_seed(seed, pair, row['repetition'])}, that of its key"


def _outcome_faults(row: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    outcomes = [outcome.value for outcome in Outcome]
    if row["outcome"] not in outcomes:
        yield "outcome", f"one of {', '.join(outcomes)}"
    fault, after = row["outcome"] == Outcome.FAULT, row["next_state"]
    if fault != bool(row["fault"]):
        yield "fault", "a reason where the outcome is 'fault', nothing where it is not"
    held = range(N_FREE, N_STATES) if row["outcome"] == Outcome.HELD else range(N_FREE)
    if not (after == -1 if fault else after == LOST or after in held):
        yield "next_state", f"a state that agrees with outcome {row['outcome']!r}"
    if math.hypot(*(row[f"turn_{axis}"] for axis in "xyz")) > _HALF_TURN:
        yield "turn_x", "a rotation vector (turn_x, turn_y, turn_z) of at most half a turn"
    drift = math.hypot(row["displacement_x"], row["displacement_y"])
    if not math.isclose(row["drift"], drift, rel_tol=1e-9, abs_tol=1e-12):
        yield "drift", f"{drift!r}, the horizontal part of the displacement"
    if not _is_noise(row["noise"]):
        names = ", ".join(field.name for field in fields(Noise))
        yield "noise", f"JSON of {names}, each a finite number; {{}} if nothing was drawn"


def _is_noise(text: str) -> bool:
    try:
        noise = json.loads(text)
    except (ValueError, RecursionError):
        return False
    if noise == {}:
        return True
    if not isinstance(noise, dict) or noise.keys() | {_LATER} != _NOISE:
        return False
    if noise.get(_LATER) is None:
        noise.pop(_LATER, None)
    return (
        all(type(value) in (int, float) and abs(value) <= _FAR for value in noise.values())
        and noise["friction"] > 0
        and noise["mass"] > 0
        and noise.get(_LATER, 1) > 0
    )


@cache
def _class(pair: Pair) -> int:
    return pair.number(trial_classes())


@cache
def _is_grasp(action: int) -> bool:
    return Action.from_index(action).kind == Kind.GRASP


def _seed(seed: int, pair: Pair, repetition: int) -> str:
    return json.dumps([seed, *spawn_key(pair, repetition)])
