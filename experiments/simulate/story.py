"""Play a learned policy from random starts: in the Drake diagram, or by forecast alone.

An action is chosen by the policy's table, as in the thesis, or by looking ahead from the cube's
true pose. What the simulator knows decides what counts as a success. A scenario disturbs episodes;
each is then played undisturbed as well, from the same seed. Killed, the same command goes on.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from diagrams.contact import Solver
from diagrams.scenarios import load_scenario
from experiments.grasping.exporting import export_episodes
from experiments.kit.command import Output
from experiments.kit.executors import MOST_WORKERS
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.simulate.counting import Row, always, count, paired, told
from experiments.simulate.episodes import Crew, Episodes, Job, Setting, draw_starts, play_all
from experiments.simulate.live import open_meshcat, play_live
from experiments.simulate.pictures import leave_pictures
from irl.choices import Limits, Settings
from irl.errors import InputError
from irl.files import sha256
from irl.policy import load_policy
from irl.task_data import TaskData
from models.errors import ModelError
from models.export.trajectories import SPEED_LIMIT
from models.task import words

COLUMNS = (
    *("number", "start", "repetition", "disturbed", "verdict", "success", "false_success"),
    *("actions", "seconds", "acted", "chosen_by", "action_failures", "fault"),
)
"""Of ``episodes.csv``, which has a row an episode."""
TOLD = 24
"""Up to so many episodes are told in words, and in full in ``result.json``."""
SHOWN = 3
"""So many episodes are recorded, the first ones, and as many more of those that failed."""

LIVE = (
    "simulates one episode after another in this process and leaves neither recording nor motions"
)


@dataclass(frozen=True)
class Config(Settings):
    """Play a learned policy in the Drake diagram, from random starts."""

    policy: Path = Path("out/demo/policy.safetensors")
    """The policy file; it must have been learnt for the task data given."""
    task: Path = SHIPPED_TASK
    """The folder that the task data are read from."""
    starts: Annotated[int | Literal["all"], Limits(1, 1_000_000)] = 3
    """How many starts are drawn among the task's free states, without repetition; or all."""
    repeat: Annotated[int, Limits(1, 1000)] = 1
    """How often each start is played, with other draws each time."""
    scenario: str = ""
    """What goes otherwise than usual: the name of a shipped scenario, or a YAML file of one's own.
    Each episode is then played undisturbed as well, from the same seed."""
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
    live: bool = False
    """Whether to show the episodes in a browser while they are played, in real time: with buttons
    to pause, to go on to the next, and to shove the cube. They leave no recording, and those of a
    scenario are not played undisturbed as well."""
    solver: Solver = "cenic"
    """What simulates a cube that falls: Drake's CENIC, blow by blow, or the discrete solver, as all
    else."""
    disturbance: Annotated[float, Limits(0, 0.5)] = 0.0
    """By how much more the cube's place at the start is disturbed: a standard deviation [m]."""
    max_actions: Annotated[int, Limits(1, 10_000)] = 20
    """After how many actions an episode ends."""
    workers: Annotated[int, Limits(1, MOST_WORKERS)] = 1
    """How many processes play; the episodes are the same whatever their number."""
    cluster: str = ""
    """The address of a dask scheduler whose workers play instead, such as tcp://host:8786."""
    export: Path | None = None
    """A folder to write the episodes to as joint trajectories; by default none are written.
    They are CSV, ROS 2 YAML and the Gen3's pre-computed form, with the gripper's commands."""
    export_speed: Annotated[float, Limits(1, 80)] = SPEED_LIMIT
    """The speed that no joint exceeds in them [deg/s]."""
    seed: int = 0
    """The seed of the starts, of the cube's true poses, and of what a scenario draws."""
    out: Path = Path("out/simulate")
    """The folder that the results are written to."""


def scenario_text(name: str, option: str = "--scenario") -> str:
    """A scenario as YAML, empty for none; refusals name the option."""
    if not name:
        return ""
    try:
        return load_scenario(name).text()
    except ModelError as error:
        raise InputError(str(error), place=option) from None


def setting(config: Config) -> Setting:
    """What the command's episodes have in common."""
    return Setting(
        config.policy,
        config.task,
        config.decision,
        config.goals,
        config.physics,
        config.disturbance,
        config.max_actions,
        scenario_text(config.scenario),
        config.seed,
        config.solver,
    )


def all_jobs(config: Config, task: TaskData) -> list[Job]:
    """The command's episodes: of each start every repetition, disturbed ones first."""
    starts = [int(start) for start in draw_starts(task, config.starts, config.seed)]
    times = range(config.repeat)
    jobs = [Job(n, start, k) for n, start in enumerate(starts) for k in times]
    disturbed = [replace(job, disturbed=True) for job in jobs] if config.scenario else []
    return disturbed + jobs


def print_episodes(rows: Sequence[Row]) -> None:
    """Say each episode in a person's words: where it started, how it ended, what was done."""
    for row in rows:
        print(f"{words.describe_state(row['start'])}: {row['fault'] or row['verdict']}")
        for action in row["actions"]:
            print(f"    {words.describe_action(action)}")


