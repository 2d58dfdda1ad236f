"""Pictures of the transition model."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from diagrams.transition_counts import Evidence, TransitionEntries, count_pairs
from models.task.spaces import GRIPPER_NAMES, N_ACTIONS, N_GRIPPERS, Kind, decode_states

_COLOURS = {"measured": "#1b7837", "kernel": "#7fbf7b", "estimated": "#d9d9d9"}


def plot_coverage(entries: TransitionEntries, path: Path) -> None:
    """Draw which pairs have trials behind them, and how surely each action ends as expected."""
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(13, 5), width_ratios=[2, 3], layout="constrained"
    )
    counts = count_pairs(entries)
    names = list(counts)
    left_edge = np.zeros(len(names))
    for evidence in Evidence:
        label = evidence.name.lower()
        share = np.array([counts[n][label] / max(1, sum(counts[n].values())) for n in names])
        left.barh(names, share, left=left_edge, color=_COLOURS[label], label=label)
        left_edge += share
    for row, name in enumerate(names):
        numbers = ", ".join(f"{n:,} {label}" for label, n in counts[name].items() if n)
        left.text(0.02, row, numbers, va="center")
    left.set(xlim=(0, 1), xlabel="share of the feasible pairs", title="Evidence")
    left.legend(loc="upper center", bbox_to_anchor=(0.45, -0.12), ncol=3, frameon=False)

    grasp, drop = (_certainty(entries, kind) for kind in (Kind.GRASP, Kind.DROP))
    rows = np.arange(N_GRIPPERS)
    right.barh(rows - 0.2, np.nan_to_num(grasp), height=0.4, label="grasp", color="#4393c3")
    right.barh(rows + 0.2, np.nan_to_num(drop), height=0.4, label="drop", color="#f4a582")
    for row in rows[np.isnan(grasp)]:
        right.text(0.01, row - 0.2, "no grasp", va="center", fontsize=7, color="#555555")
    right.set(
        yticks=rows,
        yticklabels=[f"{i} {name}" for i, name in enumerate(GRIPPER_NAMES)],
        xlim=(0, 1),
        xlabel="probability of the most likely outcome, mean over states",
        title="Certainty by gripper orientation",
    )
    right.invert_yaxis()
    right.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncol=2, frameon=False)
    figure.savefig(path, dpi=120, bbox_inches="tight")
    plt.close(figure)


def _certainty(entries: TransitionEntries, kind: Kind) -> np.ndarray:
    """Mean probability of the likeliest outcome by gripper ``[18]``; NaN without pairs."""
    of_kind = entries.action // N_GRIPPERS == kind
    pair = entries.state[of_kind].astype(np.int64) * N_ACTIONS + entries.action[of_kind]
    pairs, row = np.unique(pair, return_inverse=True)
    best = np.zeros(pairs.size)
    np.maximum.at(best, row, entries.probability[of_kind])
    state, action = np.divmod(pairs, N_ACTIONS)
    hand = action if kind == Kind.GRASP else decode_states(state).gripper
    total = np.bincount(hand, best, minlength=N_GRIPPERS)
    number = np.bincount(hand, minlength=N_GRIPPERS)
    return np.divide(total, number, out=np.full(N_GRIPPERS, np.nan), where=number > 0)
