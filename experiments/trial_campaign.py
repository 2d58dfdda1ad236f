"""Run a campaign of trials: what the plan wants and the database does not hold yet."""

import time
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool

import numpy as np
from tqdm import tqdm

from diagrams.trial_database import TrialDatabase
from diagrams.trial_plan import Plan, Queue, outcome_label
from diagrams.trial_record import Pair, TrialConfig, TrialRecord
from diagrams.trial_worker import work
from experiments.executors import Workers
from irl.errors import InputError
from models.task.spaces import N_STATES
from models.task.trial_classes import TrialClasses

AHEAD = 2
"""Trials submitted per worker: one runs, one waits, so that none idles and little is lost."""


def planned_classes(classes: TrialClasses, feasible: np.ndarray) -> list[int]:
    """Classes with a feasible member, which are the ones worth trying.

    Args:
        classes: which pairs share trials.
        feasible: bool ``[N_STATES or more, N_ACTIONS]``.
    """
    return np.unique(classes.number(*np.nonzero(feasible[:N_STATES]))).tolist()


def run_campaign(
    database: TrialDatabase,
    classes: TrialClasses,
    numbers: list[int],
    plan: Plan,
    trial: TrialConfig,
    seed: int,
    workers: Workers,
    hours: float | None = None,
) -> None:
    """Run trials until the plan is fulfilled or the time is over, committing each as it ends.

    Args:
        database: holds what was done, and takes in what is.
        classes: which pairs share trials.
        numbers: the classes to try.
        plan: how many trials each needs.
        trial: course and noise.
        seed: of the campaign.
        workers: where trials run.
        hours: longest time to submit trials for; None for as long as it takes.

    Raises:
        InputError: if a worker process died.
        ModelError: if a trial cannot be written.
    """
    deadline = np.inf if hours is None else time.monotonic() + 3600.0 * hours
    queue = Queue(plan, numbers)
    for pair, repetition, record in database.trials():
        queue.add(
            int(classes.number(pair.state, pair.action)), repetition, outcome_label(pair, record)
        )

    running: dict[Future[TrialRecord], tuple[int, int]] = {}

    def submit(number: int, repetition: int) -> None:
        pair = Pair(*(int(part) for part in classes.tried(number, repetition)))
        running[workers.executor.submit(work, trial, seed, pair, repetition)] = number, repetition

    with tqdm(total=queue.wanted, initial=queue.done, unit="trial", desc="trials") as bar:
        while True:
            while len(running) < AHEAD * workers.number and time.monotonic() < deadline:
                job = queue.next()
                if job is None:
                    break
                submit(*job)
            if not running:
                return
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                number, repetition = running.pop(future)
                try:
                    record = future.result()
                except workers.lost:
                    submit(number, repetition)
                    continue
                except BrokenProcessPool as error:
                    raise InputError(
                        "--workers: a worker process died, perhaps for want of memory; nothing "
                        "committed is lost, and the same command goes on"
                    ) from error
                pair = Pair(*(int(part) for part in classes.tried(number, repetition)))
                database.add(pair, repetition, record)
                queue.add(number, repetition, outcome_label(pair, record))
            bar.total, bar.n = queue.wanted, queue.done
            bar.refresh()
