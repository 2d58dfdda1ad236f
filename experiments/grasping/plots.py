"""Pictures of learning and of the learnt policy."""

from collections.abc import Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure

from experiments.grasping.assessment import Assessment
from experiments.grasping.learning import CurvePoint, Learnt
from irl.active_state import QueryRecord
from irl.clusters import AND
from irl.demonstrators import OracleDemonstrator
from irl.policy import Policy
from irl.task_data import TaskData
from models.task import words
from models.task.spaces import N_FREE, N_ORIENTATIONS, N_XY, N_YAWS

SUCCESS, ACCURACY = "#2166ac", "#b35806"
# Nothing red, which would look like a warning; neighbours differ in hue or lightness.
COLOURS = np.delete(colormaps["tab20"](np.arange(20))[:, :3], (6, 7), axis=0)


STATES = "what to do in a state"
"""The row of answers about states."""


def plot_learning(figure: Figure, learnt: Learnt, assessment: Assessment) -> None:
    """Draw success and accuracy against answers, and what each answer was about.

    Above, one point a training, with the states demonstrated by then; below, one row for states
    and one a cluster, marked at the number of the answer.
    """
    history = learnt.result.history
    about = [STATES] * bool(history) + list(dict.fromkeys(r.cluster for r in history if r.cluster))
    figure.set_size_inches(9, 4.6 + 0.2 * len(about))
    heights = [3.6, 0.2 * len(about) + 0.2] if about else [1.0]
    rows = figure.subplots(len(heights), sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    _draw_curve(rows[0], learnt.curve, assessment)
    if about:
        _draw_answers(rows[1], history, about)
    rows[-1].set_xlabel("answers")


def _draw_curve(axis: Axes, curve: Sequence[CurvePoint], assessment: Assessment) -> None:
    answers = [point.query for point in curve]
    success = [point.success for point in curve]
    accuracy = [point.accuracy_optimal_all for point in curve]
    axis.axhline(
        assessment.success_mdp_oracle, linestyle="--", color="#777777",
        label="success of the demonstrator",
    )  # fmt: skip
    axis.plot(answers, success, "o-", markersize=4, color=SUCCESS, label="success")
    axis.plot(answers, accuracy, "s-", markersize=4, color=ACCURACY, label="accuracy")
    low = min(*success, *accuracy)
    axis.set(ylabel="share", ylim=(max(0.0, low - 0.1), 1.02))
    axis.set_title(
        "Success: the goal reached within 20 actions, from every free state.\n"
        "Accuracy: an action as good as the demonstrator's, in states never shown.",
        fontsize=10,
    )
    axis.grid(alpha=0.3)
    axis.legend(loc="lower right", frameon=False)
    shown = curve[:: -(-len(curve) // 8) or 1]
    above = axis.secondary_xaxis("top")
    above.set_xticks([point.query for point in shown], [str(p.demonstrated) for p in shown])
    above.set_xlabel("states demonstrated by then", fontsize=9)
    above.tick_params(labelsize=8)


def _draw_answers(axis: Axes, history: Sequence[QueryRecord], about: Sequence[str]) -> None:
    for number, record in enumerate(history, 1):
        axis.plot(number, 0, "o", color="k", ms=3)
        if record.cluster:
            axis.plot(number, about.index(record.cluster), "D", color="k", ms=4)
    axis.set_yticks(range(len(about)), [_words_of(name) for name in about])
    axis.tick_params(axis="y", labelsize=8)
    axis.set_ylim(len(about) - 0.5, -0.5)
    axis.grid(alpha=0.3)
    axis.set_title(
        "what the answers were about: a state, and a cluster of states", loc="left", fontsize=9
    )


def _words_of(cluster: str) -> str:
    """A cluster, or an intersection of clusters; others than the robot's keep their names."""
    parts = cluster.split(AND)
    return ", and ".join(
        words.describe_cluster(part) if part in words.CLUSTERS else part for part in parts
    )


def plot_policy(figure: Figure, task: TaskData, policy: Policy, oracle: OracleDemonstrator) -> None:
    """Draw the grasp chosen for every free cube, and where the demonstrator would do better."""
    action = policy.action[:N_FREE].reshape(N_XY, N_ORIENTATIONS)
    optimal = oracle.optimal_actions[:N_FREE]
    right = optimal[np.arange(N_FREE), policy.action[:N_FREE]].reshape(action.shape)
    goal = np.isin(np.arange(N_FREE), task.goal_states).reshape(action.shape)
    used = np.unique(action[~goal])
    figure.set_size_inches(15, 5.4)
    axis = figure.subplots()
    palette = ListedColormap([COLOURS[g % len(COLOURS)] for g in used])
    shown = np.ma.masked_array(np.searchsorted(used, action), goal)
    norm = BoundaryNorm(np.arange(used.size + 1) - 0.5, used.size)
    image = axis.imshow(shown, cmap=palette, norm=norm, aspect="auto")
    wrong = np.argwhere(~right & ~goal)
    axis.plot(*wrong.T[::-1], "kX", ms=7, mec="w", ls="", label="the demonstrator would do better")
    axis.plot(*np.argwhere(goal).T[::-1], "k*", ms=11, ls="", label="goal: nothing to grasp")
    _name_cubes(axis)
    axis.set_title(
        f"Grasp chosen for a free cube: as good as the demonstrator's in {right[~goal].mean():.0%} "
        f"of {right[~goal].size} states",
        pad=24,
    )
    figure.legend(loc="outside lower right", ncols=2, frameon=False)
    bar = figure.colorbar(image, ticks=range(used.size), pad=0.01)
    bar.ax.set_yticklabels([words.describe_action(g).partition(": ")[2] for g in used], fontsize=8)
    bar.ax.tick_params(length=0)


def _name_cubes(axis: Axes) -> None:
    """Say where the cube lies, and how it is turned: a column each, grouped by the face up."""
    turned = [words.describe_orientation(k).partition(", ") for k in range(N_ORIENTATIONS)]
    axis.set_xticks(range(N_ORIENTATIONS), [to for _, _, to in turned], rotation=90, fontsize=7)
    for first in range(0, N_ORIENTATIONS, N_YAWS):
        axis.axvline(first - 0.5, color="k", lw=1)
        axis.text(first + (N_YAWS - 1) / 2, -0.65, turned[first][0], ha="center", va="bottom")
    columns = [words.describe_position(2 * k).partition(", ")[0] for k in range(N_XY)]
    axis.set_yticks(range(N_XY), columns)
    axis.set(xlabel="a face of the cube, and where it looks to", ylabel="place on the table")
