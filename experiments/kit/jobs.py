"""Jobs whose rows are kept as they end, so that a command resumes, on any number of processes."""

import os
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from tqdm import tqdm

from experiments.kit.executors import run_jobs, start_workers
from experiments.kit.kept_rows import KeptRows

Job = TypeVar("Job", bound=tuple)
"""Plain values, which JSON can hold."""


def rows_of(
    jobs: Sequence[Job],
    work: Callable[[Job], Any],
    kept: KeptRows,
    *,
    workers: int,
    cluster: str = "",
    unit: str = "run",
) -> list[Any]:
    """What ``work`` gives for each job, in the jobs' order; what was kept is not done again.

    Args:
        jobs: all distinct.
        work: a function that processes can be sent, from a job to what JSON can hold.
        kept: what an interrupted run left, and where each further answer goes.
        workers: processes.
        cluster: address of a dask scheduler in their place.
        unit: what the progress bar counts.
    """
    # The matrices are small: a second thread would only get in another worker's way.
    os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"
    done = {tuple(each["job"]): each["outcome"] for each in kept.rows}
    left = [job for job in jobs if job not in done]
    with tqdm(total=len(jobs), initial=len(jobs) - len(left), unit=unit) as bar:
        if not left:
            return [done[job] for job in jobs]
        missing = iter(left)
        with start_workers(workers, cluster) as running:
            for job, outcome in run_jobs(
                running,
                lambda: next(missing, None),
                lambda job: running.executor.submit(work, job),
            ):
                kept.add({"job": list(job), "outcome": outcome})
                done[job] = outcome
                bar.update()
    return [done[job] for job in jobs]
