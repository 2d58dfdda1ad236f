"""Pictures of the grid-world experiment, to lay beside thesis Figures 6.3–6.6 and Table 6.2."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from experiments.gridworld.hard import Case, Judged
from experiments.gridworld.learning import Run
from irl.domains.gridworld import ACTIONS, MOVES, GridWorld

COLOURS = ("tab:orange", "gold", "tab:green", "tab:blue")  # right, up, left, down: Figure 6.5
ARROWS_UP_TO = 35  # cells a side; beyond, arrows would be specks
PROBLEM = {
    "not demonstrated": "khaki",
    "avoided": "lightskyblue",
    "demonstrated": "lightgrey",
    "goal": "limegreen",
}
WALL = "dimgrey"


def _draw_cells(axes: Axes, world: GridWorld, colour: np.ndarray, palette: list[str]) -> None:
    """Fill each cell with its entry of ``palette``, blocked ones grey; a star marks the goal."""
    n = world.n
    colour = colour.copy()
    colour[world.blocked_states] = len(palette)
    palette = [*palette, WALL]
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


def _draw_arrows(
    axes: Axes, world: GridWorld, state: np.ndarray, action: np.ndarray, colour: str = "black"
) -> None:
    """An arrow for each pair but the goal's, on grids where it can be seen."""
    if world.n <= ARROWS_UP_TO:
        state, action = state[state != world.goal_state], action[state != world.goal_state]
        axes.quiver(
            *world.cells[state].T, *MOVES[action].T, color=colour, pivot="mid", angles="xy",
            scale_units="xy", scale=1.6, units="xy", width=0.08, headlength=3, headaxislength=3,
        )  # fmt: skip


def _legend(figure: Figure, colours: dict[str, str]) -> None:
    patches = [Patch(color=colour, label=name) for name, colour in colours.items()]
    figure.legend(handles=patches, loc="outside lower center", ncols=len(patches))


def draw_problem(
    axes: Axes, world: GridWorld, state: np.ndarray, action: np.ndarray, preferences: bool
) -> None:
    """What the learner is given: demonstrations as red arrows, and the cells to be avoided."""
    colour = np.zeros(world.n_states, dtype=int)
    if preferences:
        colour[world.preferences().avoided] = 1
    colour[state] = 2
    if preferences:
        colour[np.intersect1d(state, world.preferences().avoided)] = 1
    colour[world.goal_state] = 3
    _draw_cells(axes, world, colour, list(PROBLEM.values()))
    _draw_arrows(axes, world, state, action, "red")


def draw_policy(axes: Axes, world: GridWorld, policy: np.ndarray, demonstrated: np.ndarray) -> None:
    """What was learnt: a colour for each action, demonstrated cells grey."""
    colour = policy.astype(int)
    colour[demonstrated] = 4
    colour[world.goal_state] = 5
    _draw_cells(axes, world, colour, [*COLOURS, "lightgrey", "white"])
    acting = np.flatnonzero(world.distance > 0)
    _draw_arrows(axes, world, acting, policy[acting])


POLICY_LEGEND = dict(zip((*ACTIONS, "demonstrated"), (*COLOURS, "lightgrey"), strict=True))


def plot_policy(
    figure: Figure, world: GridWorld, trajectories: str, run: Run, preferences: bool
) -> None:
    """The problem and one learnt policy, side by side."""
    state, action = world.demonstrations(trajectories)
    figure.set_size_inches(11, 6.2)
    left, right = figure.subplots(1, 2)
    draw_problem(left, world, state, action, preferences)
    draw_policy(right, world, run.policy, state)
    left.set_title(f"{trajectories} demonstrations (cf. thesis Figure 6.3)")
    right.set_title(f"policy, accuracy {run.accuracy[-1]:.2%} (cf. thesis Figures 6.4, 6.5)")
    shown = {} if not preferences else {"avoided": PROBLEM["avoided"]}
    _legend(figure, {"not demonstrated": "khaki", **shown, **POLICY_LEGEND})


def plot_preferences(
    figure: Figure, world: GridWorld, trajectories: str, policies: dict[str, np.ndarray]
) -> None:
    """Figure 6.4: policies from demonstrations along the limits, with the limits avoided or not.

    Args:
        figure: to draw on.
        world: the grid.
        trajectories: which demonstrations.
        policies: title → policy ``[n_states]``, four of them.
    """
    state, action = world.demonstrations(trajectories)
    shown = np.unique(state)
    others = np.setdiff1d(np.arange(world.n_states), shown)
    figure.set_size_inches(13.5, 10.6)
    grid = figure.subplot_mosaic(
        [["demonstrations", *list(policies)[:2]], ["demonstrations", *list(policies)[2:]]]
    )
    draw_problem(grid["demonstrations"], world, state, action, preferences=True)
    grid["demonstrations"].set_title("demonstrations, limits to avoid\n(cf. thesis Figure 6.3)")
    for name, policy in policies.items():
        colour = np.where(world.limits, 1, 0)
        colour[world.goal_state] = 3
        _draw_cells(grid[name], world, colour, list(PROBLEM.values()))
        _draw_arrows(grid[name], world, others, policy[others])
        _draw_arrows(grid[name], world, shown, policy[shown], "red")
        stays, accuracy = world.stays_at_limits(policy), world.accuracy(policy)
        grid[name].set_title(
            f"{name} (cf. thesis Figure 6.4)\naccuracy {accuracy:.0%}; at {stays:.0%} of the "
            "limits, no move inwards",
            fontsize=10,
        )
    _legend(figure, {**PROBLEM, "arrow in a demonstrated cell": "red"})


