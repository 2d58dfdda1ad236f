"""Grid-world: four trajectories teach a policy for every cell (thesis §6.2).

Figures 6.3–6.6 and Table 6.2. The inverse temperature grows with the side n, for a border
trajectory says "stay on the edge" n times for each "leave it here", and neither β nor the
step knows where the goal is. With ``--hard`` come the cases that this recipe fails at.
"""

from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from experiments.gridworld.hard import cases, hard_rows
from experiments.gridworld.learning import (
    Learning,
    Lesson,
    Run,
    learn,
    policy_of,
)
from experiments.gridworld.plots import (
    plot_curves,
    plot_hard,
    plot_hard_policies,
    plot_policy,
    plot_preferences,
    plot_times,
)
from experiments.kit.command import Output
from experiments.kit.executors import MOST_WORKERS, Mapper, mapper, run_all
from experiments.kit.options import LARGEST_SEED, about
from irl.choices import Limits, Settings, check_choice
from irl.domains.gridworld import GridWorld, goal_cell
from irl.errors import InputError
from irl.preferences import StatePreferences
from irl.queries import COMMITTEE_STRATEGIES, STATE_STRATEGIES
from irl.vr_function import WIDEST

WIDEST_GRID = 1001
"""Cells a side; a million states take a gigabyte and, to judge a policy, seconds."""
PUBLISHED = {7: 0.0106, 25: 0.0377, 35: 0.0541, 101: 0.0845}
"""Seconds an iteration by side, thesis Table 6.2; 2000 iterations, on unnamed hardware."""


@dataclass
class Config(Settings):
    """Learn grid-world policies from four corner-to-goal trajectories."""

    sizes: Annotated[tuple[int, ...], Limits(0, WIDEST_GRID, some=True)] = (7, 25)
    """The sides of the grids in cells, odd if the goal is at the centre.
    The thesis also has 35 and 101."""
    seeds: Annotated[tuple[int, ...], Limits(-LARGEST_SEED, LARGEST_SEED, some=True)] = (0, 1, 2)
    """The seeds: of each there is one run per size."""
    seed: int = 0
    """A number that is added to each of the seeds."""
    trajectories: Literal["diagonal", "border"] = "diagonal"
    """Where demonstrations lead: along the diagonals, or along the edge and straight in."""
    goal: Literal["centre", "offset", "corner"] = "centre"
    """Where the goal is: the middle cell, the cell (n // 4, 2n // 3), or the cell (0, 0)."""
    state_preferences: bool = False
    """Whether the goal is preferred and the limits are avoided, ±20 % of the learnt value."""
    additive: bool = True
    """Whether additive networks, tanh(g(x) + h(y)), are trained too; reported as rows_additive."""
    iterations: Annotated[int, Limits(1, 10_000_000)] = 2000
    """How many iterations the training has."""
    step: Annotated[float, Limits(0, 1e6, open_low=True)] = 1e-3
    """The step of Adam, which decays to 0 on a cosine."""
    beta_per_cell: Annotated[float, Limits(0, 1e6, open_low=True)] = 10.0
    """The inverse temperature per cell of the side: by default β = 10 n."""
    hidden: Annotated[tuple[int, ...], Limits(1, WIDEST)] = (32, 32)
    """The widths of the hidden layers."""
    hard: bool = False
    """Whether to learn the hard cases: a goal at a corner, walls, wrong actions, unseen parts."""
    hard_size: Annotated[int, Limits(5, WIDEST_GRID)] = 25
    """The side of the hard cases in cells, odd."""
    hard_seeds: Annotated[int, Limits(1, 1_000_000)] = 10
    """How many runs there are of each hard case and kind of help, from the seed on."""
    wrong: Annotated[tuple[float, ...], Limits(0, 1)] = (0.1, 0.3)
    """Which shares of the demonstrated actions are wrong in the hard cases of that kind."""
    queries: Annotated[int, Limits(0, 1_000_000)] = 8
    """How many queries help in the hard cases that have them, each answered with a trajectory."""
    state_query: str = "visitation_entropy"
    """Which state a query is about: a name in irl.queries.STATE_STRATEGIES without a committee."""
    workers: Annotated[int, Limits(1, MOST_WORKERS)] = 1
    """How many processes; the results do not depend on it, times may."""
    out: Path = field(default_factory=lambda: Path("out/gridworld"))
    """The folder that the results are written to."""

    @property
    def settings(self) -> Learning:
        """How every network learns."""
        return Learning(self.iterations, self.step, self.beta_per_cell, self.hidden)


