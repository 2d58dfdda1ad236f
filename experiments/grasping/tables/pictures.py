"""Pictures of Table 6.3, the way from label to label, and what asking well is worth."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

SETS = {"initial": "the first 981", "random": "asked at random", "active": "asked by the learner"}
"""Demonstration sets, in words."""
COLOURS = {"thesis": "#777777", "fa_mlirl": "#2166ac"}
NAMES = {"thesis": "the thesis' network, made anew", "fa_mlirl": "the demo's network"}


def draw_matrix(
    figure: Figure,
    rows: Sequence[Mapping[str, Any]],
    thesis: Mapping[str, Sequence[float]],
    advice: Sequence[str],
) -> None:
    """Draw accuracies by set and advice: as printed in the thesis, and of each method."""
    methods = list(dict.fromkeys(row["method"] for row in rows))
    panels = [("printed in the thesis: the same action", np.array(list(thesis.values())).T)]
    for method in methods:
        for measure, words in (
            ("accuracy_strict", "the same action"),
            ("accuracy_optimal_all", "as good an action"),
        ):
            cells = {
                (row["advice"], row["demonstration_set"]): float(np.mean(row[measure]))
                for row in rows
                if row["method"] == method
            }
            matrix = np.array([[cells[a, s] for s in thesis] for a in advice])
            panels.append((f"{NAMES[method]}: {words}", matrix))
    figure.set_size_inches(4.2 * min(3, len(panels)), 3.6 * -(-len(panels) // 3))
    axes = figure.subplots(-(-len(panels) // 3), min(3, len(panels)), squeeze=False).ravel()
    for axis in axes[len(panels) :]:
        axis.axis("off")
    for axis, (title, matrix) in zip(axes, panels, strict=False):
        axis.imshow(matrix, vmin=0, vmax=1, cmap="Blues", aspect="auto")
        for (row, column), value in np.ndenumerate(matrix):
            colour = "w" if value > 0.6 else "k"
            axis.text(column, row, f"{value:.0%}", ha="center", va="center", color=colour)
        axis.set_xticks(range(len(thesis)), [SETS[name] for name in thesis], fontsize=8)
        axis.set_yticks(range(len(advice)), [f"advice: {name}" for name in advice], fontsize=8)
        axis.set_title(title, fontsize=9)


def draw_curves(figure: Figure, curves: Sequence[Mapping[str, Any]]) -> None:
    """Draw success and accuracy against demonstrated states, a thin line a seed."""
    figure.set_size_inches(10, 4.2)
    axes = figure.subplots(1, 2, sharex=True)
    measures = (("success", "goal reached"), ("accuracy_optimal_all", "an action as good"))
    for axis, (measure, words) in zip(axes, measures, strict=True):
        seen = set()
        for each in curves:
            for chosen, style in (("random", ":"), ("active", "-")):
                points, method = each[chosen], each["method"]
                label = f"{NAMES[method]}, {SETS[chosen]}"
                axis.plot(
                    [point["demonstrated"] for point in points],
                    [point[measure] for point in points],
                    style,
                    color=COLOURS[method],
                    lw=1,
                    label=None if label in seen else label,
                )
                seen.add(label)
        axis.set(xlabel="states demonstrated", ylim=(0, 1.02), title=words)
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize=7, frameon=False, loc="center right")


def draw_gains(figure: Figure, rows: Sequence[Mapping[str, Any]]) -> None:
    """Draw what each way to ask gains over random questions, with intervals, in points."""
    learners = list(dict.fromkeys(row["learner"] for row in rows))
    strategies = list(dict.fromkeys(row["strategy"] for row in rows))
    figure.set_size_inches(10, 0.32 * len(strategies) + 1.6)
    axes = figure.subplots(1, 2, sharey=True)
    measures = (("accuracy_optimal_all", "an action as good"), ("success_mdp", "goal reached"))
    for axis, (measure, words) in zip(axes, measures, strict=True):
        for k, learner in enumerate(learners):
            own = {row["strategy"]: row for row in rows if row["learner"] == learner}
            gains = np.array([own[name]["against_random"][measure] for name in strategies]).T
            mean, low, high = 100 * gains
            axis.errorbar(
                mean,
                np.arange(len(strategies)) + 0.2 * (k - (len(learners) - 1) / 2),
                xerr=[mean - low, high - mean],
                fmt="o",
                ms=4,
                capsize=2,
                label=learner,
            )
        axis.axvline(0, color="k", lw=0.8)
        axis.set(xlabel="points more than random questions", title=words)
        axis.grid(alpha=0.3)
    axes[0].set_yticks(range(len(strategies)), strategies, fontsize=8)
    axes[0].invert_yaxis()
    axes[1].legend(title="who learns", frameon=False, fontsize=8)
