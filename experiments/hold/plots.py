"""Pictures of the hold test: the verdict of every case, and slip by how much there was to spare."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from experiments.hold.held import GONE, HOLDS, LOST, SLIP, SLIPS

COLOURS = {HOLDS: "#4d9221", SLIPS: "#fdae61", LOST: "#b2182b"}
MEANING = {
    HOLDS: "holds: moves by at most 1 mm in the hand",
    SLIPS: "slips: by more than 1 mm",
    LOST: "lost: falls out of the hand",
}
AXIS = {"across": "along the pads", "closing": "pad to pad", "approach": "along the fingers"}
ENGINES = {
    "": ("Drake", "o", "#2166ac"),
    "halved_": ("Drake, half the step", "+", "#2166ac"),
    "mujoco_": ("MuJoCo, robosuite's hand", "x", "#e08214"),
}
_LEAST = 1e-4  # slips below are drawn there [mm]

Row = Mapping[str, Any]


def plot_verdicts(figure: Figure, rows: Sequence[Row]) -> None:
    """Draw a square per case: swings and shares from top to bottom, cubes from left to right."""
    lines = list(dict.fromkeys((row["swing"], row["share"]) for row in rows))
    cubes = sorted({(row["force_n"], row["mass_kg"], row["friction"]) for row in rows})
    cubes.sort(key=lambda cube: (-cube[0], cube[1], cube[2]))
    table = np.full((len(lines), len(cubes)), np.nan)
    names = list(COLOURS)
    for row in rows:
        if row["verdict"] in names:
            cube = (row["force_n"], row["mass_kg"], row["friction"])
            line = lines.index((row["swing"], row["share"]))
            table[line, cubes.index(cube)] = names.index(row["verdict"])
    figure.set_size_inches(0.55 * len(cubes) + 5.2, 0.26 * len(lines) + 3.2)
    axis = figure.subplots()
    colours = ListedColormap(list(COLOURS.values()))
    axis.imshow(table, cmap=colours, vmin=-0.5, vmax=2.5, aspect="auto")
    axis.set_xticks(np.arange(len(cubes)))
    axis.set_xticklabels([f"{m:g} kg, {mu:g}, {f:g} N" for f, m, mu in cubes], rotation=90)
    axis.set_yticks(np.arange(len(lines)))
    axis.set_yticklabels([_line(key, share, rows) for key, share in lines], fontsize=8)
    axis.set_xticks(np.arange(-0.5, len(cubes)), minor=True)
    axis.set_yticks(np.arange(-0.5, len(lines)), minor=True)
    axis.grid(which="minor", color="white", lw=2)
    axis.tick_params(which="minor", length=0)
    axis.set_xlabel("cube's mass, friction, force of each pad")
    axis.set_ylabel("swing, direction in the hand,\nlargest acceleration")
    figure.legend(
        handles=[
            *(Patch(color=COLOURS[name], label=MEANING[name]) for name in names),
            Patch(facecolor="white", edgecolor="0.7", label="not tried"),
        ],
        loc="outside lower center", ncols=1, frameon=False,
    )  # fmt: skip
    figure.suptitle("Does the hand keep the cube while the arm swings? (Drake)")


def _line(key: str, share: float, rows: Sequence[Row]) -> str:
    name, _, axis = key.rpartition("-")
    found = next(row for row in rows if (row["swing"], row["share"]) == (key, share))
    return f"{name}, {AXIS[axis]}, {found['acceleration_m_s2']:.1f} m/s²"


def plot_margin(figure: Figure, rows: Sequence[Row], bound: float) -> None:
    """Draw every case's slip over the friction there was for what had to be held."""
    figure.set_size_inches(9, 5.6)
    axis = figure.subplots()
    for prefix, (name, marker, colour) in ENGINES.items():
        seen = [row for row in rows if row.get(f"{prefix}slip_mm") is not None]
        if seen:
            slip = np.maximum([row[f"{prefix}slip_mm"] for row in seen], _LEAST)
            ratio = [row["ratio"] for row in seen]
            axis.plot(ratio, slip, marker, color=colour, mfc="none", ms=6, mew=1.1, label=name)
    axis.axhline(1e3 * SLIP, color="k", lw=0.8, ls=":")
    axis.axhline(1e3 * GONE, color="k", lw=0.8, ls=":")
    for y, words in ((1e3 * SLIP, "1 mm: slips"), (1e3 * GONE, "20 mm: lost")):
        axis.text(1.0, y, f" {words}", transform=axis.get_yaxis_transform(), va="center")
    for x, words, side in ((1.0, "just enough friction", "right"), (bound, "twice that", "left")):
        axis.axvline(x, color="0.5", lw=0.8)
        axis.text(
            x, 1.0, words, transform=axis.get_xaxis_transform(), ha=side, va="bottom", fontsize=8
        )
    axis.set(
        xscale="log",
        yscale="log",
        xlabel="friction that the pads can give ÷ what the cube may need,  2 µF ÷ m(g + a)",
        ylabel="largest slip in the hand [mm]",
    )
    axis.legend(loc="upper right", fontsize=9)
    axis.grid(alpha=0.3)
    figure.suptitle("A mark is a cube through a swing: its slip, by how much friction there was")
