"""The main job: from task data and a few demonstrations to a policy that the robot plays.

981 demonstrated states, then active learning with advice (thesis Algorithm 4.1) until 8.11 % of
the states are demonstrated, then the policy in full physics from random starts; and beside it what
one trajectory teaches. Killed while it learns, it goes on with the same command.
"""

from dataclasses import asdict, dataclass, field
from pathlib import Path
from time import perf_counter, process_time
from typing import Annotated, Any

import numpy as np
import torch

from experiments.grasping.assessment import Assessment, assess
from experiments.grasping.learning import LearningConfig, forget, learn
from experiments.grasping.one_run import OneRun, learn_from_one
from experiments.grasping.plots import plot_learning, plot_policy
from experiments.grasping.teacher import GraspTeacher, TeacherConfig
from experiments.kit.command import Output, execute
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.simulate.counting import count, told
from experiments.simulate.episodes import Crew, Job, Setting, draw_starts, play_all
from experiments.simulate.pictures import leave_pictures
from irl.choices import Limits, Settings
from irl.metrics import Share
from irl.policy import Policy, save_policy


@dataclass(frozen=True)
class Config(Settings):
    """Learn the grasping task from demonstrations and advice, and play it in Drake."""

    task: Path = SHIPPED_TASK
    """The folder that the task data are read from."""
    teacher: TeacherConfig = field(default_factory=TeacherConfig)
    """Who demonstrates and advises. The learner never sees the simulated mind's reward or goal."""
    learning: LearningConfig = field(default_factory=LearningConfig)
    """What the learner sees, and how much it is shown before it asks."""
    starts: Annotated[int, Limits(0, 1_000_000)] = 3
    """How many episodes are played in the Drake diagram; 0 plays none."""
    max_actions: Annotated[int, Limits(1, 10_000)] = 20
    """After how many actions an episode ends."""
    seed: int = 0
    """The seed of every random draw."""
    out: Path = Path("out/demo")
    """The folder that the results are written to."""


def main(config: Config, output: Output) -> dict[str, Any]:
    """Learn, assess, play."""
    started = perf_counter()
    # Small matrices: a second thread costs more than it brings, and changes the last bits.
    torch.set_num_threads(1)
    task = load_robot_task(config.task)
    starts = draw_starts(task, config.starts, config.seed, at_least=0)
    teacher = GraspTeacher(task, config.teacher)
    rng = np.random.default_rng(config.seed)

    began = process_time()
    learnt = learn(task, teacher, config.learning, rng, output.folder)
    learning_cpu_s = process_time() - began
    policy = Policy.from_q(
        learnt.result.q,
        task.model.mask,
        weights=learnt.result.network.arrays(),
        task_hash=task.task_hash,
        algorithm="fa_mlirl",
        seed=config.seed,
    )
    with output.file("policy.safetensors") as path:
        save_policy(policy, path)
    assessment = assess(task, teacher.oracle, policy.action, learnt.result.demonstrations, rng)
    with output.figure("learning.png") as figure:
        plot_learning(figure, learnt, assessment)
    with output.figure("policy.png") as figure:
        plot_policy(figure, task, policy, teacher.oracle)
    learnt_s = perf_counter() - started
    one = None
    by_one = learn_from_one(teacher, np.random.default_rng([config.seed, 1]), config.seed)
    if by_one is not None:
        one, policy_of_one = by_one
        with output.file("one_trajectory.safetensors") as path:
            save_policy(policy_of_one, path)

    physics: dict[str, Any] = {"successes": 0, "trials": 0, "limits": None, "episodes": []}
    if config.starts:
        physics = play(config, starts, int(task.goal_states[0]), output)

    forget(output.folder)
    print_table(assessment, one, physics, output.folder)
    return {
        **assessment.as_dict(),
        "success_drake": {key: physics[key] for key in ("successes", "trials")},
        "decision": "forecast",
        "goals": "learner",
        "limits": physics["limits"],
        "episodes": physics["episodes"],
        "queries": len(learnt.result.history),
        "advised_clusters": [record.cluster for record in learnt.result.history if record.cluster],
        "rules": learnt.rules,
        "rule_purity": {
            rule: {kind: asdict(trust) for kind, trust in kinds.items()}
            for rule, kinds in learnt.trust.items()
        },
        "caution": learnt.result.caution,
        "generalised_right": teacher.share_right(learnt.result.demonstrations),
        "evidence": learnt.evidence,
        "learning_s": learnt_s,
        "learning_cpu_s": learning_cpu_s,
        "one_trajectory": None if one is None else asdict(one),
        "wall_s": perf_counter() - started,
        "recording": "recording.html" if config.starts else None,
    }


def play(config: Config, starts: np.ndarray, goal: int, output: Output) -> dict[str, Any]:
    """Play the policy that was learnt, and leave pictures."""
    # The learner never sees the goal: looking ahead goes by what it holds for one.
    setting = Setting(
        output.folder / "policy.safetensors",
        config.task,
        goals="learner",
        max_actions=config.max_actions,
        seed=config.seed,
    )
    jobs = [Job(number, int(start)) for number, start in enumerate(starts)]
    episodes = play_all(setting, jobs, len(jobs), Crew(), output)
    titles = [f"Episode {number} of {len(jobs)}" for number in range(1, len(jobs) + 1)]
    played = [episodes.whole(number) for number in range(len(jobs))]
    leave_pictures(played, titles, goal, "", output)
    episodes.forget(output)
    return {**count(episodes.rows), "episodes": [told(row) for row in episodes.rows]}


def print_table(
    assessment: Assessment, one: OneRun | None, physics: dict[str, Any], folder: Path
) -> None:
    """Print the figures with their 95 % intervals."""

    def share(value: Share) -> str:
        low, high = value.interval
        return f"{value.value:6.1%}   [{low:.1%}, {high:.1%}]"

    rows = [
        ("states demonstrated", f"{assessment.demonstrated_fraction:6.2%}"),
        ("accuracy, demonstrator's action", share(assessment.accuracy_strict)),
        ("  the most to expect", f"{assessment.accuracy_strict_ceiling:6.1%}"),
        ("accuracy, as good an action", share(assessment.accuracy_optimal)),
        ("  over all unseen states", share(assessment.accuracy_optimal_all)),
        ("success in the model", f"{assessment.success_mdp:6.1%}"),
        ("  the demonstrator's own", f"{assessment.success_mdp_oracle:6.1%}"),
    ]
    if one is not None:
        rows += [
            (f"from one trajectory, {one.labels} labels", ""),
            ("  accuracy over all unseen states", f"{one.accuracy_optimal_all:6.1%}"),
            ("  success in the model", f"{one.success_mdp:6.1%}"),
        ]
    if physics["trials"]:
        won = Share(physics["successes"], physics["trials"])
        rows.append((f"success in physics, {won.successes} of {won.trials}", share(won)))
    width = max(len(name) for name, _ in rows)
    print("\n".join(f"{name:<{width}}  {value}" for name, value in rows))
    print(f"results in {folder}")


if __name__ == "__main__":
    execute(Config, main)
