"""Run trials that a database does not hold yet, and commit each as it ends."""

import time
from collections.abc import Iterable
from concurrent.futures import Future
from typing import Protocol

import numpy as np
from tqdm import tqdm

from diagrams.trials.database import Campaign, TrialDatabase
from diagrams.trials.plan import Plan, Queue, outcome_label
from diagrams.trials.record import Pair, TrialRecord
from experiments.kit.executors import Workers, run_jobs
from experiments.transitions.worker import work
from models.task.spaces import N_STATES
from models.task.trial_classes import TrialClasses


class Source(Protocol):
    """What to try: pairs, each with its repetition."""

    def next(self) -> tuple[Pair, int] | None:
        """Pair and repetition to run next; None if all are done or on their way."""

    def progress(self) -> tuple[int, int]:
        """Trials done, and trials wanted as far as is known."""

    def add(self, pair: Pair, repetition: int, record: TrialRecord) -> None:
        """Take in a trial that is in the database."""


class ClassTrials:
    """Trials of classes, as many as a plan wants of each."""

    def __init__(self, classes: TrialClasses, numbers: Iterable[int], plan: Plan) -> None:
        """Try the classes of these numbers."""
        self._classes = classes
        self._queue = Queue(plan, numbers)

    def next(self) -> tuple[Pair, int] | None:
        """Pair and repetition to run next."""
        job = self._queue.next()
        if job is None:
            return None
        pair = self._classes.tried(*job)
        return Pair(int(pair.state), int(pair.action)), job[1]

    def progress(self) -> tuple[int, int]:
        """Trials done, and trials wanted as far as their outcomes so far tell."""
        return self._queue.done, self._queue.wanted

    def add(self, pair: Pair, repetition: int, record: TrialRecord) -> None:
        """Take in a trial; it may change how many are wanted."""
        self._queue.add(pair.number(self._classes), repetition, outcome_label(pair, record))


class PairTrials:
    """One trial of each of some pairs."""

    def __init__(self, pairs: Iterable[Pair]) -> None:
        """Try these pairs, in this order."""
        self._left = list(pairs)[::-1]
        self._wanted, self._done = len(self._left), 0

    def next(self) -> tuple[Pair, int] | None:
        """Pair to run next."""
        return (self._left.pop(), 0) if self._left else None

    def progress(self) -> tuple[int, int]:
        """Pairs tried, and pairs there are."""
        return self._done, self._wanted

    def add(self, pair: Pair, repetition: int, record: TrialRecord) -> None:
        """Take in a trial, perhaps of an earlier run."""
        del repetition, record
        if pair in self._left:
            self._left.remove(pair)
        self._done += 1


def planned_classes(classes: TrialClasses, feasible: np.ndarray) -> list[int]:
    """Classes with a feasible member, which are the ones worth trying.

    Args:
        classes: which pairs share trials.
        feasible: bool ``[N_STATES or more, N_ACTIONS]``.
    """
    return np.unique(classes.number(*np.nonzero(feasible[:N_STATES]))).tolist()


def run_campaign(
    database: TrialDatabase,
    campaign: Campaign,
    source: Source,
    workers: Workers,
    hours: float | None = None,
) -> None:
    """Run trials until there are as many as wanted or the time is over.

    Args:
        database: holds what was done, and takes in what is.
        campaign: what the trials have in common, the database's own.
        source: what to try.
        workers: where trials run.
        hours: longest time to submit trials for; None for as long as it takes.

    Raises:
        InputError: if a worker process died.
        ModelError: if a trial cannot be written.
    """
    deadline = np.inf if hours is None else time.monotonic() + 3600.0 * hours
    for trial in database.trials():
        source.add(*trial)

    def next_job() -> tuple[Pair, int] | None:
        return source.next() if time.monotonic() < deadline else None

    def start(job: tuple[Pair, int]) -> Future[TrialRecord]:
        return workers.executor.submit(work, campaign, *job)

    done, wanted = source.progress()
    with tqdm(total=wanted, initial=done, unit="trial", desc="trials") as bar:
        for job, record in run_jobs(workers, next_job, start):
            database.add(*job, record)
            source.add(*job, record)
            bar.n, bar.total = source.progress()
            bar.refresh()
