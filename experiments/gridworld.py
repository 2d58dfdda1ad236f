"""Grid-world: four trajectories teach a policy for every cell (thesis §6.2).

Figures 6.3–6.6 and Table 6.2. The inverse temperature grows with the side n, for a border
trajectory says "stay on the edge" n times for each "leave it here", and neither β nor the
step knows where the goal is.
"""

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import matplotlib

matplotlib.use("Agg")  # figures go to files; no display is needed

import matplotlib.pyplot as plt
import numpy as np
import torch
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from tqdm import tqdm

from experiments.command import Output, execute
from irl.choices import check_range
from irl.domains.gridworld import ACTIONS, MOVES, GridWorld, goal_cell
from irl.errors import InputError
from irl.likelihood import LikelihoodProblem
from irl.preferences import StatePreferences
from irl.training import TrainingConfig, train
from irl.vr_function import VRFunction, torch_generator

COLOURS = ("tab:orange", "gold", "tab:green", "tab:blue")  # right, up, left, down: Figure 6.5
EVALUATIONS = 60  # points on each accuracy curve, dense where learning is fast
ARROWS_UP_TO = 35  # cells a side; beyond, arrows would be specks


@dataclass
class Config:
    """Learn grid-world policies from four corner-to-goal trajectories."""

    sizes: tuple[int, ...] = (7, 25)
    """Cells a side; odd if the goal is at the centre. The thesis also has 35 and 101."""
    seeds: tuple[int, ...] = (0, 1, 2)
    """One run each, per size."""
    seed: int = 0
    """Added to every one of the seeds."""
    trajectories: Literal["diagonal", "border"] = "diagonal"
    """Along the diagonals, or along the edge and straight in."""
    goal: Literal["centre", "offset"] = "centre"
    """The middle cell, or the cell (n // 4, 2n // 3)."""
    state_preferences: bool = False
    """Prefer the goal and avoid the cells at the limits, ±20 % of the learnt value."""
    additive: bool = True
    """Also train additive networks, tanh(g(x) + h(y)), reported as rows_additive."""
    iterations: int = 2000
    """Training iterations."""
    step: float = 1e-3
    """Adam's step, decaying to 0 on a cosine."""
    beta_per_cell: float = 10.0
    """Inverse temperature per cell of the side: β = 10 n."""
    hidden: tuple[int, ...] = (32, 32)
    """Widths of the hidden layers."""
    out: Path = field(default_factory=lambda: Path("out/gridworld"))
    """Where results go."""


@dataclass(frozen=True)
class Run:
    """One network's story: accuracy after each evaluation, the policy, the time it took."""

    iteration: list[int]
    accuracy: list[float]
    policy: np.ndarray
    seconds_per_iteration: float


def training_config(world: GridWorld, config: Config) -> TrainingConfig:
    """One rule for all grids and goals."""
    return TrainingConfig(
        iterations=config.iterations, step=config.step, beta=config.beta_per_cell * world.n
    )


def learn(world: GridWorld, config: Config, seed: int, additive: bool, bar: tqdm) -> Run:
    """Train one network, following its policy's accuracy along the way."""
    rng = np.random.default_rng(seed)
    network = VRFunction(2, config.hidden, generator=torch_generator(rng), additive=additive)
    problem = LikelihoodProblem.build(world.model, *world.demonstrations(config.trajectories))
    training = training_config(world, config)
    preferences = world.preferences() if config.state_preferences else StatePreferences()

    def policy() -> np.ndarray:
        f = preferences.apply(network.values(world.features))
        return world.model.q_values(f).argmax(axis=1)

    evaluations = set(np.geomspace(1, config.iterations, EVALUATIONS).round().astype(int))
    iteration, accuracy, watching = [0], [world.accuracy(policy())], 0.0

    def watch(done: int, _: float) -> None:
        nonlocal watching
        began = time.perf_counter()
        if done in evaluations:
            iteration.append(done)
            accuracy.append(world.accuracy(policy()))
            bar.update(done - iteration[-2])
        watching += time.perf_counter() - began

    began = time.perf_counter()
    train(network, problem, world.features, training, rng, watch)
    seconds = time.perf_counter() - began - watching
    return Run(iteration, accuracy, policy(), seconds / config.iterations)


def row(world: GridWorld, config: Config, runs: list[Run]) -> dict[str, Any]:
    """What ``result.json`` says of one size."""
    states, _ = world.demonstrations(config.trajectories)
    return {
        "size": world.n,
        "states": world.n_states,
        "trajectories": config.trajectories,
        "goal": config.goal,
        "state_preferences": config.state_preferences,
        "seeds": [config.seed + s for s in config.seeds],
        "demonstrated_fraction": np.unique(states).size / world.n_states,
        "accuracy": [run.accuracy[-1] for run in runs],
        "seconds_per_iteration": float(np.median([run.seconds_per_iteration for run in runs])),
        "iterations": config.iterations,
    }


def draw_cells(axes: Axes, world: GridWorld, colour: np.ndarray, palette: list[str]) -> None:
    """Fill each cell with its entry of ``palette`` and mark the goal with a star."""
    n = world.n
    norm = BoundaryNorm(np.arange(len(palette) + 1) - 0.5, len(palette))
    axes.imshow(colour.reshape(n, n), origin="lower", cmap=ListedColormap(palette), norm=norm)
    if n <= ARROWS_UP_TO:
        axes.set_xticks(np.arange(n + 1) - 0.5, [])
        axes.set_yticks(np.arange(n + 1) - 0.5, [])
        axes.grid(color="white", linewidth=0.5)
        axes.tick_params(length=0)
    axes.plot(*world.goal, marker="*", color="black", markersize=max(6, 100 / n))
    axes.set_xlabel("x")
    axes.set_ylabel("y")