def row(world: GridWorld, config: Config, runs: list[Run]) -> dict[str, Any]:
    """What ``result.json`` says of one size; times are in seconds."""
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
        "accuracy_shortest": [run.shortest for run in runs],
        "seconds_per_iteration": float(np.median([run.seconds_per_iteration for run in runs])),
        "seconds_per_iteration_thesis": PUBLISHED.get(world.n),
        "wall_s": [run.wall_s for run in runs],
        "cpu_s": [run.cpu_s for run in runs],
        "iterations": config.iterations,
    }


def checked_worlds(config: Config) -> list[GridWorld]:
    """The grids, once all settings are known to be good.

    Raises:
        InputError: naming the setting that is not.
    """
    if config.seed + min(config.seeds) < 0:
        raise InputError(f"seeds: with --seed added, all must be ≥ 0, are {config.seeds}")
    check_choice("state_query", config.state_query, STATE_STRATEGIES.keys() - COMMITTEE_STRATEGIES)
    with about("sizes"):
        worlds = [GridWorld(n, goal_cell(n, config.goal)) for n in config.sizes]
    for world in worlds:
        config.settings.training(world.n)
    return worlds


def solvable(
    config: Config, worlds: list[GridWorld], output: Output, over: Mapper
) -> dict[str, Any]:
    """Figures 6.3, 6.5, 6.6 and Table 6.2: every size with every seed."""
    kinds = {"rows": False, "rows_additive": True} if config.additive else {"rows": False}
    lessons = [
        Lesson(
            world,
            config.trajectories,
            config.seed + seed,
            config.settings,
            additive,
            config.state_preferences,
        )
        for world, additive, seed in product(worlds, kinds.values(), config.seeds)
    ]
    runs = iter(run_all(learn, lessons, over, "gridworld"))
    result: dict[str, Any] = {kind: [] for kind in kinds}
    curves: dict[str, list[Run]] = {}
    for world in worlds:
        for kind in kinds:
            group = [next(runs) for _ in config.seeds]
            result[kind].append(row(world, config, group))
            if kind == "rows":
                curves[f"{world.n} × {world.n}"] = group
                with output.figure(f"policy_{world.n}.png") as figure:
                    plot_policy(
                        figure, world, config.trajectories, group[0], config.state_preferences
                    )
    with output.figure("accuracy.png") as figure:
        plot_curves(figure, curves)
    with output.figure("time.png") as figure:
        plot_times(figure, result["rows"], PUBLISHED)
    return result


def correction(config: Config, output: Output, over: Mapper) -> list[dict[str, Any]]:
    """Figure 6.4: how state preferences turn demonstrations along the limits inwards.

    With our inverse temperature and with β = 1: preferences move f by a share of itself, and the
    larger β is, the nearer to 0 can f explain the demonstrations.
    """
    world = GridWorld(7, goal_cell(7, "centre"))
    seeds = [config.seed + s for s in config.seeds]
    betas = (1.0, config.beta_per_cell * world.n)
    lessons = [
        Lesson(world, "border", seed, replace(config.settings, beta_per_cell=beta / world.n))
        for beta, seed in product(betas, seeds)
    ]
    runs = run_all(learn, lessons, over, "preferences")
    rows, policies = [], {}
    for beta, preferred in product(betas, (False, True)):
        preferences = world.preferences() if preferred else StatePreferences()
        group = runs[: len(seeds)] if beta == betas[0] else runs[len(seeds) :]
        learnt = [policy_of(world, run.f, preferences) for run in group]
        rows.append(
            {
                "size": world.n,
                "trajectories": "border",
                "beta": beta,
                "state_preferences": preferred,
                "seeds": seeds,
                "accuracy": [world.accuracy(policy) for policy in learnt],
                "stays_at_limits": [world.stays_at_limits(policy) for policy in learnt],
            }
        )
        name = f"β = {beta:g}, {'with' if preferred else 'without'} state preferences"
        policies[name] = learnt[0]
    with output.figure("preferences.png") as figure:
        plot_preferences(figure, world, "border", policies)
    return rows


def main(config: Config, output: Output) -> dict[str, Any]:
    """Learn every grid with every seed; plot and tabulate."""
    worlds = checked_worlds(config)  # mistakes are reported before any work begins
    with about("hard_size"):
        hard = cases(config.hard_size, config.trajectories, config.wrong) if config.hard else []
    with mapper(config.workers) as over:
        result = solvable(config, worlds, output, over)
        result["preference_rows"] = correction(config, output, over)
        if hard:
            seeds = range(config.seed, config.seed + config.hard_seeds)
            result["hard_rows"], first = hard_rows(
                hard, config.queries, config.state_query, seeds, config.settings, over
            )
            with output.figure("hard.png") as figure:
                plot_hard(figure, result["hard_rows"])
            with output.figure("hard_policies.png") as figure:
                plot_hard_policies(figure, hard, result["hard_rows"], first)
    return result
