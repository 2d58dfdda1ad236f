"""Where jobs run: processes of this machine, or a dask cluster, behind one interface.

Every story's processes are started here. They are spawned, since a simulator's threads and a
forked process do not agree, and they end with the process that started them, however it ends.
"""

import os
import signal
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor
from concurrent.futures import wait as wait_for
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import parent_process, resource_tracker
from multiprocessing.connection import wait
from multiprocessing.context import SpawnContext, SpawnProcess
from threading import Thread
from typing import Any, Protocol, TypeVar

from tqdm import tqdm

from irl.errors import InputError

Job = TypeVar("Job")
Outcome = TypeVar("Outcome")

MOST_WORKERS = 1000
"""Processes that a command may start here; more are asked of a cluster."""
AHEAD = 2
"""Jobs submitted per worker: one runs, one waits, so that none idles and little is lost."""
CONNECT_S = 10
"""How long a cluster may take to answer [s]."""
ASK_AGAIN_S = 2.0
"""How long the number of a cluster's workers is taken for known [s]."""


@dataclass(frozen=True)
class Workers:
    """A running executor.

    Attributes:
        executor: takes the jobs.
        count: tells how many run at once; on a cluster they come and go.
        lost: exceptions of a future whose worker died; its job may be submitted again.
    """

    executor: Executor
    count: Callable[[], int]
    lost: tuple[type[BaseException], ...] = ()


@contextmanager
def start_workers(workers: int, cluster: str = "") -> Iterator[Workers]:
    """Run jobs in spawned processes, or on the dask cluster at an address.

    Args:
        workers: processes, without a cluster.
        cluster: address of a dask scheduler, such as ``tcp://host:8786``; empty for none.

    Raises:
        InputError: if dask is not installed, no scheduler answers, or a process died.
    """
    if cluster:
        with _dask(cluster) as running:
            yield running
        return
    context = _Undisturbed()
    with ProcessPoolExecutor(workers, mp_context=context, initializer=end_with_parent) as pool:
        try:
            yield Workers(pool, lambda: workers)
        except BaseException as error:
            context.end()  # nobody waits for what they are at
            if not isinstance(error, BrokenProcessPool):
                raise
            raise InputError(
                "a worker process died, perhaps for lack of memory; give fewer workers to the "
                "same command, which keeps what was saved",
                place="--workers",
            ) from error


class Mapper(Protocol):
    """Applies a function to every job, in order, as the built-in ``map``."""

    def __call__(
        self, function: Callable[[Job], Outcome], jobs: Iterable[Job], /
    ) -> Iterable[Outcome]:
        """Yield each job's outcome."""
        ...


@contextmanager
def mapper(workers: int) -> Iterator[Mapper]:
    """``map`` itself for one worker, else the same on spawned processes."""
    if workers == 1:
        yield map
    else:
        with start_workers(workers) as pool:
            yield pool.executor.map


def run_all(
    function: Callable[[Job], Outcome],
    jobs: Sequence[Job],
    over: Mapper,
    name: str,
    unit: str = "run",
) -> list[Outcome]:
    """Apply ``function`` to every job under a progress bar; the outcomes in the jobs' order."""
    return list(tqdm(over(function, jobs), name, len(jobs), unit=unit))


def run_jobs(
    workers: Workers,
    next_job: Callable[[], Job | None],
    start: Callable[[Job], Future[Outcome]],
) -> Iterator[tuple[Job, Outcome]]:
    """Run jobs and give each with its outcome, as they end; again if a job's worker was lost.

    Args:
        workers: where they run.
        next_job: what to run next; None if there is nothing at present, or at all.
        start: submits a job to the executor.
    """
    running: dict[Future[Outcome], Job] = {}
    while True:
        while len(running) < AHEAD * workers.count() and (job := next_job()) is not None:
            running[start(job)] = job
        if not running:
            return
        for future in wait_for(running, return_when=FIRST_COMPLETED).done:
            job = running.pop(future)
            try:
                outcome = future.result()
            except workers.lost:
                running[start(job)] = job
                continue
            yield job, outcome


class WorkerProcess(SpawnProcess):
    """A process that Ctrl-C does not reach, though it does all that share a terminal."""

    def start(self) -> None:
        """Start with the interrupt blocked; what starts inherits that, and never learns of it."""
        resource_tracker.ensure_running()  # would unblock it
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            super().start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Undisturbed(SpawnContext):
    """Spawns processes that only the one that started them ends."""

    def __init__(self) -> None:
        super().__init__()
        self._started: list[WorkerProcess] = []

    def Process(self, *args: Any, **options: Any) -> WorkerProcess:  # type: ignore[override]
        worker = WorkerProcess(*args, **options)
        self._started.append(worker)
        return worker

    def end(self) -> None:
        """End all at once."""
        for worker in self._started:
            if worker.pid is not None:
                worker.kill()


def end_with_parent() -> None:
    """End this process when the one that started it is killed, rather than wait for it forever."""
    parent = parent_process()
    assert parent is not None

    def watch() -> None:
        wait([parent.sentinel])
        os._exit(1)

    Thread(target=watch, daemon=True).start()


@contextmanager
def _dask(address: str) -> Iterator[Workers]:
    try:
        from distributed import Client, KilledWorker  # noqa: PLC0415 - an optional extra
    except ImportError as error:
        raise InputError("--cluster: needs dask.distributed; pip install '.[cluster]'") from error
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(f"--cluster {address}: no dask scheduler answers there") from error
    with client:
        # Each job is its own, though another of the same arguments would give the same.
        executor = client.get_executor(pure=False)
        known = [0.0, 1]  # when to ask again, and what the answer was

        def count() -> int:
            if time.monotonic() >= known[0]:
                known[:] = time.monotonic() + ASK_AGAIN_S, max(1, sum(client.ncores().values()))
            return int(known[1])

        yield Workers(executor, count, (KilledWorker,))
