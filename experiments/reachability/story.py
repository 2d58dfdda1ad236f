"""Where the arm reaches: the reachability map (thesis 5.5) and every action's feasibility."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any, Literal

import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm

from experiments.kit.command import Output
from experiments.kit.executors import MOST_WORKERS
from experiments.kit.shipped_data import FEASIBILITY, MAP, save_feasibility
from experiments.reachability import gen3_lite as gen3_lite_map
from experiments.reachability import workspace_run
from experiments.reachability.workspace_plots import plot_slices, write_scene
from irl.choices import Limits, Settings, check_choice
from models.inverse_kinematics.solution import IkSolution
from models.inverse_kinematics.solver import IkSolver
from models.maps import reachability, workspace_audit, workspace_csv
from models.maps.gripper_poses import Layer, gripper_pose
from models.maps.reachability import ReachabilityMap
from models.maps.reachability_csv import write_map
from models.maps.workspace import CLEARANCE_LIMIT, FAILURES, Grid
from models.motion import feasibility
from models.motion.feasibility import Feasibility
from models.scenes.planning_scene import MARGIN, PlanningScene
from models.task.spaces import GRIPPER_NAMES, POSITIONS


@dataclass(frozen=True)
class Config(Settings):
    """Build the reachability map, and plan every action at the middles of the cells."""

    robot: Literal["gen3", "gen3_lite"] = "gen3"
    """Which arm is meant; the Gen3 Lite has the thesis' grid only."""
    grid: Literal["thesis", "workspace"] = "thesis"
    """Which poses are tried: the task's own with those of its motions, or voxels all around."""
    low: Annotated[tuple[float, float, float], Limits(-10, 10)] = Grid.low
    """On the workspace grid: the centre of the first voxel (x, y, z) [m]."""
    high: Annotated[tuple[float, float, float], Limits(-10, 10)] = Grid.high
    """On the workspace grid: the centre of the last voxel [m]."""
    spacing: Annotated[float, Limits(0.001, 10)] = Grid.spacing
    """On the workspace grid: the edge of a voxel [m]."""
    margin: Annotated[float, Limits(0, 0.02)] = MARGIN
    """On the workspace grid: the smallest distance allowed between the arm and other things [m]."""
    workers: Annotated[int, Limits(1, MOST_WORKERS)] = 1
    """On the workspace grid: how many processes; the map is the same whatever their number."""
    audit: Annotated[int, Limits(0, 100_000_000)] = 0
    """On the workspace grid: how many random poses Drake alone checks the map with; 0 for none."""
    seed: int = 0
    """The seed of the random starting points of inverse kinematics, and of the audit."""
    out: Path = Path("out/reachability")
    """The folder that the results are written to."""


def main(config: Config, output: Output) -> dict[str, Any]:
    """Solve the poses, plan the actions, count."""
    if config.robot == "gen3_lite":
        check_choice("grid", config.grid, ("thesis",))
        return gen3_lite_map.run(config.seed, output)
    return workspace(config, output) if config.grid == "workspace" else thesis(config, output)


def workspace(config: Config, output: Output) -> dict[str, Any]:
    """Decide every pose of the grid, draw the map, and audit it if wanted."""
    plan = workspace_run.Plan(Grid(config.low, config.high, config.spacing), config.margin)
    chunks = output.folder / "chunks"
    began = perf_counter()
    the_map, seconds = workspace_run.compute(plan, chunks, config.workers)
    wall = perf_counter() - began
    with output.file(workspace_run.FILE) as path:
        workspace_run.write_map(the_map, config.margin, path)
    # What follows shows the file, as whoever reads it will see it.
    the_map = workspace_run.read_map(output.folder / workspace_run.FILE)
    began = perf_counter()
    with output.file(MAP) as path:
        workspace_csv.write_map(the_map, config.margin, path)
    csv_s = perf_counter() - began
    workspace_run.discard(chunks)
    with output.figure("workspace.png") as figure:
        plot_slices(figure, the_map)
    with output.file("workspace.html") as path:
        write_scene(the_map, path)

    reason = the_map.decisions.reason
    by_orientation = the_map.reachable.sum(axis=(0, 1, 2))
    failures = {str(f): int((reason == i).sum()) for i, f in enumerate(FAILURES, start=1)}
    result: dict[str, Any] = {
        "reachable": int(the_map.reachable.sum()),
        "total": plan.grid.total,
        "voxels": int(np.prod(plan.grid.shape)),
        "voxels_reached": int((the_map.share > 0.0).sum()),
        "by_orientation": dict(zip(GRIPPER_NAMES, by_orientation.tolist(), strict=True)),
        "failures": failures,
        "solves_per_s": plan.grid.total / seconds,
        "worker_s": seconds,
        "wall_s": wall,
        "map_csv": {
            "columns": workspace_csv.COLUMNS,
            "largest_clearance_m": CLEARANCE_LIMIT,
            "seconds": csv_s,
        },
    }
    print(f"{result['reachable']:,} of {result['total']:,} poses reachable")
    for name, number in failures.items():
        print(f"{number:9,} {name}")
    if config.audit:
        with tqdm(desc="audit", unit="pose") as bar:
            rng = np.random.default_rng(config.seed)
            audit = workspace_audit.audit(the_map, config.audit, rng, config.margin, bar.update)
        result["audit"] = {**vars(audit), "false_negative_rate": audit.false_negative_rate}
        print(
            f"audit: {audit.rejected} of {audit.positives:,} positives rejected; "
            f"{audit.missed} of {audit.negatives} negatives in {audit.sample} poses reached"
        )
    return result


def thesis(config: Config, output: Output) -> dict[str, Any]:
    """Build the task's own map and plan every action at the cells' middles."""
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
    with output.figure("reachability.png") as figure:
        draw(figure, the_map)

    layers = {
        layer.value: [entry.value for entry in the_map.entries if entry.layer == layer]
        for layer in (Layer.CELL, Layer.VIA, Layer.GRASP)
    }
    for name, values in layers.items():
        print(f"{name:>6}: {sum(values)} of {len(values)} poses reachable")
    solver = IkSolver(PlanningScene(carrying=True))
    for entry in the_map.entries:
        if entry.layer == Layer.CELL and not entry.value:
            why = IkSolution(None, entry.clearance, entry.failure, entry.attempts).reason()
            if entry.clearance is None:
                X_WG = gripper_pose(entry.p_WG, entry.gripper)
                why += f"; in closed form: {solver.solve(X_WG).reason()}"
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


def draw(figure: Figure, the_map: ReachabilityMap) -> None:
    """Draw the clearance of every cell pose; crosses are out of reach."""
    clearance = np.full((len(GRIPPER_NAMES), len(POSITIONS)), np.nan)
    for entry in the_map.entries:
        if entry.layer == Layer.CELL and entry.value and entry.clearance is not None:
            cell = int(np.linalg.norm(POSITIONS - entry.p_WG, axis=1).argmin())
            clearance[entry.gripper, cell] = 1e3 * entry.clearance.distance
    figure.set_size_inches(10, 7)
    axis = figure.subplots()
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
