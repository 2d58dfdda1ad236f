"""Where the time of an episode in physics goes: deciding, planning, and all that simulates."""

from collections.abc import Callable
from time import process_time
from typing import Any

import numpy as np

from diagrams.decisions import Forecast
from diagrams.policy_run import PolicyRun
from experiments.bench.comparison import Peers, Row
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK, load_planner
from experiments.simulate.episodes import draw_starts
from irl.demonstrators import OracleDemonstrator
from irl.policy import Policy
from irl.task_data import TaskData

EPISODES = 20


class Timed:
    """Something with one of its methods timed.

    Attributes:
        seconds: processor time spent in that method so far [s].
    """

    def __init__(self, inner: Any, method: str) -> None:
        """Time ``method`` of ``inner``, which this stands for otherwise."""
        self._inner, self._method, self.seconds = inner, method, 0.0

    def __getattr__(self, name: str) -> Any:
        """Whatever the other thing has."""
        value = getattr(self._inner, name)
        return self._timed(value) if name == self._method else value

    def _timed(self, work: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*given: Any, **named: Any) -> Any:
            began = process_time()
            try:
                return work(*given, **named)
            finally:
                self.seconds += process_time() - began

        return timed


def best_policy(task: TaskData) -> Policy:
    """A policy that knows the reward."""
    mind = OracleDemonstrator(task.model, task.goal_states, task.gamma, surprise=0.5)
    q = np.asarray(mind.optimal_actions, dtype=float)
    return Policy.from_q(q, task.model.mask, task_hash=task.task_hash)


def rows(peers: Peers, seed: int) -> list[Row]:
    """Processor time of episodes beside the time that they simulate."""
    del peers
    task = load_robot_task(SHIPPED_TASK)
    decision = Timed(Forecast(best_policy(task), task.goal_states), "choose")
    planner = Timed(load_planner(), "plan")
    run = PolicyRun(decision, planner, goal_states=task.goal_states)  # type: ignore[arg-type]
    starts = draw_starts(task, EPISODES, seed)
    simulated, spent, actions = 0.0, 0.0, 0
    for number, start in enumerate(starts):
        began = process_time()
        played = run.play(int(start), np.random.default_rng([seed, number]))
        spent += process_time() - began
        simulated += played.seconds
        actions += len(played.episode.steps)
    shares = {"deciding": decision.seconds / spent, "planning": planner.seconds / spent}
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
                "simulating_and_watching": 1.0 - sum(shares.values()),
            },
        )
    ]
