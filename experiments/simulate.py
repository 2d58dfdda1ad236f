"""Play a learned policy in the Drake diagram, from random starts."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from diagrams.policy_run import Played
from experiments.grasping.exporting import export_episodes
from experiments.grasping.playing import draw_starts, play_episodes, summary
from experiments.kit.command import Output, execute
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK, load_planner
from irl.choices import Limits, Settings
from irl.policy import load_policy
from models.export.trajectories import SPEED_LIMIT
from models.task import words


@dataclass(frozen=True)
class Config(Settings):
    """Play a learned policy in the Drake diagram, from random starts."""

    policy: Path = Path("out/demo/policy.safetensors")
    """The policy file; it must have been learnt for the task data given."""
    task: Path = SHIPPED_TASK
    """The folder that the task data are read from."""
    starts: Annotated[int, Limits(1, 1_000_000)] = 3
    """How many starts are drawn among the task's free states, without repetition."""
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


def main(config: Config, output: Output) -> dict[str, Any]:
    """Load, draw starts, play, count."""
    task = load_robot_task(config.task)
    policy = load_policy(config.policy, task.task_hash, task.model.mask)
    starts = draw_starts(task, config.starts, config.seed)
    played = play_episodes(
        policy.action,
        load_planner(),
        task.goal_states,
        starts,
        seed=config.seed,
        disturbance=config.disturbance,
        max_actions=config.max_actions,
        output=output,
    )
    result = summary(played)
    print_episodes(played)
    if config.export is not None:
        result["exported"] = export_episodes(config.export, played, config.export_speed)
    print(f"{result['successes']} of {result['trials']} starts reached the goal")
    return {**result, "recording": "recording.html"}


if __name__ == "__main__":
    execute(Config, main)
