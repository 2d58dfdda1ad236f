"""A policy played in full physics, in a process of its own that a teacher may stop and correct.

Before each decision the process asks what to do, and waits: a policy that is paused stands still
between two actions, without a reset, and goes on from there.

What it says: ``("posture", q, width, R_WO, p_WO)`` of each picture, ``("decides", state)``,
``("step", state, action, next_state, failure)``, ``("over", verdict, success)``, or
``("fault", line)``. What it is told: ``(start, seed, q, goals)`` to begin an episode, and to each
decision an action, −1 for the policy's own, or None to stop.
"""

import logging
import time
from multiprocessing.connection import Connection

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context

from diagrams.decisions import Correctable, Forecast
from diagrams.faults import SimulatorFault, first_line, simulating
from diagrams.policy_controller import SETTLE, Episode, Verdict
from diagrams.policy_run import TIME_LIMIT, PolicyRun, start_pose
from diagrams.state_view import SPEED
from diagrams.station import FRAME
from experiments.kit.shipped_data import load_planner
from irl.policy import Policy
from models.scenes.parsing import CUBE

MAX_ACTIONS = 30
"""After so many actions an episode ends, corrections included."""
_BEFORE = 2.5 * FRAME
"""From the question what to do to the decision: the looks at an episode are a picture apart [s]."""


def work(link: Connection) -> None:
    """Play what is asked for, until nobody is there any more."""
    logging.getLogger("drake").setLevel(logging.WARNING)
    planner = load_planner()
    while True:
        start, seed, q, goals = link.recv()
        policy = Policy.from_q(q, np.isfinite(q))
        decision = Correctable(Forecast(policy, goals))
        run = PolicyRun(decision, planner, goal_states=goals, max_actions=MAX_ACTIONS)
        Play(run, link).run(int(start), np.random.default_rng(seed))


class Play:
    """One episode."""

    def __init__(self, run: PolicyRun, link: Connection) -> None:
        """Play on a diagram, and say so."""
        self._run, self._link = run, link

    def run(self, start: int, rng: np.random.Generator) -> None:
        """Place the cube in a free state, and act until the episode ends or is stopped."""
        run = self._run
        simulator = Simulator(run.diagram)
        root = simulator.get_mutable_context()
        run.station.initialize(root, X_WO=start_pose(start, rng))
        controller = run.controller.GetMyMutableContextFromRoot(root)
        executor = run.executor.GetMyContextFromRoot(root)
        told = run.controller.GetInputPort("told")
        told.FixValue(controller, [-1.0])
        asked, said, began = -1, 0, time.monotonic()
        while root.get_time() < TIME_LIMIT:
            try:
                with simulating():
                    simulator.AdvanceTo(root.get_time() + FRAME)
            except SimulatorFault as error:
                self._link.send(("fault", first_line(error.text)))
                return
            self._show(root)
            episode = run.controller.episode(controller)
            for step in episode.steps[said:]:
                self._link.send(("step", step.state, step.action, step.next_state, step.failure))
            said = len(episode.steps)
            if episode.verdict != Verdict.RUNNING:
                self._link.send(("over", str(episode.verdict), episode.verdict == Verdict.GOAL))
                return
            finished = run.executor.execution(executor).finished
            if episode.sequence != asked and finished and self._is_due(root.get_time(), episode):
                asked = episode.sequence
                state = int(
                    run.station.GetOutputPort("task.state").Eval(
                        run.station.GetMyContextFromRoot(root)
                    )[0]
                )
                self._link.send(("decides", state))
                before = time.monotonic()
                action = self._link.recv()
                began += time.monotonic() - before
                if action is None:
                    return
                told.FixValue(controller, [float(action)])
            # As fast as a preview, or as fast as it can be simulated.
            time.sleep(max(0.0, began + root.get_time() / SPEED - time.monotonic()))
        self._link.send(("over", "out of time", False))

    @staticmethod
    def _is_due(now: float, episode: Episode) -> bool:
        """Whether the motion is over and the decision near."""
        return episode.finished_at >= 0.0 and now >= episode.finished_at + SETTLE - _BEFORE

    def _show(self, root: Context) -> None:
        station = self._run.station
        context = station.GetMyContextFromRoot(root)
        q = station.GetOutputPort("arm.position_measured").Eval(context)
        width = station.GetOutputPort("gripper.position_measured").Eval(context)[0]
        X_WO = station.plant.GetBodyByName(CUBE).EvalPoseInWorld(
            station.plant.GetMyContextFromRoot(root)
        )
        self._link.send(("posture", q, float(width), X_WO.rotation().matrix(), X_WO.translation()))
