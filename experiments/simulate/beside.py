"""Every shipped scenario beside the undisturbed episodes of the same seeds, which are played once.

A scenario's episodes are those of ``simulate --scenario NAME`` with the same starts and seed.
"""

import csv
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from matplotlib.figure import Figure

from diagrams.scenarios import shipped_scenarios
from experiments.kit.command import Output
from experiments.kit.executors import MOST_WORKERS
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.simulate.counting import count, counts, paired
from experiments.simulate.episodes import Crew, Episodes, Job, Setting, draw_starts, play_all
from experiments.simulate.story import scenario_text, write_rows
from irl.choices import Limits, Settings
from irl.errors import InputError
from irl.metrics import Share
from irl.policy import load_policy

USUAL = "undisturbed"


@dataclass(frozen=True)
class Config(Settings):
    """Play a policy in every shipped scenario, beside undisturbed episodes of the same seeds."""

    policy: Path = Path("out/demo/policy.safetensors")
    """The policy file; it must have been learnt for the task data given."""
    task: Path = SHIPPED_TASK
    """The folder that the task data are read from."""
    scenarios: tuple[str, ...] = ()
    """Which scenarios: names of shipped ones, or YAML files; by default all that are shipped."""
    starts: Annotated[int | Literal["all"], Limits(1, 1_000_000)] = 100
    """How many starts are drawn among the task's free states, without repetition; or all."""
    decision: Literal["forecast", "table"] = "forecast"
    """What chooses an action: a forecast from the cube's true pose, or the policy's table alone."""
    max_actions: Annotated[int, Limits(1, 10_000)] = 20
    """After how many actions an episode ends."""
    workers: Annotated[int, Limits(1, MOST_WORKERS)] = 1
    """How many processes play; the episodes are the same whatever their number."""
    cluster: str = ""
    """The address of a dask scheduler whose workers play instead, such as tcp://host:8786."""
    seed: int = 0
    """The seed of the starts, of the cube's true poses, and of what a scenario draws."""
    out: Path = Path("out/scenarios")
    """The folder that the results are written to, and a folder in it for each scenario."""


def main(config: Config, output: Output) -> dict[str, Any]:
    """Play them one after another; killed, the same command goes on."""
    names = config.scenarios or tuple(shipped_scenarios())
    if len(set(names)) < len(names):
        raise InputError("each may be given once", place="--scenarios")
    texts = {name: scenario_text(name, "--scenarios") for name in names}
    task = load_robot_task(config.task)
    load_policy(config.policy, task.task_hash, task.model.mask)
    common = Setting(
        config.policy,
        config.task,
        config.decision,
        max_actions=config.max_actions,
        seed=config.seed,
    )
    starts = [int(start) for start in draw_starts(task, config.starts, config.seed)]
    folders = {name: Output(output.folder / Path(name).stem, None) for name in (USUAL, *names)}
    played: dict[str, Episodes] = {}
    for name, folder in folders.items():
        print(name)
        jobs = [Job(n, start, disturbed=name != USUAL) for n, start in enumerate(starts)]
        own = replace(common, scenario=texts.get(name, ""))
        crew = Crew(config.workers, config.cluster)
        played[name] = play_all(own, jobs, 0, crew, folder)
        with folder.file("episodes.csv") as path:
            write_rows(path, played[name].rows)
    result = results(played)
    with output.file("scenarios.csv") as path:
        write_table(path, result["scenarios"])
    with output.figure("scenarios.png") as figure:
        plot(figure, result)
    print_results(result)
    for name, episodes in played.items():
        episodes.forget(folders[name])
    return result


def results(played: dict[str, Episodes]) -> dict[str, Any]:
    """What goes into ``result.json``."""
    usual = played[USUAL].rows
    scenarios = {}
    for name, episodes in played.items():
        if name == USUAL:
            continue
        pairs = zip(episodes.rows, usual, strict=True)
        beside = [row for own, row in pairs if counts(own) and counts(row)]
        scenarios[name] = {
            **count(episodes.rows),
            USUAL: count(beside),
            "paired": paired(episodes.rows, usual),
        }
    return {USUAL: count(usual), "scenarios": scenarios}


def write_table(path: Path, scenarios: dict[str, Any]) -> None:
    """Write one row a scenario."""
    columns = ("scenario", "episodes", "succeeded", "undisturbed", "difference", "low", "high")
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow((*columns, "actions_mean", "false_successes", "faults", "not_acted"))
        for name, each in scenarios.items():
            counted = (each[key] for key in ("false_successes", "faults", "not_acted"))
            difference = each["paired"]["difference"] or ("", "", "")
            own = (each["trials"], each["successes"], each[USUAL]["successes"])
            writer.writerow((name, *own, *difference, each["actions_mean"], *counted))


def print_results(result: dict[str, Any]) -> None:
    """One line for each scenario."""
    print(f"{'scenario':>14}  succeeded  undisturbed  difference [points]")
    for name, each in result["scenarios"].items():
        line = f"{name:>14}  {each['successes']:4d}/{each['trials']:<4d}"
        if each["paired"]["difference"]:
            d, low, high = (100 * value for value in each["paired"]["difference"])
            line += f"  {each[USUAL]['successes']:11d}  {d:+.0f} [{low:+.0f}, {high:+.0f}]"
        if each["false_successes"] or each["faults"]:
            line += f"  {each['false_successes']} false, {each['faults']} simulator faults"
        print(line)


def plot(figure: Figure, result: dict[str, Any]) -> None:
    """Draw the share of each scenario that succeeds, and the undisturbed one's beside it."""
    rows = {USUAL: result[USUAL], **result["scenarios"]}
    rows = {name: each for name, each in rows.items() if each["trials"]}
    figure.set_size_inches(8, 0.4 * len(rows) + 1.2)
    axes = figure.subplots()
    for place, each in enumerate(rows.values()):
        share = Share(each["successes"], each["trials"])
        low, high = share.interval
        error = 100.0 * np.array([[share.value - low], [high - share.value]]).clip(0.0)
        axes.errorbar(100.0 * share.value, place, xerr=error, fmt="o", color="#2166ac", capsize=3)
        told = f"{each['successes']} of {each['trials']}"
        axes.annotate(
            told, (1.01, place), xycoords=("axes fraction", "data"), va="center", fontsize=9
        )
        if USUAL in each:
            other = Share(each[USUAL]["successes"], each[USUAL]["trials"])
            axes.plot(100.0 * other.value, place, "|", color="#b2182b", ms=14, mew=2)
    axes.plot([], [], "|", color="#b2182b", ms=14, mew=2, label="the same seeds undisturbed")
    axes.set_yticks(range(len(rows)), [name.replace("_", " ") for name in rows])
    axes.invert_yaxis()
    axes.set_xlabel("episodes that reach the goal, %, with 95 % interval")
    axes.set_xlim(right=100.5)
    axes.grid(axis="x", alpha=0.3)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False)
