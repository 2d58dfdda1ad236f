"""Gymnasium's small worlds, learned by every method and played in gymnasium itself.

FrozenLake, CliffWalking and Taxi are read from their transition tables. An oracle that knows the
true reward shows some runs, each method learns from them, and its policy is played in the
environment; the return is what counts. Needs the extra ``gym``.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import torch
from tqdm import tqdm

from experiments.kit.command import Output, execute
from experiments.kit.method_plots import Panel, plot_methods
from irl.choices import Limits, Members, Settings
from irl.collection import demonstrate
from irl.demonstrations import Demonstrations
from irl.demonstrators import PolicyDemonstrator
from irl.errors import InputError
from irl.gymnasium_interop import TabularWorld, from_gymnasium, play
from irl.methods import METHODS, learn
from irl.metrics import bootstrap_interval
from irl.planning import value_iteration
from irl.policy import Policy

if TYPE_CHECKING:
    import gymnasium
    from matplotlib.figure import Figure

GAMMA = 0.99
MAX_STEPS = 200  # Taxi's own limit; CliffWalking has none


@dataclass(frozen=True)
class Example:
    """One environment, and how it is shown.

    Attributes:
        sizes: of the factors that the state index is made of, the slowest first; each becomes one
            indicator per value.
        demonstrations: number of demonstrated runs.
        steps: length of each. A run that has ended stays where it is, and so is as long as others.
        goal_states: where a run ends well, from the environment.
    """

    sizes: tuple[int, ...]
    demonstrations: int
    steps: int
    goal_states: Callable[[Any, TabularWorld], np.ndarray]


EXAMPLES = {
    # Slippery ice: where a run leads is chance.
    "FrozenLake-v1": Example(
        (16,), 20, 100, lambda env, _: np.flatnonzero(env.unwrapped.desc == b"G")
    ),
    "CliffWalking-v1": Example((4, 12), 5, 15, lambda _, world: world.terminal),
    # Row, column, passenger, destination.
    "Taxi-v4": Example((5, 5, 5, 4), 300, 20, lambda _, world: world.terminal),
}


@dataclass(frozen=True)
class Config(Settings):
    """Learn gymnasium's toy-text worlds from demonstrations, with every method."""

    seed: int = 0
    """The seed of the demonstrations, the methods and the environments."""
    environments: Annotated[tuple[str, ...], Members(tuple(EXAMPLES))] = tuple(EXAMPLES)
    """Which of the worlds are learnt."""
    methods: Annotated[tuple[str, ...], Members(tuple(METHODS))] = tuple(METHODS)
    """Which methods learn them."""
    episodes: Annotated[int, Limits(1, 1_000_000)] = 300
    """How many episodes each policy is played."""
    out: Path = field(default_factory=lambda: Path("out/toy_text"))
    """The folder that the results are written to."""


def optimal_runs(
    world: TabularWorld, Q: np.ndarray, example: Example, rng: np.random.Generator
) -> Demonstrations:
    """Runs that act by the true action values, equal ones drawn evenly."""
    optimal = Q.max(axis=1, keepdims=True) - 1e-7 <= Q
    starts = (rng.choice(world.start.size, p=world.start) for _ in range(example.demonstrations))
    return demonstrate(PolicyDemonstrator(world.model, optimal), starts, rng, example.steps)


def indicators(sizes: tuple[int, ...]) -> np.ndarray:
    """One indicator per value of each factor of the state index; ``[Π sizes, Σ sizes]``."""
    factors = np.unravel_index(np.arange(np.prod(sizes)), sizes)
    return np.hstack([np.eye(n)[factor] for n, factor in zip(sizes, factors, strict=True)])


def judged(
    env: "gymnasium.Env", q: np.ndarray, mask: np.ndarray, goals: np.ndarray, config: Config
) -> dict[str, Any]:
    """Play greedily by ``q``: what ``result.json`` says of the episodes."""
    action = Policy.from_q(q, mask).action
    episodes = play(env, action, seed=config.seed, episodes=config.episodes, max_steps=MAX_STEPS)
    success = episodes.success(goals)
    rng = np.random.default_rng(config.seed)
    return {
        "return": episodes.returns.mean(),
        "return_interval": bootstrap_interval(episodes.returns, rng),
        "length": episodes.lengths.mean(),
        "success": success.value,
        "success_interval": success.interval,
    }


