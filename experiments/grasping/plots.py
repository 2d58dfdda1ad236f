"""Pictures of learning and of the learnt policy."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from experiments.grasping.assessment import Assessment
from experiments.grasping.learning import Learnt
from irl.demonstrators import OracleDemonstrator
from irl.policy import Policy
from irl.task_data import TaskData
from models.task.spaces import (
    GRIPPER_NAMES,
    N_FREE,
    N_ORIENTATIONS,
    N_XY,
    ORIENTATION_ANGLES,
    POSITIONS,
)


def plot_learning(figure: Figure, learnt: Learnt, assessment: Assessment) -> None:
    """Draw success and accuracy against demonstrated states, one point a training."""
    demonstrated = [point.demonstrated for point in learnt.curve]
    success = [point.success for point in learnt.curve]
    accuracy = [point.accuracy_optimal_all for point in learnt.curve]
    figure.set_size_inches(7, 4.2)
    axis = figure.subplots()
    axis.axhline(
        assessment.success_mdp_oracle,
        linestyle="--",
        color="#777777",
        label="success of the demonstrator",
    )
    axis.plot(demonstrated, success, "o-", markersize=4, color="#2166ac", label="success")
    axis.plot(
        demonstrated,
        accuracy,
        "s-",
        markersize=4,
        color="#b2182b",
        label="accuracy on unseen states",
    )
    low = min(*success, *accuracy)
    axis.set(
        xlabel="states demonstrated",
        ylabel="share",
        ylim=(max(0.0, low - 0.1), 1.02),
        title="Success from every free state within 20 actions, and accuracy",
    )
    axis.legend(loc="lower right", frameon=False)


def plot_policy(figure: Figure, task: TaskData, policy: Policy, oracle: OracleDemonstrator) -> None:
    """Draw the grasp chosen for every free cube; a red frame where it is not optimal."""
    action = policy.action[:N_FREE].reshape(N_XY, N_ORIENTATIONS)
    optimal = oracle.optimal_actions[:N_FREE]
    right = optimal[np.arange(N_FREE), policy.action[:N_FREE]].reshape(action.shape)
    goal = np.isin(np.arange(N_FREE), task.goal_states).reshape(action.shape)
    figure.set_size_inches(14, 4.4)
    axis = figure.subplots()
    image = axis.imshow(action, cmap="tab20", vmin=0, vmax=19, aspect="auto")
    for row, column in np.argwhere(~right & ~goal):
        axis.add_patch(
            Rectangle((column - 0.5, row - 0.5), 1, 1, fill=False, edgecolor="red", lw=1.4)
        )
    for row, column in np.argwhere(goal):
        axis.text(column, row, "★", ha="center", va="center", fontsize=12)
    labels = ["{:g},{:g},{:g}".format(*angles) for angles in ORIENTATION_ANGLES]
    axis.set(
        yticks=range(N_XY),
        yticklabels=[f"({x:g}, {y:g})" for x, y, _ in POSITIONS[::2]],
        xticks=range(N_ORIENTATIONS),
        xlabel="cube's orientation α, β, γ [degrees]",
        ylabel="column x, y [m]",
        title="Grasp chosen for a free cube (★ goal, red: the demonstrator would do better)",
    )
    axis.set_xticklabels(labels, rotation=90, fontsize=6)
    used = np.unique(action[~goal])
    bar = figure.colorbar(image, ticks=used)
    bar.ax.set_yticklabels([f"{g} {GRIPPER_NAMES[g]}" for g in used], fontsize=7)
