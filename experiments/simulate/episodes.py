"""Episodes as jobs: where each starts, how one is played, and many on workers, kept as they end."""

from collections.abc import Generator, Iterable, Sequence
from concurrent.futures import Future
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from time import process_time
from typing import Any, Literal

import numpy as np
from pydrake.geometry import Meshcat
from tqdm import tqdm

from diagrams.contact import Solver
from diagrams.decisions import Decision, Forecast, Table, held_goal
from diagrams.policy_run import Played, PolicyRun
from diagrams.scenarios import Scenario, draw
from diagrams.scenarios.schema import parse_scenario
from experiments.kit.command import Output
from experiments.kit.executors import run_jobs, start_workers
from experiments.kit.kept_rows import KEPT, KeptRows
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK, load_planner
from experiments.simulate.counting import imagined_row, played_row
from experiments.simulate.kinematic import imagine
from irl.errors import InputError
from irl.files import sha256
from irl.policy import load_policy
from irl.task_data import TaskData
from models.scenes.parsing import description_hash
from models.task.spaces import N_FREE


@dataclass(frozen=True)
class Setting:
    """What many episodes have in common.

    Attributes:
        policy: the policy's file.
        task: folder of the task data.
        decision: what chooses an action: ``forecast`` or ``table``.
        goals: what a forecast takes for the goal: the ``task``'s, or what the ``learner`` does.
        physics: whether to simulate, or to draw what actions lead to.
        disturbance: further standard deviation of the cube's place at the start [m].
        max_actions: after which an episode ends.
        scenario: YAML of what goes otherwise in disturbed episodes; empty for nothing.
        seed: that everything is drawn from.
        solver: what simulates a cube that falls.
    """

    policy: Path
    task: Path = SHIPPED_TASK
    decision: str = "forecast"
    goals: str = "task"
    physics: bool = True
    disturbance: float = 0.0
    max_actions: int = 20
    scenario: str = ""
    seed: int = 0
    solver: Solver = "cenic"

    def identity(self) -> dict[str, Any]:
        """What the episodes depend on."""
        return {
            **asdict(self),
            "policy": sha256(self.policy),
            "task": _task(self.task).task_hash,
            "model_files": description_hash(),
        }


@dataclass(frozen=True)
class Job:
    """One episode.

    Attributes:
        number: of the start, counted from 0.
        start: index of a free state.
        repetition: how often it was played before, with other draws.
        disturbed: whether things go otherwise, as the scenario says.
    """

    number: int
    start: int
    repetition: int = 0
    disturbed: bool = False

    def key(self, seed: int) -> tuple[int, int, int]:
        """What everything in the episode is drawn from, whatever is played before or beside it."""
        return seed, self.number, self.repetition


@dataclass(frozen=True)
class Outcome:
    """What came of a job: what is kept of it, and, if somebody wants it, all there is."""

    row: dict[str, Any]
    played: Played | None = None


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


def play(setting: Setting, job: Job, whole: bool) -> Outcome:
    """Play one episode; the same bits in any process, whatever was played before.

    Args:
        setting: what it has in common with others.
        job: which one.
        whole: whether all that there is to tell of it is wanted, with pictures.
    """
    key = job.key(setting.seed)
    rng = np.random.default_rng(key)
    began = process_time()
    told = {"number": job.number, "repetition": job.repetition, "disturbed": job.disturbed}
    if not setting.physics:
        decision, goals = _decision(replace(setting, scenario=""))
        imagined = imagine(
            decision,
            job.start,
            set(goals.tolist()),
            rng,
            disturbance=setting.disturbance,
            max_actions=setting.max_actions,
        )
        return Outcome({**told, **imagined_row(imagined), "cpu_s": process_time() - began})
    run, scenario = _run(setting if job.disturbed else replace(setting, scenario=""))
    draws = draw(scenario, key) if scenario else None
    played = run.play(job.start, rng, disturbance=setting.disturbance, draws=draws)
    row = {**told, **played_row(played), "cpu_s": process_time() - began}
    return Outcome(row, played if whole else None)


_task = lru_cache(maxsize=2)(load_robot_task)
"""Read once in a process."""


@lru_cache(maxsize=4)
def _decision(setting: Setting) -> tuple[Decision, np.ndarray]:
    """What chooses the actions, and the goals by which it is judged."""
    task = _task(setting.task)
    policy = load_policy(setting.policy, task.task_hash, task.model.mask)
    if setting.decision == "table":
        return Table(policy), task.goal_states
    goals = task.goal_states if setting.goals == "task" else held_goal(policy)
    return Forecast(policy, goals), task.goal_states


