"""How much of the transition model rests on trials, and how sure it is: tables and a picture."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from diagrams.trials.counts import Evidence, TransitionEntries, count_pairs
from models.task.pairs import split_key
from models.task.spaces import (
    GRIPPER_NAMES,
    N_GRIPPERS,
    N_ORIENTATIONS,
    Kind,
    decode_actions,
    decode_states,
)

_COLOURS = {"measured": "#1b7837", "kernel": "#7fbf7b", "estimated": "#d9d9d9"}


def coverage_by_gripper(entries: TransitionEntries) -> list[dict[str, Any]]:
    """By gripper orientation: pairs of each kind of action, how many have trials, how sure.

    The gripper is the one that grasps or holds; ``certainty`` is the mean probability of the
    likeliest outcome.
    """
    pairs = _pairs(entries)
    rows = []
    for gripper, name in enumerate(GRIPPER_NAMES):
        row: dict[str, Any] = {"gripper": gripper, "name": name}
        for kind in Kind:
            mine = (pairs["gripper"] == gripper) & (pairs["kind"] == kind)
            tried = mine & (pairs["evidence"] != Evidence.ESTIMATED)
            row[kind.name.lower()] = {
                "pairs": int(mine.sum()),
                "tried": int(tried.sum()),
                "certainty": float(pairs["best"][mine].mean()) if mine.any() else None,
            }
        rows.append(row)
    return rows


def print_coverage(
    counts: Mapping[str, Mapping[str, int]], by_gripper: Sequence[Mapping[str, Any]]
) -> None:
    """Print both tables: by kind of action and evidence, and by gripper orientation."""
    print(f"{'action':>10} {'measured':>9} {'kernel':>9} {'estimated':>10}")
    for action, number in counts.items():
        print(
            f"{action:>10} {number['measured']:9d} {number['kernel']:9d} {number['estimated']:10d}"
        )
    kinds = [kind.name.lower() for kind in Kind]
    print(f"\npairs with trials / feasible pairs, certainty\n{'gripper':26}", end="")
    print("".join(f"{kind:>24}" for kind in kinds))
    for row in by_gripper:
        cells = []
        for kind in kinds:
            cell = row[kind]
            sure = "" if cell["certainty"] is None else f"{cell['certainty']:6.1%}"
            cells.append(f"{cell['tried']:7d} /{cell['pairs']:6d} {sure:>7}")
        print(f"{row['name']:26}" + "".join(f"{cell:>24}" for cell in cells))


def plot_coverage(figure: Figure, entries: TransitionEntries) -> None:
    """Draw which pairs have trials behind them, and how surely each action ends as it mostly does.

    Below, one square is a cube orientation and the gripper that grasps or holds it, all
    cells and targets together: white where nothing is feasible, hatched where all is estimated.
    """
    figure.set_size_inches(14, 8.5)
    top, bottom = np.asarray(figure.subfigures(2, 1, height_ratios=[1, 3.4]))
    _draw_evidence(top.subplots(), count_pairs(entries))
    pairs = _pairs(entries)
    panels: Any = bottom.subplots(1, len(Kind), sharey=True)
    image = None
    for panel, kind in zip(panels, Kind, strict=True):
        mine = pairs["kind"] == kind
        cell = pairs["orientation"][mine] * N_GRIPPERS + pairs["gripper"][mine]
        size = N_ORIENTATIONS * N_GRIPPERS
        number = np.bincount(cell, minlength=size)
        total = np.bincount(cell, pairs["best"][mine], minlength=size)
        tried = np.bincount(cell, pairs["evidence"][mine] != Evidence.ESTIMATED, minlength=size)
        mean = np.divide(total, number, out=np.full(size, np.nan), where=number > 0)
        shape = (N_ORIENTATIONS, N_GRIPPERS)
        image = panel.imshow(
            mean.reshape(shape), vmin=0.4, vmax=1.0, cmap="viridis", aspect="auto", origin="lower"
        )
        untried = ((tried == 0) & (number > 0)).reshape(shape)
        for orientation, gripper in np.argwhere(untried):
            panel.add_patch(
                Rectangle((gripper - 0.5, orientation - 0.5), 1, 1, fill=False, hatch="////", lw=0)
            )
        panel.set(title=kind.name.lower(), xlabel="gripper orientation")
        panel.set_xticks(range(0, N_GRIPPERS, 3))
    panels[0].set(ylabel="cube orientation (Table 4.1)")
    panels[0].set_yticks(range(0, N_ORIENTATIONS, 8))
    bottom.colorbar(image, ax=panels, label="probability of the likeliest outcome, mean")


def _draw_evidence(axes: Any, counts: Mapping[str, Mapping[str, int]]) -> None:
    names = list(counts)
    left_edge = np.zeros(len(names))
    for evidence in Evidence:
        label = evidence.name.lower()
        share = np.array([counts[n][label] / max(1, sum(counts[n].values())) for n in names])
        axes.barh(names, share, left=left_edge, color=_COLOURS[label], label=label)
        left_edge += share
    for row, name in enumerate(names):
        numbers = ", ".join(f"{n:,} {label}" for label, n in counts[name].items() if n)
        axes.text(0.01, row, numbers, va="center")
    axes.set(xlim=(0, 1), xlabel="share of the feasible pairs, by evidence")
    axes.invert_yaxis()
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)


def _pairs(entries: TransitionEntries) -> dict[str, np.ndarray]:
    """Of each pair: kind, cube orientation, gripper, evidence, probability of the likeliest."""
    keys, first, row = np.unique(entries.key, return_index=True, return_inverse=True)
    best = np.zeros(keys.size)
    np.maximum.at(best, row, entries.probability)
    state, action = split_key(keys)
    _, orientation, gripper = decode_states(state)
    kind, target = decode_actions(action)
    return {
        "kind": kind,
        "orientation": orientation,
        "gripper": np.where(kind == Kind.GRASP, target, gripper),
        "evidence": entries.evidence[first],
        "best": best,
    }