def draw_arrows(axes: Axes, world: GridWorld, state: np.ndarray, action: np.ndarray) -> None:
    """Draw an arrow for each pair, on grids where it can be seen."""
    if world.n <= ARROWS_UP_TO:
        at, move = world.cells[state], MOVES[action]
        axes.quiver(
            *at.T, *move.T, pivot="mid", angles="xy", scale_units="xy", scale=1.6,
            units="xy", width=0.08, headlength=3, headaxislength=3,
        )  # fmt: skip


def draw_problem(axes: Axes, world: GridWorld, config: Config) -> None:
    """Figure 6.3: demonstrations as arrows on grey, cells nobody visited yellow."""
    state, action = world.demonstrations(config.trajectories)
    colour = np.zeros(world.n_states, dtype=int)
    if config.state_preferences:
        colour[world.preferences().avoided] = 1
    colour[state] = 2
    colour[world.goal_state] = 3
    draw_cells(axes, world, colour, ["khaki", "lightskyblue", "lightgrey", "limegreen"])
    draw_arrows(axes, world, state, action)
    axes.set_title(f"{config.trajectories} demonstrations")


def draw_policy(axes: Axes, world: GridWorld, config: Config, run: Run) -> None:
    """Figures 6.4 and 6.5: a colour for each action, demonstrated cells grey."""
    demonstrated, _ = world.demonstrations(config.trajectories)
    colour = run.policy.copy()
    colour[demonstrated] = 4
    colour[world.goal_state] = 5
    draw_cells(axes, world, colour, [*COLOURS, "lightgrey", "white"])
    others = np.delete(np.arange(world.n_states), world.goal_state)
    draw_arrows(axes, world, others, run.policy[others])
    for name, tint in zip((*ACTIONS, "demonstrated"), (*COLOURS, "lightgrey"), strict=True):
        axes.scatter([], [], marker="s", color=tint, label=name)
    axes.figure.legend(loc="outside lower right", ncols=5)
    axes.set_title(f"policy, accuracy {run.accuracy[-1]:.1%}")


def save_maps(output: Output, world: GridWorld, config: Config, run: Run) -> None:
    """The problem and one learnt policy, side by side."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 6.2), layout="constrained")
    draw_problem(left, world, config)
    draw_policy(right, world, config, run)
    with output.file(f"policy_{world.n}.png") as path:
        figure.savefig(path, dpi=120)
    plt.close(figure)


def save_curves(output: Output, curves: dict[str, list[Run]]) -> None:
    """Figure 6.6: accuracy along the iterations, mean and range over the seeds."""
    figure, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
    for label, runs in curves.items():
        accuracy = np.array([run.accuracy for run in runs])
        (line,) = axes.plot(runs[0].iteration, accuracy.mean(axis=0), label=label)
        axes.fill_between(
            runs[0].iteration, accuracy.min(axis=0), accuracy.max(axis=0),
            color=line.get_color(), alpha=0.2, linewidth=0,
        )  # fmt: skip
    axes.set_xscale("symlog", linthresh=1)
    axes.set(
        xlabel="iteration",
        ylabel="cells that reach the goal (share)",
        ylim=(0, 1.02),
        xlim=(0, None),
    )
    axes.grid(alpha=0.3)
    axes.legend(title="mean and range over seeds", loc="lower right")
    with output.file("accuracy.png") as path:
        figure.savefig(path, dpi=120)
    plt.close(figure)


def main(config: Config, output: Output) -> dict[str, Any]:
    """Learn every grid with every seed; plot and tabulate."""
    # Mistakes are told before any work begins.
    for name in ("sizes", "seeds"):
        if not getattr(config, name):
            raise InputError(f"{name}: at least one value is needed")
    check_range("iterations", config.iterations, 1)
    check_range("hidden", min(config.hidden, default=1), 1)
    check_range("seed + seeds", config.seed + min(config.seeds), 0)
    worlds = [GridWorld(n, goal_cell(n, config.goal)) for n in config.sizes]
    for world in worlds:
        training_config(world, config)
    torch.set_num_threads(1)  # the networks are far too small to share
    kinds = {"rows": False, "rows_additive": True} if config.additive else {"rows": False}
    result: dict[str, Any] = {kind: [] for kind in kinds}
    curves: dict[str, list[Run]] = {}
    total = len(worlds) * len(config.seeds) * len(kinds) * config.iterations
    with tqdm(total=total, unit="it", desc="gridworld") as bar:
        for world in worlds:
            for kind, additive in kinds.items():
                name = f"{world.n} × {world.n}" + (", additive" if additive else "")
                bar.set_postfix_str(name)
                runs = [learn(world, config, config.seed + s, additive, bar) for s in config.seeds]
                result[kind].append(row(world, config, runs))
                if not additive:
                    curves[name] = runs
            save_maps(output, world, config, curves[f"{world.n} × {world.n}"][0])
    save_curves(output, curves)
    return result


if __name__ == "__main__":
    execute(Config, main)