def plot_curves(figure: Figure, curves: dict[str, list[Run]]) -> None:
    """Figure 6.6: accuracy along the iterations, mean and range over the seeds."""
    figure.set_size_inches(7, 4.7)
    axes = figure.subplots()
    for label, runs in curves.items():
        accuracy = np.array([run.accuracy for run in runs])
        (line,) = axes.plot(runs[0].iteration, accuracy.mean(axis=0), label=label)
        axes.fill_between(
            runs[0].iteration, accuracy.min(axis=0), accuracy.max(axis=0),
            color=line.get_color(), alpha=0.2, linewidth=0,
        )  # fmt: skip
    axes.set_xscale("symlog", linthresh=1)
    axes.set_xticks([0, 1, 10, 100, 1000], ["0", "1", "10", "100", "1000"])
    axes.set(
        title="accuracy during training (cf. thesis Figure 6.6)",
        xlabel="iteration",
        ylabel="cells that reach the goal (share)",
        ylim=(0, 1.02),
        xlim=(0, None),
    )
    axes.grid(alpha=0.3)
    seeds = len(next(iter(curves.values())))
    axes.legend(title=f"mean and range, seeds: {seeds}", loc="lower right")


def plot_times(figure: Figure, rows: list[dict[str, Any]], published: dict[int, float]) -> None:
    """Table 6.2: time an iteration against the number of states, ours and the thesis' own."""
    figure.set_size_inches(6.5, 4.5)
    axes = figure.subplots()
    axes.plot(
        [n**2 for n in published], [1e3 * s for s in published.values()], "s--",
        color="grey", label="thesis Table 6.2 (published; other hardware)",
    )  # fmt: skip
    rows = sorted(rows, key=lambda row: row["states"])
    axes.plot(
        [row["states"] for row in rows], [1e3 * row["seconds_per_iteration"] for row in rows],
        "o-", color="tab:blue", label="this run (time of the processor)",
    )  # fmt: skip
    axes.set(
        title="training time (cf. thesis Table 6.2)",
        xlabel="states",
        ylabel="time per iteration [ms]",
        xscale="log",
        yscale="log",
    )
    axes.grid(alpha=0.3)
    axes.legend()


def _help(row: dict[str, Any]) -> str:
    """What a hard case was learnt with, in words."""
    queries = [f"{row['queries']} queries"] * (row["queries"] > 0)
    preferences = ["state preferences"] * row["state_preferences"]
    return " + ".join(queries + preferences) or "demonstrations alone"


def plot_hard(figure: Figure, rows: list[dict[str, Any]]) -> None:
    """Accuracy of each hard case, with its interval, for each kind of help."""
    cases = list(dict.fromkeys(row["case"] for row in rows))
    helps = list(dict.fromkeys(map(_help, rows)))
    figure.set_size_inches(9, 1.2 + 0.75 * len(cases))
    axes = figure.subplots()
    for k, name in enumerate(helps):
        shown = [row for row in rows if _help(row) == name]
        y = np.arange(len(shown)) + (k - (len(helps) - 1) / 2) * 0.17
        mean = np.array([np.mean(row["accuracy"]) for row in shown])
        low, high = np.array([row["interval"] for row in shown]).T
        axes.errorbar(
            mean, y, xerr=np.maximum(0, [mean - low, high - mean]), fmt="os^D"[k % 4],
            markersize=5, capsize=2, label=name,
        )  # fmt: skip
        for at, row in zip(y, shown, strict=True):
            axes.plot(row["accuracy"], [at] * len(row["accuracy"]), "|", color="grey", alpha=0.5)
    axes.set_yticks(range(len(cases)), cases)
    axes.set(
        title=f"hard cases, {rows[0]['size']} × {rows[0]['size']} cells",
        xlabel="cells that reach the goal (share)",
        xlim=(-0.02, 1.02),
    )
    axes.invert_yaxis()
    axes.grid(alpha=0.3, axis="x")
    figure.legend(
        title=f"mean and 95 % bootstrap interval, {len(rows[0]['accuracy'])} seeds (ticks)",
        loc="outside lower center",
        ncols=2,
    )


def plot_hard_policies(
    figure: Figure, hard: list[Case], rows: list[dict[str, Any]], runs: list[Judged]
) -> None:
    """One policy for each hard case and kind of help; cells that miss the goal are crossed."""
    helps = list(dict.fromkeys(map(_help, rows)))
    figure.set_size_inches(2.6 * len(hard), 2.9 * len(helps) + 0.5)
    grid = figure.subplots(len(helps), len(hard), squeeze=False)
    learnt = zip(grid.T.flat, rows, runs, strict=True)
    for number, (axes, row, run) in enumerate(learnt):
        world = hard[number // len(helps)].world
        colour = run.policy.astype(int)
        colour[run.labelled] = 4
        colour[world.goal_state] = 5
        _draw_cells(axes, world, colour, [*COLOURS, "lightgrey", "white"])
        axes.grid(visible=False)
        missed = (world.distance > 0) & (world.moves_to_goal(run.policy) < 0)
        axes.plot(*world.cells[missed].T, "x", color="black", markersize=2.5, markeredgewidth=0.6)
        axes.set_title(f"{row['case']}: {run.accuracy:.0%}", fontsize=9)
        axes.set(xlabel="", ylabel=_help(row) if number < len(helps) else "")
    _legend(figure, {**POLICY_LEGEND, "blocked": WALL})
    figure.suptitle("policies of the first seed; × marks cells that miss the goal")
