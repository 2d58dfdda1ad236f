"""Where trials run: processes of this machine, or a dask cluster, behind one interface."""

import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from threading import Thread

from irl.errors import InputError

CONNECT_S = 10
"""How long a cluster may take to answer [s]."""
ASK_AGAIN_S = 2.0
"""How long the number of a cluster's workers is taken for known [s]."""


@dataclass(frozen=True)
class Workers:
    """A running executor.

    Attributes:
        executor: takes the trials.
        count: tells how many run at once; on a cluster they come and go.
        lost: exceptions of a future whose worker died; its trial may be submitted again.
    """

    executor: Executor
    count: Callable[[], int]
    lost: tuple[type[BaseException], ...] = ()


@contextmanager
def start_workers(workers: int, cluster: str = "") -> Iterator[Workers]:
    """Run trials in spawned processes, or on the dask cluster at an address.

    Args:
        workers: processes, without a cluster.
        cluster: address of a dask scheduler, such as ``tcp://host:8786``; empty for none.

    Raises:
        InputError: if dask is not installed, or no scheduler answers.
    """
    if cluster:
        with _dask(cluster) as running:
            yield running
        return
    # Spawned: a simulator's threads and a forked process do not agree.
    with ProcessPoolExecutor(
        workers, mp_context=get_context("spawn"), initializer=_end_with_parent
    ) as pool:
        yield Workers(pool, lambda: workers)


def _end_with_parent() -> None:
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
        raise InputError(
            "--cluster: needs dask.distributed; pip install 'active-advice-irl[cluster]'"
        ) from error
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(f"--cluster {address}: no dask scheduler answers there") from error
    with client:
        # Each trial is its own, though another of the same arguments would give the same.
        executor = client.get_executor(pure=False)
        known = [0.0, 1]  # when to ask again, and what the answer was

        def count() -> int:
            if time.monotonic() >= known[0]:
                known[:] = time.monotonic() + ASK_AGAIN_S, max(1, sum(client.ncores().values()))
            return int(known[1])

        yield Workers(executor, count, (KilledWorker,))