def show(rows: list[dict[str, Any]]) -> None:
    """Print the table."""
    print(f"{'environment':16} {'method':18} {'return':>9} {'optimal':>9} {'success':>8} {'s':>7}")
    for row in rows:
        name = f"{row['environment']:16} {row['method']:18}"
        if row["return"] is None:
            print(f"{name} {row['note']}")
            continue
        print(
            f"{name} {row['return']:9.2f} {row['optimal']:9.2f} {row['success']:8.1%} "
            f"{row['seconds']:7.2f}"
        )


def interpretation(rows: list[dict[str, Any]]) -> str:
    """What the table says, in one sentence."""
    told = []
    for world in dict.fromkeys(row["environment"] for row in rows):
        mine = [row for row in rows if row["environment"] == world]
        reached = sum(
            row["return"] is not None and row["return_interval"][1] >= row["optimal"]
            for row in mine
        )
        told.append(f"{reached} of {len(mine)} in {world}")
    return (
        "Methods as good as the true reward's own policy, by the 95 % interval of the return: "
        f"{', '.join(told)}."
    )


def draw(figure: "Figure", rows: list[dict[str, Any]], config: Config) -> None:
    """Draw every method's return in every world, beside that of the true reward's policy."""
    of = {(row["environment"], row["method"]): row for row in rows}
    worlds, methods = config.environments, config.methods
    panels = [
        Panel(
            world,
            "return of an episode, mean",
            [of[world, method]["return"] for method in methods],
            of[world, methods[0]]["optimal"],
            [of[world, method]["return_interval"] or (np.nan, np.nan) for method in methods],
        )
        for world in worlds
    ]
    seconds = [sum(of[world, method]["seconds"] for world in worlds) for method in methods]
    plot_methods(figure, methods, panels, seconds, interpretation(rows))


def main(config: Config, output: Output) -> dict[str, Any]:
    """Learn and play; ``optimal`` is what the true reward's own policy earned in like episodes."""
    try:
        import gymnasium  # noqa: PLC0415 - an optional extra
    except ImportError as error:
        raise InputError("toy_text: needs gymnasium; pip install '.[gym]'") from error
    for name in config.environments:
        if name not in gymnasium.registry:
            raise InputError(
                f"gymnasium {gymnasium.__version__} has no {name}; "
                "pip install '.[gym]' brings one that has",
                place="--environments",
            )
    torch.set_num_threads(1)  # the networks are small
    rows = []
    bar = tqdm(total=len(config.environments) * len(config.methods), leave=False)
    for environment in config.environments:
        env, example = gymnasium.make(environment), EXAMPLES[environment]
        world = from_gymnasium(env)
        goals = example.goal_states(env, world)
        _, Q = value_iteration(
            world.model, np.zeros(world.model.n_states), GAMMA, pair_reward=world.pair_reward
        )
        best = judged(env, Q, world.model.mask, goals, config)
        shown = optimal_runs(world, Q, example, np.random.default_rng(config.seed))
        for method in config.methods:
            bar.set_description(f"{environment} {method}")
            learnt = learn(
                method,
                world.model,
                shown,
                indicators(example.sizes),
                gamma=GAMMA,
                rng=np.random.default_rng(config.seed),
            )
            rows.append(
                {
                    "environment": environment,
                    "method": method,
                    # With no preference any policy would do, and so none says anything.
                    **(
                        dict.fromkeys(best)
                        if learnt.no_preference
                        else judged(env, learnt.q, world.model.mask, goals, config)
                    ),
                    "optimal": best["return"],
                    "seconds": learnt.seconds,
                    "note": learnt.note,
                }
            )
            bar.update()
        env.close()
    bar.close()
    show(rows)
    print(interpretation(rows))
    with output.figure("methods.png") as figure:
        draw(figure, rows, config)
    return {"rows": rows}


if __name__ == "__main__":
    execute(Config, main)
