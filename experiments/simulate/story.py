"""Play a learned policy from random starts: in the Drake diagram, or by forecast alone.

An action is chosen by the policy's table, as in the thesis, or by looking ahead from the cube's
true pose. What the simulator knows decides what counts as a success.
"""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from diagrams.contact import Solver
from diagrams.decisions import Decision, Forecast, Table, held_goal
from diagrams.policy_controller import Verdict
from diagrams.policy_run import Played
from experiments.grasping.exporting import export_episodes
from experiments.grasping.playing import Plan, draw_starts, play_episodes, summary
from experiments.kit.command import Output
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK, load_planner
from experiments.simulate.kinematic import Imagined, count, imagine_all
from irl.choices import Limits, Settings
from irl.errors import InputError
from irl.policy import Policy, load_policy
from models.export.trajectories import SPEED_LIMIT
from models.task import words

COLUMNS = (
    *("number", "start", "verdict", "success", "false_success", "actions", "seconds"),
    *("chosen_by", "fault"),
)
"""Of ``episodes.csv``, which has a row an episode."""


@dataclass(frozen=True)
class Config(Settings):
    """Play a learned policy in the Drake diagram, from random starts."""

    policy: Path = Path("out/demo/policy.safetensors")
    """The policy file; it must have been learnt for the task data given."""
    task: Path = SHIPPED_TASK
    """The folder that the task data are read from."""
    starts: Annotated[int | Literal["all"], Limits(1, 1_000_000)] = 3
    """How many starts are drawn among the task's free states, without repetition; or all."""
    decision: Literal["forecast", "table"] = "forecast"
    """What chooses an action: a forecast from the cube's true pose, or the policy's table alone."""
    goals: Literal["task", "learner"] = "task"
    """What the forecast takes for the goal: the task's, or the state that the learner holds for it.
    Episodes are judged by the task's either way."""
    physics: bool = True
    """Whether to simulate, or else to draw from the forecast's own outcomes what actions lead to.
    Without physics nothing is recorded."""
    recording: bool = True
    """Whether to leave a recording and pictures."""
    solver: Solver = "discrete"
    """What simulates a cube that falls: the discrete solver, as all else, or Drake's CENIC, blow by
    blow."""
    disturbance: Annotated[float, Limits(0, 0.5)] = 0.0
    """By how much more the cube's place at the start is disturbed: a standard deviation [m]."""
    max_actions: Annotated[int, Limits(1, 10_000)] = 20
    """After how many actions an episode ends."""
    export: Path | None = None
    """A folder to write the episodes to as joint trajectories; by default none are written.
    They are CSV, ROS 2 YAML and the Gen3's pre-computed form, with the gripper's commands."""
    export_speed: Annotated[float, Limits(1, 80)] = SPEED_LIMIT
    """The speed that no joint exceeds in them [deg/s]."""
    seed: int = 0
    """The seed of the starts and of the cube's true poses."""
    out: Path = Path("out/simulate")
    """The folder that the results are written to."""


def print_episodes(played: list[Played]) -> None:
    """Say each episode in a person's words: where it started, how it ended, what was done."""
    for each in played:
        print(f"{words.describe_state(each.start)}: {each.reason or each.episode.verdict}")
        for step in each.episode.steps:
            print(f"    {words.describe_action(step.action)}")


def decide(config: Config, policy: Policy, goal_states: np.ndarray) -> Decision:
    """What chooses the actions."""
    if config.decision == "table":
        return Table(policy)
    return Forecast(policy, goal_states if config.goals == "task" else held_goal(policy))


def write_episodes(path: Path, rows: Iterator[tuple[object, ...]]) -> None:
    """Write ``episodes.csv``."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(rows)


def played_rows(played: list[Played]) -> Iterator[tuple[object, ...]]:
    """Rows of episodes in physics."""
    for number, each in enumerate(played):
        steps = each.episode.steps
        yield (
            *(number, each.start, each.episode.verdict.value),
            *(int(each.success), int(each.false_success), len(steps), f"{each.seconds:.2f}"),
            *(" ".join(step.chosen_by for step in steps), each.reason),
        )


def imagined_rows(imagined: list[Imagined]) -> Iterator[tuple[object, ...]]:
    """Rows of episodes without physics, which know neither seconds nor faults."""
    for number, each in enumerate(imagined):
        chosen_by = " ".join(step.chosen_by for step in each.steps)
        success = int(each.verdict == Verdict.GOAL)
        yield number, each.start, each.verdict.value, success, 0, len(each.steps), "", chosen_by, ""


def main(config: Config, output: Output) -> dict[str, Any]:
    """Load, draw starts, play, count."""
    if config.export is not None and not config.physics:
        raise InputError("without physics there are no motions to write", place="--export")
    task = load_robot_task(config.task)
    policy = load_policy(config.policy, task.task_hash, task.model.mask)
    decision = decide(config, policy, task.goal_states)
    starts = draw_starts(task, config.starts, config.seed)
    plan = Plan(
        starts,
        config.seed,
        config.disturbance,
        config.max_actions,
        config.recording,
        config.solver,
    )
    said = {
        "decision": config.decision,
        "goals": config.goals if config.decision == "forecast" else None,
        "physics": config.physics,
    }
    if not config.physics:
        imagined = imagine_all(decision, task.goal_states, plan)
        with output.file("episodes.csv") as path:
            write_episodes(path, imagined_rows(imagined))
        result = count(imagined)
        print(f"{result['successes']} of {result['trials']} starts reached the goal, by forecast")
        return {**said, **result, "recording": None}
    played = play_episodes(decision, load_planner(), task.goal_states, plan, output)
    with output.file("episodes.csv") as path:
        write_episodes(path, played_rows(played))
    result = summary(played)
    print_episodes(played)
    if config.export is not None:
        result["exported"] = export_episodes(config.export, played, config.export_speed)
    print(f"{result['successes']} of {result['trials']} starts reached the goal")
    return {**said, **result, "recording": "recording.html" if config.recording else None}
