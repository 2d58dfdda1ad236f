"""Several methods on one or more tasks: their names, and one picture of how good each is."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

NAMES = {
    "fa_mlirl": "FA-MLIRL (the thesis)",
    "max_ent": "MaxEnt",
    "deep_max_ent": "DeepMaxEnt",
    "bellman_gradient": "Bellman gradient",
    "linear_mlirl": "linear MLIRL",
    "lp": "LP (3.7)",
    "lp_advice": "LP with advice (3.9)",
    "lp_basis": "LP, basis functions (3.12)",
    "birl": "Bayesian IRL",
    "behaviour_cloning": "behaviour cloning",
    "planning": "sparse planning",
    "goal_posterior": "goal posterior",
}
"""What figures call each of `irl.methods.METHODS`; numbers are the thesis' equations."""


def names_of(methods: Sequence[str]) -> str:
    """Methods as a sentence lists them: ``MaxEnt, LP (3.7) and Bayesian IRL``."""
    names = [NAMES[method] for method in methods]
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


@dataclass(frozen=True)
class Panel:
    """One measure of all methods.

    Attributes:
        title: what the panel is about.
        label: what is measured, with its unit, along the axis.
        values: one for each method; None where it found no preference.
        best: what the demonstrator, or the true reward's own policy, gets.
        intervals: low and high of each method, if known.
    """

    title: str
    label: str
    values: Sequence[float | None]
    best: float
    intervals: Sequence[Sequence[float]] | None = None


def plot_methods(
    figure: Figure,
    methods: Sequence[str],
    panels: Sequence[Panel],
    seconds: Sequence[float],
    sentence: str,
) -> None:
    """Draw a bar per method and panel, and the seconds that learning took.

    Args:
        figure: to draw on.
        methods: keys, from top to bottom.
        panels: what to compare them by.
        seconds: that each method took to learn, all panels together.
        sentence: what the picture says, above it.
    """
    width = 3.2 * (len(panels) + 1) + 1.6
    figure.set_size_inches(width, 0.36 * len(methods) + 2.2)
    axes = figure.subplots(1, len(panels) + 1, sharey=True)
    names = [NAMES[method] for method in methods]
    for axis, panel in zip(axes, panels, strict=False):
        values = [np.nan if value is None else value for value in panel.values]
        axis.barh(names, values, color="#92c5de", label="policy that was learnt")
        if panel.intervals is not None:
            error = np.abs(np.array(panel.intervals).T - np.array(values))
            axis.errorbar(
                values, names, xerr=error, fmt="none", color="#2166ac", capsize=2, lw=1,
                label="95 % interval",
            )  # fmt: skip
        axis.axvline(panel.best, color="k", lw=1.2, ls="--", label="policy of the demonstrator")
        axis.xaxis.set_major_locator(MaxNLocator(5))
        _finish(axis, panel.title, panel.label)
        _write(axis, panel.values)
    axes[-1].barh(names, seconds, color="#d9d9d9")
    decades = np.log10([min(seconds) / 2, max(seconds)])
    axes[-1].set(xscale="log", xlim=(10 ** np.floor(decades[0]), 10 ** np.ceil(decades[1])))
    _finish(axes[-1], "time to learn", "seconds (logarithmic)")
    _write(axes[-1], seconds)
    axes[0].invert_yaxis()
    figure.legend(
        *axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False
    )
    figure.suptitle(textwrap.fill(sentence, int(11 * width)), fontsize=10)


def _finish(axis: Axes, title: str, label: str) -> None:
    axis.set_title(title, fontsize=10)
    axis.set_xlabel(label, fontsize=9)
    axis.grid(axis="x", alpha=0.3)
    axis.set_axisbelow(True)


def _write(axis: Axes, values: Sequence[float | None]) -> None:
    """Write each value at the left, with two digits after the point, or two that count."""
    for row, value in enumerate(values):
        if value is None:
            text = "no preference"
        elif abs(value) >= 10:
            text = f"{value:.0f}"
        else:
            text = f"{value:.2f}" if abs(value) >= 0.1 else f"{value:.2g}"
        axis.text(
            0.02, row, text, transform=axis.get_yaxis_transform(), va="center", fontsize=8,
            bbox={"facecolor": "white", "alpha": 0.6, "edgecolor": "none", "pad": 1},
        )  # fmt: skip
