"""The simulated teacher of the grasping task: what it wants, hidden from the learner."""

from dataclasses import dataclass

import numpy as np

from irl.demonstrators import OracleDemonstrator, OracleExpert
from irl.task_data import TaskData
from models.task.clusters import uncomfortable_states
from models.task.spaces import LOST


@dataclass(frozen=True)
class TeacherConfig:
    """The hidden reward of the simulated demonstrator, in units of the goal's."""

    action_cost: float = 0.01
    """Of each action."""
    discomfort: float = 0.05
    """Of entering a pose that §5.10.1 calls less comfortable."""
    surprise: float = 0.5
    """Of an action, times the probability that its likeliest outcome does not come. A turn that
    leaves the cube halfway between two orientations is a toss-up, and what follows from there
    is not what the state's name says: a person would not demonstrate it."""
    tolerance: float = 0.005
    """Difference of value below which two actions are equally good: half an action's cost."""
    label_noise: float = 0.0
    """Probability of a wrong label."""


class Teacher:
    """Demonstrator and expert of one mind: an optimal policy under a hidden reward."""

    def __init__(self, task: TaskData, config: TeacherConfig) -> None:
        """Plan with the task's own transition model."""
        self.demonstrator = OracleDemonstrator(
            task.model,
            task.goal_states,
            gamma=task.gamma,
            uncomfortable=uncomfortable_states(),
            lost_states=np.array([LOST]),
            action_cost=config.action_cost,
            discomfort=config.discomfort,
            surprise=config.surprise,
            tolerance=config.tolerance,
            label_noise=config.label_noise,
        )
        self.expert = OracleExpert(self.demonstrator, task.start_states)
