"""Episodes in the Drake diagram: played one after another, recorded, drawn as film strips."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from matplotlib.figure import Figure
from matplotlib.image import imsave
from tqdm import tqdm

from diagrams.camera import StillCamera
from diagrams.contact import Solver
from diagrams.decisions import Decision
from diagrams.monitor import Loads
from diagrams.policy_controller import Episode
from diagrams.policy_run import Played, PolicyRun
from experiments.kit.command import Output
from experiments.kit.recording import write_recording
from irl.errors import InputError
from irl.task_data import TaskData
from models.motion.planner import ActionPlanner
from models.task import words
from models.task.spaces import N_FREE, Action
from models.task.tables import describe_state

BAR = "{desc}: {n_fmt} of at most {total_fmt} actions {bar} {elapsed}{postfix}"
"""Progress of an episode; when it will end cannot be predicted."""


@dataclass(frozen=True)
class Plan:
    """Which episodes are played.

    Attributes:
        starts: indices of free states ``[n]``.
        seed: of the cube's true poses, drawn for each start by itself.
        disturbance: further standard deviation of the cube's place at the start [m].
        max_actions: after which an episode ends.
        recorded: whether to leave a recording and pictures.
        solver: what simulates a cube that falls.
    """

    starts: np.ndarray
    seed: int
    disturbance: float = 0.0
    max_actions: int = 20
    recorded: bool = True
    solver: Solver = "discrete"

    def rng(self, number: int) -> np.random.Generator:
        """The generator of the episode from the start of that number, counted from 0."""
        return np.random.default_rng([self.seed, number])


def draw_starts(
    task: TaskData, number: int | Literal["all"], seed: int, *, at_least: int = 1
) -> np.ndarray:
    """Draw start states that are not goals, without repetition; or take all, in their order.

    Raises:
        InputError: if ``number`` is below ``at_least`` or above what there is, or the task has
            start states that the robot cannot be put in.
    """
    pool = np.setdiff1d(task.start_states, task.goal_states)
    held = pool[pool >= N_FREE]
    if number and held.size:
        raise InputError(
            f"--task: task.json: field 'start_states' holds {held[0]}, where the cube is not free; "
            f"an episode starts in one of 0…{N_FREE - 1}"
        )
    if number == "all":
        return pool
    if not at_least <= number <= pool.size:
        raise InputError(
            f"--starts: must be ≥ {at_least} and ≤ {pool.size}, the number of the task's start "
            f"states, is {number}"
        )
    return np.random.default_rng(seed).choice(pool, number, replace=False)


def play_episodes(
    decision: Decision,
    planner: ActionPlanner,
    goal_states: np.ndarray,
    plan: Plan,
    output: Output,
) -> list[Played]:
    """Play from each start; leave a recording and pictures if the plan wants them.

    ``recording.html`` shows all episodes, ``episode_N.png`` one as a film strip, ``robot.png``
    the scene after the first action.

    Args:
        decision: chooses the actions (see `PolicyController`).
        planner: plans the motions.
        goal_states: where episodes end well.
        plan: which episodes.
        output: folder of the pictures.
    """
    run = PolicyRun(
        decision,
        planner,
        goal_states=goal_states,
        max_actions=plan.max_actions,
        solver=plan.solver,
    )
    played: list[Played] = []
    for number, start in enumerate(plan.starts):
        with tqdm(
            desc=f"episode {number + 1}/{len(plan.starts)}",
            total=plan.max_actions,
            bar_format=BAR,
        ) as bar:

            def show(seconds: float, episode: Episode, bar: tqdm = bar) -> None:
                bar.n = len(episode.steps)
                bar.set_postfix_str(f"{seconds:.0f} s simulated, {episode.verdict}")

            rng = plan.rng(number)
            played.append(run.play(int(start), rng, disturbance=plan.disturbance, progress=show))
    if plan.recorded:
        leave_pictures(played, int(np.atleast_1d(goal_states)[0]), output)
    return played


def leave_pictures(played: Sequence[Played], goal: int, output: Output) -> None:
    """Leave the recording, film strips and a portrait."""
    titles = [f"Episode {number} of {len(played)}" for number in range(1, len(played) + 1)]
    with output.file("recording.html") as path:
        write_recording(path, played, titles, goal)
    camera = StillCamera(view_from=(1.2, -0.75, 1.05), view_at=(0.45, 0.0, 0.62))
    for number, episode in enumerate(played):
        with output.figure(f"episode_{number + 1}.png", dpi=90) as figure:
            draw_film_strip(figure, episode, camera)
    if len(played[0].postures) > 1:
        portrait = StillCamera(
            size=(1280, 860), view_from=(1.15, -0.62, 1.0), view_at=(0.33, 0.0, 0.74)
        )
        with output.file("robot.png") as path:
            imsave(path, portrait.picture(played[0].postures[1]))


def summary(played: list[Played]) -> dict[str, Any]:
    """Count what came of episodes; simulator faults judge nothing."""
    judged = [episode for episode in played if not episode.fault]
    successes = [episode for episode in judged if episode.success]
    lengths = [len(episode.episode.steps) for episode in successes]
    reasons = Counter(episode.episode.verdict.value for episode in judged if not episode.success)
    return {
        "successes": len(successes),
        "trials": len(judged),
        "actions_mean": float(np.mean(lengths)) if successes else None,
        "actions_max": max(lengths, default=None),
        "faults": len(played) - len(judged),
        "false_successes": sum(episode.false_success for episode in judged),
        "failures": dict(sorted(reasons.items())),
        "limits": limits([episode.loads for episode in played]),
        "episodes": [
            {
                "start": describe_state(episode.start),
                "verdict": episode.reason or episode.episode.verdict.value,
                "seconds": round(episode.seconds, 2),
                "actions": [str(Action.from_index(s.action)) for s in episode.episode.steps],
                "states": [s.next_state for s in episode.episode.steps],
                "chosen_by": [s.chosen_by.value for s in episode.episode.steps],
            }
            for episode in played
        ],
    }


def limits(loads: list[Loads]) -> dict[str, Any]:
    """What the joints, 1 to 7, and the contacts did at most in all episodes, as `Loads` says."""
    largest = {
        name: np.max([getattr(each, name) for each in loads], axis=0, initial=0.0)
        for name in ("speed", "acceleration", "torque", "tracking_error")
    }
    penetration: dict[str, float] = {}
    for each in loads:
        for pair, depth in each.penetration.items():
            penetration[pair] = max(depth, penetration.get(pair, 0.0))
    return {
        **{name: [float(f"{x:.4g}") for x in values] for name, values in largest.items()},
        "limited_samples": sum(each.limited_samples for each in loads),
        "penetration": {pair: float(f"{penetration[pair]:.4g}") for pair in sorted(penetration)},
    }


def draw_film_strip(figure: Figure, played: Played, camera: StillCamera) -> None:
    """Draw the scene at the start and after each action, in a person's words."""
    steps = played.episode.steps
    titles = [f"start: {words.describe_state(played.start)}".replace("; ", ";\n")]
    titles += [f"{k}. {words.describe_action(step.action)}" for k, step in enumerate(steps, 1)]
    shown = played.postures[: len(titles)]
    columns = min(4, len(shown))
    rows = -(-len(shown) // columns)
    figure.set_size_inches(4 * columns, 3.3 * rows)
    axes = figure.subplots(rows, columns, squeeze=False)
    for axis in axes.flat:
        axis.axis("off")
    for axis, posture, title in zip(axes.flat, shown, titles, strict=False):
        axis.imshow(camera.picture(posture))
        axis.set_title(title, fontsize=9)
    many = "1 action" if len(steps) == 1 else f"{len(steps)} actions"
    figure.suptitle(played.reason or f"{played.episode.verdict} after {many}")
