"""Pictures of sailing: curves over queries, clustering and noise, and a policy on the lake."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import ScalarFormatter

from irl.domains.sailing import DIRECTIONS, HEADINGS, LEG_TIMES, NEUTRAL, Sailing, point_of_sail

Curve = Sequence[Sequence[float]]  # rows of x, mean, low, high
STYLES = {
    "random_advice": ("random advice, one state a query", "tab:grey", "-"),
    "uncertain_state": ("most uncertain state", "tab:blue", "-"),
    "uncertain_cluster": ("most uncertain cluster", "tab:red", "-"),
    "random_cluster": ("random cluster", "tab:orange", "--"),
    "demonstrations": ("demonstrations alone", "tab:grey", "-"),
    "advice": ("with advice", "tab:red", "-"),
    "wrong_advice": ("with advice, as often wrong", "tab:orange", "--"),
    "advise": ("ADVISE, most uncertain cluster", "tab:purple", "-"),
    "advise_random": ("ADVISE, random cluster", "tab:purple", "--"),
    "birl": ("Bayesian IRL, most doubtful state", "tab:green", "-"),
    "birl_random": ("Bayesian IRL, random state", "tab:green", "--"),
}
TIME_COLOURS = {1.0: "tab:green", 2.0: "yellowgreen", 3.0: "tab:orange", 4.0: "tab:red"}


def draw_curve(axes: Axes, curve: Curve, label: str, **style: Any) -> None:
    """A mean with its band."""
    x, mean, low, high = np.array(curve).T
    (line,) = axes.plot(x, mean, label=label, **style)
    axes.fill_between(x, low, high, color=line.get_color(), alpha=0.15, linewidth=0)


def _label(axes: Axes, xlabel: str, ylabel: str) -> None:
    axes.set(xlabel=xlabel, ylabel=ylabel)
    axes.grid(alpha=0.3)


def plot_advice(
    figure: Figure, curves: Mapping[str, Curve], objective: Mapping[str, Curve], target: float
) -> None:
    """Figure 6.1: performance against queries, advice in the values or also in the objective."""
    figure.set_size_inches(12, 5.2)
    left, right = figure.subplots(1, 2, sharey=True)
    for axes, panel in ((left, curves), (right, objective)):
        for name, curve in panel.items():
            label, colour, line = STYLES[name]
            draw_curve(axes, curve, label, color=colour, linestyle=line)
        axes.axhline(target, color="black", linewidth=0.8, linestyle=":", label="target")
    left.set_xscale("symlog", linthresh=1)
    left.xaxis.set_major_formatter(ScalarFormatter())
    left.set_xlim(0, max(row[0] for curve in curves.values() for row in curve))
    left.set_title("advice in the action values (Algorithm 4.1)")
    right.set_title("advice in the objective as well")
    for axes in (left, right):
        axes.set_xlabel("queries to the expert")
        axes.grid(alpha=0.3)
    left.set_ylabel("performance (0 random, 1 optimal)")
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=5)
    figure.suptitle("Advice on the Sailing domain, mean and 95 % interval over the seeds")


def plot_others(figure: Figure, curves: Mapping[str, Curve], ours: Curve, target: float) -> None:
    """Performance against queries of other learners, and of ours with advice in the objective."""
    figure.set_size_inches(8, 5.2)
    axes = figure.subplots()
    most = max(row[0] for curve in curves.values() for row in curve)
    _, colour, line = STYLES["uncertain_cluster"]
    label = "FA-MLIRL, most uncertain cluster, advice in the objective"
    draw_curve(axes, [row for row in ours if row[0] <= most], label, color=colour, linestyle=line)
    for name, curve in curves.items():
        label, colour, line = STYLES[name]
        draw_curve(axes, curve, label, color=colour, linestyle=line)
    axes.axhline(target, color="black", linewidth=0.8, linestyle=":", label="target")
    _label(
        axes, "queries: advice, or for Bayesian IRL actions", "performance (0 random, 1 optimal)"
    )
    axes.legend(loc="lower right")
    axes.set_title("Other learners on the Sailing domain, mean and 95 % interval over the seeds")


def plot_clustering(figure: Figure, clustering: Mapping[str, Any]) -> None:
    """Figure 6.2: performance against queries, and against purity, by quality of clustering."""
    figure.set_size_inches(12, 5.4)
    left, right = figure.subplots(1, 2)
    colours = colormaps["viridis"](np.linspace(0.9, 0, len(clustering["levels"])))
    for level, colour in zip(clustering["levels"], colours, strict=True):
        label = f"{level['quality']:.0%} as in the ideal, purity {level['purity']:.2f}"
        draw_curve(left, level["curve"], label, color=colour)
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    _label(left, "queries to the expert", "performance (0 random, 1 optimal)")
    draw_curve(
        right, clustering["relative_to_ideal"],
        f"mean of queries 1 to {clustering['queries']}", color="tab:red", marker="o",
    )  # fmt: skip
    right.axhline(1, color="black", linewidth=0.8, linestyle=":")
    _label(right, "purity of the clustering", "performance relative to the ideal clustering")
    right.legend(loc="lower right")
    figure.suptitle("Quality of the clustering, mean and 95 % interval over the seeds")


def plot_noise(figure: Figure, curves: Mapping[str, Curve], queries: int) -> None:
    """Performance against the share of wrong labels, with advice and without."""
    figure.set_size_inches(7, 4.8)
    axes = figure.subplots()
    for name, curve in curves.items():
        label, colour, line = STYLES[name]
        draw_curve(axes, curve, label, color=colour, linestyle=line, marker="o", markersize=4)
    _label(axes, "share of wrong labels", "performance (0 random, 1 optimal)")
    axes.legend(loc="lower left")
    axes.set_title(f"{queries} queries about clusters; mean and 95 % interval over the seeds")


def plot_lake(
    figure: Figure,
    lake: Sailing,
    policies: Mapping[str, np.ndarray],
    wind: int,
    optimal: np.ndarray,
) -> None:
    """Policies on the lake under one wind, neutral tack; crosses where they are not optimal."""
    figure.set_size_inches(4.6 * len(policies), 6.0)
    panels = figure.subplots(1, len(policies), squeeze=False)
    here = np.flatnonzero(
        (lake.states[:, 2] == wind) & (lake.states[:, 3] == NEUTRAL) & ~lake.at_goal
    )
    at = lake.states[here, :2]
    for axes, (title, policy) in zip(panels[0], policies.items(), strict=True):
        legs = policy[here]
        minutes = np.array(LEG_TIMES)[point_of_sail(legs, wind)]
        for time, colour in TIME_COLOURS.items():
            taken = minutes == time
            move = HEADINGS[legs[taken]] / np.linalg.norm(HEADINGS[legs[taken]], axis=1)[:, None]
            axes.quiver(
                *at[taken].T, *move.T, pivot="mid", angles="xy", scale_units="xy", scale=1.5,
                units="xy", width=0.06, color=colour,
            )  # fmt: skip
        wrong = at[~optimal[here, legs]]
        axes.plot(*wrong.T, "x", color="black", markersize=5)
        axes.plot(*lake.states[lake.goal_states[0], :2], "*", color="black", markersize=16)
        axes.set(
            title=title, xlabel="x (east)", ylabel="y (north)", aspect="equal",
            xlim=(-0.7, lake.n - 0.3), ylim=(-0.7, lake.n - 0.3),
            xticks=range(lake.n), yticks=range(lake.n),
        )  # fmt: skip
    for time, colour in TIME_COLOURS.items():
        panels[0, 0].plot([], [], color=colour, linewidth=3, label=f"{time:.0f} min a leg")
    panels[0, 0].plot([], [], "x", color="black", label="not optimal")
    panels[0, 0].plot([], [], "*", color="black", markersize=12, label="goal")
    figure.legend(loc="outside lower center", ncols=6)
    figure.suptitle(f"Where to sail while the wind blows towards {DIRECTIONS[wind]}")
