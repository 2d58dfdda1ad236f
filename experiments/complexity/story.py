"""How an iteration's time grows with the grid, for every method (thesis Table 6.1).

The grid-worlds of thesis §6.2, the goal in the middle, learnt from staircases out of the four
corners. ``irl.methods`` gives one iteration of each method: an evaluation of the objective, its
gradient, a step. The linear programs have no iterations; of these the whole solve is timed, from
demonstrations to action values, and labelled so.

Planning goes as far as the task asks, and is exact:

- With the discount γ = 0.99 of every discounted method, a reward in the goal is still worth
  0.99⁹⁴ = 39 % in the corners of 9,025 states and 0.99³¹⁶ = 4 % in those of 100,489.
- ``max_ent``, ``deep_max_ent``, ``bellman_gradient``, ``linear_mlirl`` and ``planning`` know V to
  1e-10, ``birl`` to 1e-7; each iteration's search begins at the last one's solution, as it does in
  learning.

Timing is fair: one thread; processor time, which work elsewhere on the machine does not stretch
by waiting; warmed up; methods take turns on each grid, so that a busy spell hits all alike; the
median over all iterations timed. A grid that is done is kept in the output folder until all are,
and the same command goes on after it.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # read when NumPy is first imported

import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from math import isqrt
from pathlib import Path
from time import process_time
from typing import Annotated, Any

import numpy as np
import torch
from tqdm import tqdm

from experiments.complexity.growth import (
    PUBLISHED_STATES,
    SOURCE,
    growth,
    interpretation,
    plot_times,
    published_rows,
)
from experiments.kit.command import Output
from experiments.kit.kept_rows import KeptRows
from experiments.kit.options import about
from irl.baselines.birl import SamplingConfig
from irl.baselines.differentiable_planning import Planner
from irl.choices import Limits, Members, Settings
from irl.demonstrations import Demonstrations
from irl.domains.gridworld import GridWorld
from irl.errors import InputError
from irl.method_inputs import Inputs
from irl.methods import METHODS, learn
from irl.problem import LearningProblem

WARM_UP = 3  # iterations; the first plans for a reward of 0, from V = 0
TURN = 0.1  # seconds a method is timed for at a time, and at least one iteration
TOLERANCE = {  # largest error of V, for methods that search for it
    **dict.fromkeys(
        ("max_ent", "deep_max_ent", "bellman_gradient", "linear_mlirl", "planning"),
        Planner.tolerance,
    ),
    "birl": 1e-6 / SamplingConfig.beta,
}


@dataclass
class Config(Settings):
    """Time one iteration of every method on grids of growing size."""

    states: Annotated[tuple[int, ...], Limits(0, 1_002_001, some=True)] = (
        *PUBLISHED_STATES,
        10_201,
        40_401,
        100_489,
    )
    """The sizes of the grids in states, each the square of a side of 3 or more."""
    methods: Annotated[tuple[str, ...], Members(tuple(METHODS))] = tuple(METHODS)
    """Which methods are timed."""
    gamma: Annotated[float, Limits(0, 0.9999)] = 0.99
    """The discount factor of all methods that have one."""
    rounds: Annotated[int, Limits(1, 1_000_000)] = 7
    """How many turns each method has on each grid."""
    budget: Annotated[float, Limits(0, 1e6, open_low=True)] = 3.0
    """For how many seconds a method is timed on a grid, before its last iteration.
    One that needs more for a single iteration is skipped on larger grids."""
    seed: int = 0
    """The seed of initial weights and proposals."""
    out: Path = field(default_factory=lambda: Path("out/complexity"))
    """The folder that the results are written to."""


def grid(states: int) -> GridWorld:
    """The grid of so many cells, its goal in the middle.

    Raises:
        InputError: if that is not a square, or too few; names the nearest squares.
    """
    side = isqrt(max(states, 0))
    if side**2 != states:
        raise InputError(f"{states} is not a square; the next are {side**2}, {(side + 1) ** 2}")
    return GridWorld(side, (side // 2, side // 2))


def prepare(name: str, world: GridWorld, config: Config) -> Callable[[], object]:
    """One warmed-up iteration of a method, or where it has none its whole solve."""
    shown = Demonstrations.from_trajectories(world.trajectories("diagonal"))
    method, rng = METHODS[name], np.random.default_rng(config.seed)
    problem = LearningProblem(world.model, world.features, gamma=config.gamma)
    if method.iterate is None:
        return lambda: learn(name, problem, shown, rng=rng)
    iteration = method.step(Inputs(problem, shown, rng))
    for _ in range(WARM_UP):
        iteration()
    return iteration


def take_turns(
    works: Mapping[str, Callable[[], object]], config: Config, bar: tqdm
) -> dict[str, list[float]]:
    """Processor times of all calls [s], by name."""
    times: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(config.rounds):
        for name, work in works.items():
            bar.set_postfix_str(name)
            if sum(times[name]) < config.budget:
                turn = 0.0
                while turn < TURN:
                    began = process_time()
                    work()
                    times[name].append(process_time() - began)
                    turn += times[name][-1]
            bar.update()
    return times


def measure(world: GridWorld, names: Sequence[str], config: Config, bar: tqdm) -> dict[str, Any]:
    """What ``result.json`` says of one grid."""
    lengths = [len(walk) for walk in world.trajectories("diagonal")]
    works = {name: prepare(name, world, config) for name in names}
    times = take_turns(works, config, bar)
    seconds = {name: float(np.median(own)) for name, own in times.items()}
    ours = seconds.get("fa_mlirl")
    return {
        "states": world.n_states,
        "demonstrated_pairs": sum(lengths),
        "horizon": max(lengths),
        "seconds": seconds,
        "quartiles": {name: np.quantile(own, [0.25, 0.75]).tolist() for name, own in times.items()},
        "timed": {name: len(own) for name, own in times.items()},
        "times_fa_mlirl": {} if ours is None else {n: s / ours for n, s in seconds.items()},
    }


def over_budget(rows: Sequence[Mapping[str, Any]], budget: float) -> dict[str, str]:
    """Methods to be skipped after these grids, and why."""
    return {
        name: f"took {seconds:.3g} s on {row['states']:,} states"
        for row in rows
        for name, seconds in row["seconds"].items()
        if seconds > budget
    }


def setting() -> dict[str, Any]:
    """What the times depend on besides the code."""
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.exists() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return {
        "processor": (models or [platform.processor() or platform.machine()])[0],
        "cores": os.cpu_count(),
        "threads": torch.get_num_threads(),
        "clock": "processor time of the process",
        "python": platform.python_version(),
        "packages": {name: version(name) for name in ("numpy", "scipy", "torch")},
    }


def main(config: Config, output: Output) -> dict[str, Any]:
    """Time every method on every grid, smallest first; fit and plot the growth."""
    with about("states"):
        worlds = [grid(states) for states in sorted(set(config.states))]
    torch.set_num_threads(1)
    kept = KeptRows(output, {n: value for n, value in asdict(config).items() if n != "out"})
    rows = kept.rows
    per_grid = len(config.methods) * config.rounds
    total = len(worlds) * per_grid
    with tqdm(total=total, initial=len(rows) * per_grid, unit="turn", desc="complexity") as bar:
        for world in worlds[len(rows) :]:
            bar.set_description(f"{world.n_states:,} states")
            skipped = over_budget(rows, config.budget)
            names = [name for name in config.methods if name not in skipped]
            kept.add(measure(world, names, config, bar) | {"skipped": skipped})
            bar.update(len(rows) * per_grid - bar.n)
    with output.figure("complexity.png") as figure:
        plot_times(figure, rows)
    print(interpretation(rows))
    kept.forget()
    published = published_rows()
    return {
        "rows": rows,
        "unit": {name: "iteration" if METHODS[name].iterate else "solve" for name in METHODS},
        "tolerance": TOLERANCE,
        "growth": growth(rows),
        "published": {"source": SOURCE, "rows": published, "growth": growth(published)},
        "setting": setting(),
    }
