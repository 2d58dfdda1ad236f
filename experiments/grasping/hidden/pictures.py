"""The picture of lessons: how much was said, and how good the learner was when it was over."""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

SIMPLER = {"labels agree": ("^", "#d95f02"), "policy unchanged": ("s", "#7570b3")}
"""Marks and colours of the simpler rules, by name."""


def draw_lessons(figure: Figure, rows: Sequence[Mapping[str, Any]], enough: float) -> None:
    """Draw accuracy by labels, of every lesson where it ended, and where simpler rules end it.

    Args:
        figure: to draw in.
        rows: of ``enough``, a lesson each.
        enough: the accuracy below which an ended lesson was ended wrongly.
    """
    figure.set_size_inches(9, 4.6)
    axis = figure.subplots()
    for stopped, label, marker in (
        (True, 'ended: "it reaches the goal, the way you like it"', "o"),
        (False, "not ended: how it is liked it has not understood, or it is not sure", "x"),
    ):
        some = [row for row in rows if row["stopped"] is stopped]
        axis.scatter(
            [row["labels"] for row in some],
            [row["accuracy_optimal_all"] for row in some],
            marker=marker,
            color="#2166ac" if stopped else "#444444",
            s=24,
            label=f"{label} ({len(some)})",
            zorder=3,
        )
    for rule, (marker, colour) in SIMPLER.items():
        ended = [row["simple"][rule] for row in rows if rule in row["simple"]]
        axis.scatter(
            [each["labels"] for each in ended],
            [each["accuracy_optimal_all"] for each in ended],
            marker=marker,
            facecolors="none",
            edgecolors=colour,
            linewidths=0.8,
            s=20,
            label=f"where the rule '{rule}' would have ended lessons ({len(ended)})",
        )
    axis.axhline(enough, color="k", lw=0.8, ls="--")
    axis.annotate(
        f"ended below {enough:.0%}: wrongly",
        (0, enough),
        xycoords=axis.get_yaxis_transform(),
        xytext=(4, -3),
        textcoords="offset points",
        ha="left",
        va="top",
        fontsize=8,
    )
    axis.set(xlabel="labels when the lesson was over", ylabel="states with an action as good")
    axis.yaxis.set_major_formatter(lambda value, _: f"{value:.0%}")
    axis.grid(alpha=0.3)
    figure.legend(*axis.get_legend_handles_labels(), loc="outside upper left", fontsize=8, ncols=2)
