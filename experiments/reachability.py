"""Where the arm reaches: the reachability map (thesis 5.5) and every action's feasibility."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any, Literal

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from tqdm import tqdm

from experiments.command import Output, execute
from experiments.robot_data import FEASIBILITY, MAP, save_feasibility
from models import feasibility, reachability
from models.feasibility import Feasibility
from models.gripper_poses import Layer
from models.reachability import ReachabilityMap
from models.reachability_csv import write_map
from models.task.spaces import GRIPPER_NAMES, POSITIONS


@dataclass(frozen=True)
class Config:
    """Build the reachability map and plan every action at the cells' middles."""

    robot: Literal["gen3"] = "gen3"
    """Which arm."""
    grid: Literal["thesis"] = "thesis"
    """Which poses: the task's own, with those that its motions need."""
    seed: int = 0
    """Of the random starting points of inverse kinematics."""
    out: Path = Path("out/reachability")
    """Folder of the results."""


def main(config: Config, output: Output) -> dict[str, Any]:
    """Solve the poses, plan the actions, count."""
    started = perf_counter()
    with tqdm(desc="poses", unit="orientation") as bar:
        the_map = reachability.build(config.seed, _on(bar))
    seconds = perf_counter() - started
    with output.file(MAP) as path:
        write_map(the_map, path)
    with tqdm(desc="actions", unit="cell") as bar:
        feasible = feasibility.compute(the_map, _on(bar))
    with output.file(FEASIBILITY) as path:
        save_feasibility(feasible, output.folder / MAP, path)
    with output.file("reachability.png") as path:
        draw(the_map, path)

    layers = {
        layer.value: [entry.value for entry in the_map.entries if entry.layer == layer]
        for layer in (Layer.CELL, Layer.VIA, Layer.GRASP)
    }
    for name, values in layers.items():
        print(f"{name:>6}: {sum(values)} of {len(values)} poses reachable")
    for entry in the_map.entries:
        if entry.layer == Layer.CELL and not entry.value:
            why = (
                entry.failure if entry.clearance is None else f"{entry.failure}, {entry.clearance}"
            )
            print(f"    {entry.p_WG.tolist()} by {GRIPPER_NAMES[entry.gripper]}: {why}")
    return {
        "reachable": sum(layers["cell"]),
        "total": len(layers["cell"]),
        "solves_per_s": len(the_map.entries) / seconds,
        "layers": {k: {"reachable": sum(v), "total": len(v)} for k, v in layers.items()},
        **_shares(feasible),
    }


def _on(bar: tqdm) -> Callable[[int, int], None]:
    def progress(done: int, total: int) -> None:
        bar.total = total
        bar.update(done - bar.n)

    return progress


def _shares(feasible: Feasibility) -> dict[str, Any]:
    """Feasible share of actions between reachable poses, and the number of pairs."""
    held = feasible.held
    # [cell, gripper, target cell] and [cell, gripper, target gripper], present pose left out
    moves = held[:, :, None] & held.T[None] & ~np.eye(len(held), dtype=bool)[:, None]
    turns = held[:, :, None] & held[:, None] & ~np.eye(held.shape[1], dtype=bool)[None]
    result = {
        "translations_feasible": feasible.translate.sum() / moves.sum(),
        "rotations_feasible": feasible.rotate.sum() / turns.sum(),
        "grasps_feasible": int(feasible.grasp.sum()),
        "drops_feasible": feasible.drop.sum() / held.sum(),
        "feasible_pairs": int(feasible.mask().sum()),
    }
    print(
        f"translations {result['translations_feasible']:.1%}, "
        f"rotations {result['rotations_feasible']:.1%}, drops {result['drops_feasible']:.1%} "
        f"of those between reachable poses; {result['grasps_feasible']} grasps; "
        f"{result['feasible_pairs']:,} state-action pairs"
    )
    return result


def draw(the_map: ReachabilityMap, path: Path) -> None:
    """Draw the clearance of every cell pose; crosses are out of reach."""
    clearance = np.full((len(GRIPPER_NAMES), len(POSITIONS)), np.nan)
    for entry in the_map.entries:
        if entry.layer == Layer.CELL and entry.value and entry.clearance is not None:
            cell = int(np.linalg.norm(POSITIONS - entry.p_WG, axis=1).argmin())
            clearance[entry.gripper, cell] = 1e3 * entry.clearance.distance
    figure, axis = plt.subplots(figsize=(10, 7), layout="constrained")
    image = axis.imshow(clearance, cmap="viridis", vmin=0.0, aspect="auto")
    for row, column in np.argwhere(np.isnan(clearance)):
        axis.text(column, row, "×", ha="center", va="center", color="crimson", fontsize=16)
    axis.set(
        xticks=range(len(POSITIONS)),
        yticks=range(len(GRIPPER_NAMES)),
        yticklabels=[f"{i} {name}" for i, name in enumerate(GRIPPER_NAMES)],
        xlabel="position of the tool centre point [m]",
        title="Reachable poses and their clearance (× out of reach)",
    )
    labels = [f"({x:g}, {y:g}, {z:g})" for x, y, z in POSITIONS]
    axis.set_xticklabels(labels, rotation=60, ha="right", fontsize=8)
    figure.colorbar(image, label="clearance [mm]")
    figure.savefig(path, dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    execute(Config, main)
