"""Rows of episodes, one each, and what many of them come to."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from diagrams.decisions import Step
from diagrams.policy_controller import Verdict
from diagrams.policy_run import Played
from experiments.simulate.kinematic import Imagined
from irl.metrics import Share
from models.task.spaces import Action
from models.task.tables import describe_state

Row = Mapping[str, Any]
"""What is kept of an episode; nothing but what JSON holds."""
ARRAYS = ("speed", "acceleration", "torque", "tracking_error")
"""Of `Loads`, one number a joint."""


def played_row(played: Played) -> dict[str, Any]:
    """What is kept of an episode in physics."""
    loads = played.loads
    return {
        **_steps(played.start, played.episode.verdict, played.episode.steps),
        "success": played.success,
        "false_success": played.false_success,
        "seconds": played.seconds,
        "fault": played.reason,
        "acted": played.disturbance is None or played.disturbance.acted,
        "limits": {
            **{name: getattr(loads, name).tolist() for name in ARRAYS},
            "limited_samples": loads.limited_samples,
            "penetration": dict(loads.penetration),
        },
    }


def imagined_row(imagined: Imagined) -> dict[str, Any]:
    """What is kept of an episode without physics, which knows neither seconds nor faults."""
    return {
        **_steps(imagined.start, imagined.verdict, imagined.steps),
        "success": imagined.verdict == Verdict.GOAL,
        "false_success": False,
        "seconds": None,
        "fault": "",
        "acted": True,
        "limits": None,
        "decision_s": list(imagined.decision_s),
    }


def _steps(start: int, verdict: Verdict, steps: Sequence[Step]) -> dict[str, Any]:
    return {
        "start": int(start),
        "verdict": verdict.value,
        "actions": [int(step.action) for step in steps],
        "states": [int(step.next_state) for step in steps],
        "chosen_by": [step.chosen_by.value for step in steps],
        "action_failures": [step.failure.value if step.failure else "" for step in steps],
    }


def told(row: Row) -> dict[str, Any]:
    """An episode in ``result.json``, in words where there are some."""
    return {
        "start": describe_state(row["start"]),
        "verdict": row["fault"] or row["verdict"],
        "seconds": round(row["seconds"], 2),
        "actions": [str(Action.from_index(action)) for action in row["actions"]],
        "states": row["states"],
        "chosen_by": row["chosen_by"],
    }


def count(rows: Sequence[Row]) -> dict[str, Any]:
    """What came of episodes; simulator faults, and disturbances that did not act, judge nothing."""
    judged = [row for row in rows if counts(row)]
    lengths = [len(row["actions"]) for row in judged if row["success"]]
    failures = Counter(row["verdict"] for row in judged if not row["success"])
    went_wrong = Counter(why for row in judged for why in row["action_failures"] if why)
    faults = sum(bool(row["fault"]) for row in rows)
    thought = [s for row in rows for s in row.get("decision_s", ())]
    return {
        "successes": len(lengths),
        "trials": len(judged),
        "within_12": sum(length <= 12 for length in lengths),
        "actions_mean": float(np.mean(lengths)) if lengths else None,
        "actions_max": max(lengths, default=None),
        "faults": faults,
        "not_acted": len(rows) - faults - len(judged),
        "false_successes": sum(row["false_success"] for row in judged),
        "failures": dict(sorted(failures.items())),
        "action_failures": dict(sorted(went_wrong.items())),
        "chosen_by": dict(sorted(Counter(by for row in judged for by in row["chosen_by"]).items())),
        "limits": limits([row["limits"] for row in judged if row["limits"]]),
        "decision_cpu_ms": {
            "mean": 1e3 * float(np.mean(thought)),
            "p99": 1e3 * float(np.quantile(thought, 0.99)),
            "max": 1e3 * max(thought),
        }
        if thought
        else None,
        "real_time_factor": real_time_factor(rows),
    }


def real_time_factor(rows: Sequence[Row]) -> float | None:
    """Simulated seconds in a second of processor time, in all episodes together."""
    timed = [row for row in rows if row["seconds"] is not None]
    spent = sum(row["cpu_s"] for row in timed)
    return float(f"{sum(row['seconds'] for row in timed) / spent:.4g}") if spent else None


def counts(row: Row) -> bool:
    """Whether an episode says anything: the simulator did not fail, and what should act did."""
    return not row["fault"] and bool(row["acted"])


def paired(disturbed: Sequence[Row], undisturbed: Sequence[Row]) -> dict[str, Any]:
    """Disturbed episodes beside the undisturbed ones of the same seeds, where both count.

    The difference is that of the shares that succeed, with a 95 % interval: Newcombe's for paired
    proportions (Statistics in Medicine 17, 1998, method 8).
    """
    both = [(a, b) for a, b in zip(disturbed, undisturbed, strict=True) if counts(a) and counts(b)]
    table = Counter((bool(a["success"]), bool(b["success"])) for a, b in both)
    lengths = [
        len(a["actions"]) - len(b["actions"]) for a, b in both if a["success"] and b["success"]
    ]
    return {
        "pairs": len(both),
        "both_succeed": table[True, True],
        "only_disturbed": table[True, False],
        "only_undisturbed": table[False, True],
        "neither": table[False, False],
        "difference": difference(table),
        "actions_more_mean": float(np.mean(lengths)) if lengths else None,
    }


def difference(table: Mapping[tuple[bool, bool], int]) -> list[float] | None:
    """Difference of two paired shares of successes, the first less the second, with its interval.

    Args:
        table: number of pairs by the success of either.
    """
    n = sum(table.values())
    if not n:
        return None
    one = Share(table[True, True] + table[True, False], n)
    other = Share(table[True, True] + table[False, True], n)
    d = one.value - other.value
    p, q = one.value, other.value
    spread = np.sqrt(p * (1 - p) * q * (1 - q))
    phi = (table[True, True] / n - p * q) / spread if spread > 0.0 else 0.0
    (l1, u1), (l2, u2) = one.interval, other.interval
    low = (p - l1) ** 2 - 2 * phi * (p - l1) * (u2 - q) + (u2 - q) ** 2
    high = (u1 - p) ** 2 - 2 * phi * (u1 - p) * (q - l2) + (q - l2) ** 2
    return [float(d), float(d - np.sqrt(max(low, 0.0))), float(d + np.sqrt(max(high, 0.0)))]


def always(rows: Sequence[Row], times: int) -> dict[str, Any]:
    """Starts that succeed every time that they are played, of those whose episodes all count."""
    by_start: dict[int, list[Row]] = {}
    for row in rows:
        by_start.setdefault(row["number"], []).append(row)
    whole = [each for each in by_start.values() if all(counts(row) for row in each)]
    share = Share(sum(all(row["success"] for row in each) for each in whole), len(whole))
    return {
        "times": times,
        "starts": len(whole),
        "always": share.successes,
        "share": share.value if whole else None,
        "interval": list(share.interval) if whole else None,
    }


def limits(each: Sequence[Row]) -> dict[str, Any] | None:
    """What joints, 1 to 7, and contacts did at most in all episodes, as `Loads` says."""
    if not each:
        return None
    penetration: dict[str, float] = {}
    for one in each:
        for pair, depth in one["penetration"].items():
            penetration[pair] = max(depth, penetration.get(pair, 0.0))
    return {
        **{
            n: [float(f"{x:.4g}") for x in np.max([one[n] for one in each], axis=0)] for n in ARRAYS
        },
        "limited_samples": sum(one["limited_samples"] for one in each),
        "penetration": {pair: float(f"{penetration[pair]:.4g}") for pair in sorted(penetration)},
    }
