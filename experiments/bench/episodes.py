"""Where the time of an episode in physics goes: deciding, planning, watching, and simulating."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from time import process_time
from typing import Any

import numpy as np

from diagrams.action_executor import ActionExecutor
from diagrams.decisions import Forecast
from diagrams.monitor import ContactMonitor
from diagrams.policy_run import PolicyRun
from experiments.bench.comparison import Peers, Row
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK, load_planner
from experiments.simulate.episodes import draw_starts
from irl.demonstrators import OracleDemonstrator
from irl.policy import Policy
from irl.task_data import TaskData

EPISODES = 20


@dataclass
class Stopwatch:
    """Processor time that was spent in something so far [s]."""

    seconds: float = 0.0


@contextmanager
def timed(owner: type, method: str) -> Iterator[Stopwatch]:
    """Time a method of all objects of a class that are made meanwhile."""
    watch, work = Stopwatch(), getattr(owner, method)

    @wraps(work)
    def timed_work(*given: Any, **named: Any) -> Any:
        began = process_time()
        try:
            return work(*given, **named)
        finally:
            watch.seconds += process_time() - began

    setattr(owner, method, timed_work)
    try:
        yield watch
    finally:
        setattr(owner, method, work)


def best_policy(task: TaskData) -> Policy:
    """A policy that knows the reward."""
    mind = OracleDemonstrator(task.model, task.goal_states, task.gamma, surprise=0.5)
    q = np.asarray(mind.optimal_actions, dtype=float)
    return Policy.from_q(q, task.model.mask, task_hash=task.task_hash)


def rows(peers: Peers, seed: int) -> list[Row]:
    """Processor time of episodes beside the time that they simulate.

    Watching is what the executor does while an action is under way, waiting for a joint that lags
    included; monitoring is what tells afterwards how deep contacts were.
    """
    del peers
    task, planner = load_robot_task(SHIPPED_TASK), load_planner()
    starts = draw_starts(task, EPISODES, seed)
    simulated, spent, actions = 0.0, 0.0, 0
    with (
        timed(Forecast, "choose") as deciding,
        timed(type(planner), "plan") as planning,
        timed(ActionExecutor, "_go_on") as watching,
        timed(ContactMonitor, "_update") as monitoring,
    ):
        decision = Forecast(best_policy(task), task.goal_states)
        run = PolicyRun(decision, planner, goal_states=task.goal_states)
        for number, start in enumerate(starts):
            began = process_time()
            played = run.play(int(start), np.random.default_rng([seed, number]))
            spent += process_time() - began
            simulated += played.seconds
            actions += len(played.episode.steps)
    shares = {
        "deciding": deciding.seconds / spent,
        "planning": planning.seconds / spent,
        "watching": watching.seconds / spent,
        "monitoring": monitoring.seconds / spent,
    }
    return [
        Row(
            f"{EPISODES} episodes in physics, processor time",
            spent,
            "the time that they simulate,",
            simulated,
            wanted=4.0,
            details={
                "actions": actions,
                **shares,
                "simulating": 1.0 - sum(shares.values()),
            },
        )
    ]