def write_rows(path: Path, rows: Sequence[Row]) -> None:
    """Write ``episodes.csv``."""

    def shown(row: Row, name: str) -> object:
        value = row[name]
        if name == "actions":
            return len(value)
        if name == "seconds":
            return "" if value is None else f"{value:.2f}"
        if isinstance(value, list):
            return " ".join((each or "-").replace(" ", "_") for each in value)
        return int(value) if isinstance(value, bool) else value

    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows([shown(row, name) for name in COLUMNS] for row in rows)


def refuse_what_contradicts(config: Config) -> None:
    """Refuse options that have nothing to say beside another.

    Raises:
        InputError: for the first of them.
    """
    if not config.physics:
        for option, given in (("export", config.export), ("scenario", config.scenario)):
            if given:
                raise InputError("without physics there are no motions", place=f"--{option}")
    if config.live:
        for option, is_given in (
            ("no-physics", not config.physics),
            ("no-recording", not config.recording),
            ("workers", config.workers > 1),
            ("cluster", bool(config.cluster)),
            ("export", config.export is not None),
        ):
            if is_given:
                raise InputError(f"says nothing with --live, which {LIVE}", place=f"--{option}")


def main(config: Config, output: Output) -> dict[str, Any]:
    """Draw starts, play, count, compare, show."""
    refuse_what_contradicts(config)
    task = load_robot_task(config.task)
    load_policy(config.policy, task.task_hash, task.model.mask)
    common = setting(config)
    jobs = all_jobs(config, task)
    if config.live:
        wanted = [job for job in jobs if job.disturbed == bool(config.scenario)]
        return play_live(common, wanted, open_meshcat(int(task.goal_states[0])))
    shown = SHOWN if config.physics and config.recording else 0
    whole = len(jobs) if config.export else shown
    crew = Crew(config.workers, config.cluster)
    episodes = play_all(common, jobs, whole, crew, output)
    with output.file("episodes.csv") as path:
        write_rows(path, episodes.rows)
    result = results(config, episodes.rows)
    if len(jobs) <= TOLD:
        result["episodes"] = [told(row) for row in episodes.rows if config.physics]
    result["episodes_sha256"] = sha256(output.folder / "episodes.csv")
    if len(jobs) <= TOLD:
        print_episodes(episodes.rows)
    if shown:
        _leave_pictures(config, common, jobs, episodes, int(task.goal_states[0]), output)
    if config.export is not None:
        played = [episodes.whole(number) for number in range(len(jobs))]
        result["exported"] = export_episodes(config.export, played, config.export_speed)
    episodes.forget(output)
    print_results(config, result)
    return {**result, "recording": "recording.html" if shown else None}


def results(config: Config, rows: Sequence[Row]) -> dict[str, Any]:
    """What goes into ``result.json``; with a scenario, the disturbed episodes beside the others."""
    said = {
        "decision": config.decision,
        "goals": config.goals if config.decision == "forecast" else None,
        "physics": config.physics,
        "scenario": config.scenario or None,
    }
    usual = [row for row in rows if not row["disturbed"]]
    first = [row for row in rows if row["disturbed"]] or usual
    result = {**said, **count(first)}
    if config.scenario:
        pairs = [pair for pair in zip(first, usual, strict=True) if pair[0]["acted"]]
        result["undisturbed"] = count([other for _, other in pairs])
        result["paired"] = paired(first, usual)
    if config.repeat > 1:
        result["repeated"] = always(first, config.repeat)
    return result


def print_results(config: Config, result: dict[str, Any]) -> None:
    """Tell what was found."""
    how = "" if config.physics else ", by forecast"
    print(f"{result['successes']} of {result['trials']} episodes reached the goal{how}")
    if result["not_acted"]:
        print(f"{result['not_acted']} more do not count: the disturbance did not act")
    if config.scenario and result["paired"]["pairs"]:
        pairs, (d, low, high) = result["paired"], result["paired"]["difference"]
        print(
            f"undisturbed {result['undisturbed']['successes']} of them; disturbed less "
            f"undisturbed, of {pairs['pairs']} pairs: {d:+.1%} [{low:+.1%}, {high:+.1%}]"
        )
    if config.repeat > 1:
        each = result["repeated"]
        print(f"{each['always']} of {each['starts']} starts succeeded {config.repeat} times of it")


def title(job: Job, config: Config) -> str:
    """What an episode is called in pictures."""
    told = f"Start {job.number + 1}"
    if config.repeat > 1:
        told += f", repetition {job.repetition + 1}"
    if config.scenario:
        told += f", {config.scenario if job.disturbed else 'undisturbed'}"
    return told


def _leave_pictures(
    config: Config,
    common: Setting,
    jobs: Sequence[Job],
    episodes: Episodes,
    goal: int,
    output: Output,
) -> None:
    """Show the first episodes, and of the others the first that failed."""
    shown = list(range(min(SHOWN, len(jobs))))
    wanted = bool(config.scenario)
    failed = [
        number
        for number, row in enumerate(episodes.rows)
        if row["disturbed"] == wanted and not row["success"] and not row["fault"]
    ]
    shown += [number for number in failed if number not in shown][:SHOWN]
    titles = [title(jobs[number], config) for number in shown]
    played = [episodes.whole(number) for number in shown]
    leave_pictures(played, titles, goal, common.scenario, output)
