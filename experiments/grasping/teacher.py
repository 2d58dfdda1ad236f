"""Who teaches the grasping task: a simulated mind, whose wish stays hidden, or a recording."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from experiments.grasping.hidden.costs import costs
from experiments.grasping.hidden.drawn import habitual
from irl.choices import Limits, Settings
from irl.collection import by_trusted_rules, recorded_runs, runs_from
from irl.demonstrations import Demonstrations
from irl.demonstrators import OracleDemonstrator, RecordedDemonstrator
from irl.errors import InputError
from irl.experts import OracleExpert
from irl.problem import LearningProblem
from irl.rule_trust import Trust
from irl.task_data import TaskData
from irl.teacher import Teacher
from models.task.clusters import uncomfortable_states
from models.task.spaces import LOST


@dataclass(frozen=True)
class TeacherConfig(Settings):
    """Who demonstrates, and the hidden reward of the simulated mind, in units of the goal's."""

    demonstrator: Literal["oracle", "recorded"] = "oracle"
    """Who shows what to do: a simulated mind, or a recording of answers for the states it holds.
    The expert, and what the policy is judged by, are the simulated mind's either way."""
    recording: Path | None = None
    """The recording: a CSV file with the columns of demonstrations.csv in the task data."""
    action_cost: Annotated[float, Limits(0, 1)] = 0.01
    """What each action costs."""
    discomfort: Annotated[float, Limits(0, 10)] = 0.05
    """What it costs to enter a pose that §5.10.1 calls less comfortable."""
    surprise: Annotated[float, Limits(0, 10)] = 0.5
    """What an action costs, times the probability that its likeliest outcome does not come.
    A turn that leaves the cube halfway between two orientations is such a toss-up.
    A person would not show it: what follows is not what the state's name says."""
    tolerance: Annotated[float, Limits(0, 1, open_low=True, open_high=True)] = 0.005
    """Two actions are equally good if their values differ by less; half an action's cost."""
    ties: Literal["random", "habit"] = "random"
    """Which of equally good actions is shown: any, or by habit the one that turns the wrist least,
    and of these the one that moves it least."""
    label_noise: Annotated[float, Limits(0, 1)] = 0.0
    """The probability that a demonstrated label is wrong."""


@dataclass(frozen=True, eq=False)
class GraspTeacher:
    """Demonstrator and expert of the grasping task, and the mind that they are judged by.

    Attributes:
        task: what is taught.
        config: who teaches.
        recording: what was recorded, if that is who demonstrates.

    Raises:
        InputError: if a recording is wanted and not named, named and not wanted, cannot be read,
            or holds what cannot be done.
    """

    task: TaskData
    config: TeacherConfig
    recording: Demonstrations | None = field(init=False)

    def __post_init__(self) -> None:
        """Read the recording."""
        object.__setattr__(self, "recording", _read(self.config, self.task))

    @cached_property
    def oracle(self) -> OracleDemonstrator:
        """An optimal policy under the hidden reward, planned on the task's own model."""
        task, config = self.task, self.config
        plain = OracleDemonstrator(
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
        return habitual(plain, costs(task.model)) if config.ties == "habit" else plain

    def answers(self, rules: list[str] | None = None) -> Teacher:
        """Who answers the learner; ``rules`` say what follows from a demonstration; all if None."""
        return Teacher(
            self.oracle if self.recording is None else RecordedDemonstrator(self.recording),
            OracleExpert(self.oracle, self.task.start_states),
            self.task.generalisation,
            rules,
        )

    def initial_demonstrations(
        self, count: int, least_purity: float, rng: np.random.Generator
    ) -> tuple[Demonstrations, Teacher, dict[str, dict[str, Trust]]]:
        """Labels of ``count`` states before the first question; of a recording, all if fewer.

        Returns:
            The labels; who goes on to answer; and the trust in each generalisation rule.

        Raises:
            InputError: as `irl.collection.by_trusted_rules`.
        """
        return by_trusted_rules(self.answers(), self.runs(rng), count, least_purity)

    def runs(self, rng: np.random.Generator) -> Iterator[Demonstrations]:
        """Runs from starts drawn by chance, without end; or of a recording, each once."""
        if self.recording is not None:
            return recorded_runs(self.recording, rng)
        return runs_from(self.oracle, self.task.start_states, rng)

    def share_right(self, labels: Demonstrations) -> float | None:
        """Share of generalised labels that the simulated mind would confirm; None without any."""
        derived = labels.select(labels.generalised)
        right = self.oracle.optimal_actions[derived.state, derived.action]
        return float(right.mean()) if right.size else None

    def candidates(self, problem: LearningProblem) -> np.ndarray | None:
        """The states of ``problem`` that there is an answer for."""
        if self.recording is None or problem.candidates is None:
            return problem.candidates
        return np.intersect1d(problem.candidates, self.recording.state)


def _read(config: TeacherConfig, task: TaskData) -> Demonstrations | None:
    """The recording, if there is to be one; checked, so that a wrong one costs no work."""
    path = config.recording
    if (config.demonstrator == "recorded") != (path is not None):
        raise InputError(
            "--teacher.recording: give a CSV file with --teacher.demonstrator recorded, and "
            "only then"
        )
    if path is None:
        return None
    recording = Demonstrations.load(path)
    recording.check(task.model, str(path))
    if not len(recording):
        raise InputError("holds no demonstration", place=str(path))
    return recording
