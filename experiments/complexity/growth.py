"""How times grow with the number of states: the published table, exponents, the picture."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from scipy.special import stdtrit

from experiments.kit.method_plots import NAMES
from irl.methods import METHODS

Rows = Sequence[Mapping[str, Any]]  # each with "states" and "seconds" by method
PUBLISHED_STATES = (25, 225, 625, 1225, 2025, 3025, 4225, 5625, 7225, 9025)
PUBLISHED: dict[str, list[float]] = {
    "max_ent": [
        *(0.017, 1.831, 24.151, 133.189, 474.907),
        *(1319.365, 3030.723, 6197.718, 12234.417, 20941.9),
    ],
    "deep_max_ent": [
        *(0.012, 0.178, 0.95, 3.158, 8.119, 20.253, 59.279, 101.434, 229.752, 10466.784),
    ],
    "bellman_gradient": [
        *(0.0313, 2.031, 20.963, 102.46, 352.007),
        *(1061.147, 2630.309, 5228.343, 10147.628, 16345.874),
    ],
    "fa_mlirl": [0.197, 0.397, 0.724, 0.921, 0.776, 0.762, 2.468, 2.831, 2.217, 3.347],
}
"""Seconds an iteration, by our keys."""
SOURCE = "Li & Burdick (2017), as quoted in thesis Table 6.1; measured on another machine"
FIT_FROM = 1000  # states; below, the fixed cost of a call hides the growth
COLOURS = dict(zip(METHODS, [*(f"C{k}" for k in range(10)), "black", "gold"], strict=True))


def published_rows() -> list[dict[str, Any]]:
    """Table 6.1 as it was published, in the form of our rows."""
    return [
        {"states": states, "seconds": {name: column[k] for name, column in PUBLISHED.items()}}
        for k, states in enumerate(PUBLISHED_STATES)
    ]


def points(rows: Rows, name: str) -> np.ndarray:
    """States and seconds of a method where it was timed, ``[k, 2]``."""
    found = [(row["states"], row["seconds"][name]) for row in rows if name in row["seconds"]]
    return np.array(found, dtype=np.float64).reshape(-1, 2)


def growth(rows: Rows) -> dict[str, dict[str, Any]]:
    """Exponent p of seconds ∝ statesᵖ per method, with its 95 % interval.

    Least squares in log–log over grids from ``FIT_FROM`` states; nothing for a method that was
    timed on fewer than three of them.
    """
    fits = {}
    for name in METHODS:
        large = points(rows, name)
        large = large[large[:, 0] >= FIT_FROM]
        if len(large) < 3:
            continue
        x, y = np.log(large).T
        line, covariance = np.polyfit(x, y, deg=1, cov=True)
        half = float(stdtrit(len(large) - 2, 0.975) * np.sqrt(covariance[0, 0]))
        fits[name] = {
            "exponent": float(line[0]),
            "low": float(line[0]) - half,
            "high": float(line[0]) + half,
            "states": large[:, 0].astype(int).tolist(),
        }
    return fits


def interpretation(rows: Rows) -> str:
    """What the times say, in one sentence, of the largest grid."""
    last = rows[-1]
    where = f"On {last['states']:,} states"
    others = {
        name: ratio
        for name, ratio in last["times_fa_mlirl"].items()
        if METHODS[name].iterate and name != "fa_mlirl"
    }
    if not others:
        return f"{where}, an iteration takes {1e3 * max(last['seconds'].values()):.2g} ms at most."
    least, most = min(others, key=others.__getitem__), max(others, key=others.__getitem__)
    return (
        f"{where}, an iteration of FA-MLIRL takes {1e3 * last['seconds']['fa_mlirl']:.2g} ms; "
        f"those of other methods take {others[least]:.2g} ({NAMES[least]}) "
        f"to {others[most]:.3g} times ({NAMES[most]}) as long."
    )


def plot_times(figure: Figure, rows: Rows) -> None:
    """Ours solid, whole solves dotted, published times dashed in the same colour."""
    figure.set_size_inches(10, 6)
    axes = figure.subplots()
    styles: dict[str, dict[str, Any]] = {
        "ours, an iteration:": {"linestyle": "-", "marker": "o", "markersize": 4},
        "ours, a whole solve:": {"linestyle": ":", "marker": "s", "markersize": 4},
        "published, an iteration:": {"linestyle": "--", "marker": "x", "markersize": 5},
    }
    lines: dict[str, list[Any]] = {group: [] for group in styles}

    def draw(group: str, table: Rows, name: str) -> None:
        found = points(table, name)
        if len(found):
            colour, label = COLOURS[name], NAMES[name]
            lines[group] += axes.plot(*found.T, color=colour, label=label, **styles[group])

    for name, method in METHODS.items():
        draw("ours, an iteration:" if method.iterate else "ours, a whole solve:", rows, name)
        if name in PUBLISHED:
            draw("published, an iteration:", published_rows(), name)
    axes.set(xscale="log", yscale="log", xlabel="states of the grid", ylabel="time [s]")
    axes.grid(alpha=0.3)
    axes.set_title(textwrap.fill(interpretation(rows), 95), fontsize=10)
    entries: list[Any] = []
    for group, drawn in lines.items():
        if drawn:  # a heading is an entry without a line
            entries += [Line2D([], [], linestyle="", label=group), *drawn]
    figure.legend(handles=entries, loc="outside right upper", frameon=False)
