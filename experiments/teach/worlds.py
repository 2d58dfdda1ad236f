"""What can be taught: the robot's grasping task, or the grid; in words, and how to judge it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from pathlib import Path

import numpy as np

from experiments.grasping.hidden.costs import costs, factors
from experiments.grasping.teacher import GraspTeacher, TeacherConfig
from experiments.kit.robot_task import load_robot_task
from irl.choices import check_range
from irl.demonstrators import OracleDemonstrator
from irl.domains.gridworld import ACTIONS, GridWorld, goal_cell
from irl.factors import one_hot
from irl.lesson_events import DONE
from irl.mdp import TransitionModel
from irl.metrics import success_mdp
from irl.problem import LearningProblem
from irl.student import Subject
from models.task import words

_FACTORS = (("x", "y", "z"), ("alpha", "beta", "gamma"), ("gripper",))
"""Columns of ``states.csv`` that networks see besides, as in the demo."""
NOTHING = "done: nothing to do here"


@dataclass(frozen=True, eq=False)
class World:
    """Something to teach.

    Attributes:
        name: what it is called.
        subject: what a learner is told.
        goal_states: what an oracle has in mind; only to judge, and to demonstrate for `--initial`.
        oracle: shows how it is done, for trials without a person.
        state_words: says a state.
        action_words: says an action.
        cluster_words: says a cluster.
        example: a goal that somebody may have, in words.
        ways: what left, right, front and back mean there; empty if nobody asks.
    """

    name: str
    subject: Subject
    goal_states: np.ndarray
    oracle: OracleDemonstrator
    state_words: Callable[[int], str]
    action_words: Callable[[int], str]
    cluster_words: Callable[[str], str]
    example: str
    ways: str = ""

    @property
    def model(self) -> TransitionModel:
        """The transition model."""
        return self.subject.problem.model

    @property
    def clusters(self) -> Mapping[str, np.ndarray]:
        """Name → state indices."""
        return self.subject.problem.clusters

    def say_state(self, state: int) -> str:
        """A state in words."""
        return self.state_words(state)

    def say_action(self, action: int) -> str:
        """An action in words, or that there is nothing to do."""
        return NOTHING if action == DONE else self.action_words(action)

    @cached_property
    def reached(self) -> np.ndarray:
        """Which states can be got to from the starts, bool ``[n_states]``."""
        return self.model.reachable(self.subject.problem.start_states)

    def success(self, action: np.ndarray) -> float:
        """Probability that a policy reaches the oracle's goal in time, mean over the starts."""
        return success_mdp(self.model, action, self.goal_states, self.subject.problem.start_states)


def robot_world(folder: Path) -> World:
    """The robot's grasping task.

    Raises:
        InputError: if the folder holds no task data, or those of another task.
    """
    task = load_robot_task(folder)
    problem = replace(
        LearningProblem.of(task),
        features=np.concatenate([task.feature("rotation"), one_hot(task.states, _FACTORS)], axis=1),
        costs=costs(task.model),
        factors=factors(),
    )
    return World(
        task.name,
        Subject(problem, task.task_hash, task.generalisation),
        task.goal_states,
        GraspTeacher(task, TeacherConfig()).oracle,
        words.describe_state,
        words.describe_action,
        words.describe_cluster,
        "the cube at the back with red up",
        "Left, right, front and back are mine: I stand at the back and look at you.",
    )


def grid_world(size: int) -> World:
    """The grid of thesis §6.2, ``size`` × ``size`` cells with the goal in the middle.

    Raises:
        InputError: if the size is even, or below 3.
    """
    check_range("grid", size, 3)
    grid = GridWorld(size, goal_cell(size, "centre"))
    x, y = grid.cells.T
    edges = {"left": x < size // 2, "right": x > size // 2, "below": y < size // 2}
    edges |= {"above": y > size // 2}
    problem = LearningProblem(
        grid.model,
        grid.features,
        gamma=0.95,
        clusters={name: np.flatnonzero(member) for name, member in edges.items()},
        factors={"x": x, "y": y},
    )
    goal = np.array([grid.goal_state])
    return World(
        f"grid of {size} × {size} cells",
        Subject(problem, sha256(f"grid {size}".encode()).hexdigest()),
        goal,
        OracleDemonstrator(grid.model, goal, gamma=0.95),
        lambda state: f"column {x[state] + 1}, row {y[state] + 1}",
        lambda action: ACTIONS[action],
        lambda name: f"the cells {name} of the middle",
        "the cell in the middle",
    )
