"""What the trials say of the physics, by class; and how far the geometric estimate was from it."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from diagrams.trials.counts import (
    Evidence,
    TransitionEntries,
    judged_by_class,
    split_trio,
    trio_key,
)
from diagrams.trials.initial_state import turn_to_flush
from diagrams.trials.plan import outcome_label
from diagrams.trials.record import Outcome, Trial
from irl.metrics import wilson_interval
from models.rotations import geodesic_angle, rotation_vector_to_matrix
from models.task.discretise import nearest_orientation
from models.task.estimate import estimated_transitions, rotated_orientations
from models.task.pairs import pair_key, split_key
from models.task.spaces import (
    GRIPPER_NAMES,
    N_ACTIONS,
    N_STATES,
    R_WG,
    R_WO,
    Kind,
    decode_actions,
)
from models.task.trial_classes import TrialClasses

UP = 0.9  # cosine: the axis of the cube that points up is another one below it


def physics(
    trials: Sequence[Trial], entries: TransitionEntries, classes: TrialClasses
) -> dict[str, Any]:
    """What the trials of a campaign tell.

    Args:
        trials: of pairs that stand for their classes.
        entries: the model that was made from them.
        classes: which pairs share trials.
    """
    by_class = judged_by_class(trials, lambda pair: pair.number(classes))
    rows = [_class_row(classes, number, tried) for number, tried in by_class.items()]
    return {
        "classes": [row for row in rows if row["kind"] != "rotate"],
        "rotations": _rotations(row for row in rows if row["kind"] == "rotate"),
        "estimate": against_estimate(entries),
    }


def against_estimate(entries: TransitionEntries) -> dict[str, Any]:
    """How the measured pairs differ from what geometry predicted, by kind of action.

    ``changed`` counts pairs whose likeliest outcome geometry did not predict at all;
    ``distance`` is the mean total variation between the two distributions.
    """
    tried = entries.evidence != Evidence.ESTIMATED
    feasible = np.zeros((N_STATES, N_ACTIONS), dtype=bool)
    feasible[entries.state[tried], entries.action[tried]] = True
    estimate = estimated_transitions(feasible)
    ours = trio_key(entries.key[tried], entries.next_state[tried])
    theirs = trio_key(pair_key(estimate.state, estimate.action), estimate.next_state)
    every = np.union1d(ours, theirs)
    p, q = np.zeros(every.size), np.zeros(every.size)
    p[np.searchsorted(every, ours)] = entries.probability[tried]
    q[np.searchsorted(every, theirs)] = estimate.probability
    pairs, row = np.unique(split_trio(every)[0], return_inverse=True)
    distance = 0.5 * np.bincount(row, np.abs(p - q), minlength=pairs.size)
    best = np.zeros(pairs.size)
    np.maximum.at(best, row, p)
    # Of equally likely outcomes it is enough if geometry predicted one.
    agrees = np.bincount(row, (p == best[row]) & (q > 0), minlength=pairs.size) > 0
    kind = decode_actions(split_key(pairs)[1]).kind
    return {
        k.name.lower(): {
            "pairs": int((kind == k).sum()),
            "changed": int((~agrees & (kind == k)).sum()),
            "distance": float(distance[kind == k].mean()) if (kind == k).any() else 0.0,
        }
        for k in Kind
    }


def print_physics(result: dict[str, Any]) -> None:
    """Tables for the terminal."""
    print("\nBy class, what became of the cube (angles in degrees, drift in mm):")
    print(
        f"{'class':>5} {'action':>9}  {'hand':26} {'off flush':>9} {'layer':>6} {'trials':>6} "
        f"{'held':>5} {'face':>5} {'orient.':>7} {'commonest':>9} {'drift':>5} {'turn':>5}"
    )
    for row in result["classes"]:
        layer = "" if row["layer"] is None else ("lower", "upper")[row["layer"]]
        print(
            f"{row['class']:5d} {row['kind']:>9}  {row['hand']:26.26} "
            f"{row['off_flush_deg']:9.1f} {layer:>6} {row['trials']:6d} {row['held']:5.0%} "
            f"{row['face_kept']:5.0%} {row['orientation_kept']:7.0%} "
            f"{row['commonest'][0]:9.0%} {1e3 * row['drift_median_m']:5.1f} "
            f"{row['turn_median_deg']:5.1f}"
        )
    turns = result["rotations"]
    for name, row in turns.items():
        print(
            f"rotations, {name}: {row['classes']} classes, {row['trials']} trials, "
            f"held {row['held']:.1%}, as geometry says {row['foretold']:.1%}, "
            f"commonest outcome {row['commonest']:.1%}"
        )
    for name, row in result["estimate"].items():
        print(
            f"{name:>9}: of {row['pairs']:,} pairs {row['changed']:,} end most likely where "
            f"geometry did not say; mean distance {row['distance']:.3f}"
        )


def _class_row(classes: TrialClasses, number: int, trials: list[Trial]) -> dict[str, Any]:
    """The figures of one class's trials, none of them a fault."""
    kind = classes.kind(number)
    rest, layer = classes.within(number)
    orientation, gripper, *after = classes.symmetry(kind).representative[rest].tolist()
    R_GO = R_WG[gripper].T @ R_WO[orientation]
    records = [trial.record for trial in trials]
    turned = rotation_vector_to_matrix([record.turn for record in records]) @ R_WO[orientation]
    ends = nearest_orientation(turned)[0].tolist()
    count = Counter(outcome_label(trial.pair, trial.record) for trial in trials)
    n = len(trials)
    most = max(count.values())
    row: dict[str, Any] = {
        "class": number,
        "kind": kind.name.lower(),
        "orientation": orientation,
        "gripper": gripper,
        "hand": GRIPPER_NAMES[gripper],
        "off_flush_deg": float(np.degrees(geodesic_angle(turn_to_flush(R_GO), np.eye(3)))),
        "layer": layer if kind == Kind.DROP else None,
        "trials": n,
        "held": _share(record.outcome == Outcome.HELD for record in records),
        "face_kept": _share(R_WO[end][2] @ R_WO[orientation][2] > UP for end in ends),
        "orientation_kept": _share(end == orientation for end in ends),
        "commonest": [most / n, *wilson_interval(most, n)],
        "outcomes": len(count),
        "drift_median_m": float(np.median([record.drift for record in records])),
        "drift_max_m": max(record.drift for record in records),
        "turn_median_deg": float(
            np.degrees(np.median([np.linalg.norm(record.turn) for record in records]))
        ),
        "slip_max_m": max(record.slip for record in records),
        "pad_force_min_n": min(record.pad_force for record in records),
    }
    if kind == Kind.ROTATE:
        number_of, near = rotated_orientations()
        turn = gripper, after[0], orientation
        predicted = near[turn][: number_of[turn]]
        row |= {
            "hand_after": GRIPPER_NAMES[after[0]],
            "foretold": _share(end in predicted for end in ends),
            "tie": len(predicted) > 1,
        }
    return row


def _rotations(rows: Iterable[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Classes of rotations put together by whether geometry leaves the outcome open."""
    groups: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        groups["one nearest orientation" if not row["tie"] else "two equally near"].append(row)
    result = {}
    for name, group in sorted(groups.items()):
        trials = np.array([row["trials"] for row in group])
        result[name] = {
            "classes": len(group),
            "trials": int(trials.sum()),
            "held": float(np.average([row["held"] for row in group], weights=trials)),
            "foretold": float(np.average([row["foretold"] for row in group], weights=trials)),
            "commonest": float(np.mean([row["commonest"][0] for row in group])),
            "unsure": [
                {key: row[key] for key in ("class", "hand", "hand_after", "orientation")}
                | {"commonest": row["commonest"], "foretold": row["foretold"]}
                for row in group
                if row["commonest"][0] < 0.9 and not row["tie"]
            ],
        }
    return result


def _share(values: Iterable[bool]) -> float:
    return float(np.mean(list(values)))