@lru_cache(maxsize=64)
def _run(setting: Setting) -> tuple[PolicyRun, Scenario | None]:
    """A diagram that plays a setting's episodes, built once in a process.

    As many are kept as anybody asks for: forgetting one would give nothing back, for a diagram with
    systems in Python holds on to itself, and building it anew would take some 10 MB more.
    """
    return build_run(setting)


def build_run(
    setting: Setting, meshcat: Meshcat | None = None
) -> tuple[PolicyRun, Scenario | None]:
    """A diagram that plays a setting's episodes, and their scenario."""
    decision, goals = _decision(setting)
    scenario = parse_scenario(setting.scenario, "scenario") if setting.scenario else None
    run = PolicyRun(
        decision,
        load_planner(),
        goal_states=goals,
        max_actions=setting.max_actions,
        meshcat=meshcat,
        scenario=scenario,
        solver=setting.solver,
    )
    return run, scenario


@dataclass(frozen=True)
class Crew:
    """Who plays: processes of this machine, or a dask cluster's.

    Attributes:
        workers: processes; one plays in this process.
        cluster: address of a dask scheduler; empty for none.
    """

    workers: int = 1
    cluster: str = ""


Task = tuple[Setting, Job, bool]
"""An episode, and whether all there is to tell of it is wanted."""


def outcomes(tasks: Iterable[Task], crew: Crew) -> Generator[tuple[Task, Outcome], None, None]:
    """Play episodes, which come as they end, in any order; who stops asking stops the playing."""
    if crew.workers == 1 and not crew.cluster:
        for task in tasks:
            yield task, play(*task)
        return
    waiting = iter(tasks)
    with start_workers(crew.workers, crew.cluster) as running:

        def start(task: Task) -> Future[Outcome]:
            return running.executor.submit(play, *task)

        yield from run_jobs(running, lambda: next(waiting, None), start)


class Episodes:
    """Episodes that were played, or are played when they are asked for.

    Attributes:
        rows: what is kept of each, in the order of the jobs.
    """

    def __init__(self, setting: Setting, jobs: Sequence[Job], rows: Sequence[dict]) -> None:
        """Hold what ``rows`` says of ``jobs``."""
        self._setting, self._whole = setting, dict[Job, Played]()
        self._jobs, self.rows = tuple(jobs), tuple(rows)

    def remember(self, job: Job, played: Played | None) -> None:
        """Remember all there is of one."""
        if played is not None:
            self._whole[job] = played

    @staticmethod
    def forget(output: Output) -> None:
        """Remove what an interrupted run would have gone on from: the result says it all."""
        (output.folder / KEPT).unlink(missing_ok=True)

    def whole(self, number: int) -> Played:
        """All there is of the episode of a job; played once more if nobody remembers."""
        job = self._jobs[number]
        if job not in self._whole:
            played = play(self._setting, job, True).played
            assert played is not None
            self._whole[job] = played
        return self._whole[job]


def play_all(
    setting: Setting, jobs: Sequence[Job], whole: int, crew: Crew, output: Output
) -> Episodes:
    """Play every job that an interrupted run has not; what ends is kept at once.

    Args:
        setting: what the episodes have in common.
        jobs: the episodes.
        whole: of how many, the first ones, all there is will be asked for.
        crew: who plays.
        output: where rows are kept until all are done.

    Raises:
        InputError: if what is kept there is of other episodes, or a worker process died.
    """
    identity = {**setting.identity(), "jobs": [list(asdict(job).values()) for job in jobs]}
    kept = KeptRows(output, identity)
    found = {_job(row): row for row in kept.rows}
    left = [(setting, job, i < whole) for i, job in enumerate(jobs) if job not in found]
    wholes = dict[Job, Played | None]()
    with tqdm(desc="episodes", total=len(jobs), initial=len(found), unit="episode") as bar:
        for (_, job, _), outcome in outcomes(left, crew):
            if setting.physics:  # the rest is done sooner than it is kept
                kept.add(outcome.row)
            found[job], wholes[job] = outcome.row, outcome.played
            bar.update()
    episodes = Episodes(setting, jobs, [found[job] for job in jobs])
    for job, played in wholes.items():
        episodes.remember(job, played)
    return episodes


def _job(row: dict[str, Any]) -> Job:
    """The job that a row is of."""
    return Job(row["number"], row["start"], row["repetition"], row["disturbed"])
