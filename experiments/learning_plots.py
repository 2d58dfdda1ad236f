"""Pictures of learning and of the learnt policy."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from experiments.grasp_learning import Assessment, Learnt, Teacher
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


def plot_learning(learnt: Learnt, assessment: Assessment, path: Path) -> None:
    """Draw success in the model against demonstrated states, one point a training."""
    demonstrated, success = np.array(learnt.curve).T
    figure, axis = plt.subplots(figsize=(7, 4.2), layout="constrained")
    axis.plot(demonstrated, success, "o-", markersize=4, color="#2166ac", label="learner")
    ceiling = assessment.success_mdp_oracle
    axis.axhline(ceiling, linestyle="--", color="#555555", label="demonstrator")
    for record, x, y in zip(learnt.result.history, demonstrated[1:], success[1:], strict=False):
        if record.cluster:
            axis.annotate(
                record.cluster,
                (x, y),
                fontsize=6,
                rotation=60,
                xytext=(0, -34),
                textcoords="offset points",
                ha="center",
                color="#777777",
            )
    axis.set(
        xlabel="states demonstrated",
        ylabel="probability of the goal within 20 actions",
        ylim=(0, 1.03),
        title="Active learning; labels name the clusters advised",
    )
    axis.legend(loc="lower right", frameon=False)
    figure.savefig(path, dpi=120)
    plt.close(figure)


def plot_policy(task: TaskData, policy: Policy, teacher: Teacher, path: Path) -> None:
    """Draw the grasp chosen for every free cube; a red frame where it is not optimal."""
    action = policy.action[:N_FREE].reshape(N_XY, N_ORIENTATIONS)
    optimal = teacher.demonstrator.optimal_actions[:N_FREE]
    right = optimal[np.arange(N_FREE), policy.action[:N_FREE]].reshape(action.shape)
    goal = np.isin(np.arange(N_FREE), task.goal_states).reshape(action.shape)
    figure, axis = plt.subplots(figsize=(14, 4.4), layout="constrained")
    image = axis.imshow(action, cmap="tab20", vmin=0, vmax=19, aspect="auto")
    for row, column in np.argwhere(~right & ~goal):
        axis.add_patch(
            plt.Rectangle((column - 0.5, row - 0.5), 1, 1, fill=False, edgecolor="red", lw=1.4)
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
    figure.savefig(path, dpi=120)
    plt.close(figure)
