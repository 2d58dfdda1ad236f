"""Jobs run ahead of the workers, again where a worker was lost, and each is answered once."""

import math
import os
import subprocess
import sys
from concurrent.futures import Future

import pytest

from experiments.kit.executors import AHEAD, Workers, mapper, run_all, run_jobs, start_workers
from irl.errors import InputError


class LostError(Exception):
    pass


def answered(value):
    future = Future()
    if isinstance(value, Exception):
        future.set_exception(value)
    else:
        future.set_result(value)
    return future


WORKERS = Workers(None, lambda: 3, (LostError,))


def test_a_job_whose_worker_was_lost_is_run_again_and_every_job_answered_once():
    tries = dict.fromkeys(range(10), 0)
    waiting = iter(range(10))
    most = 0
    given = []

    def start(job):
        nonlocal most
        tries[job] += 1
        most = max(most, sum(tries[j] > 0 for j in tries) - len(given))
        return answered(LostError() if job % 4 == 1 and tries[job] < 3 else job**2)

    for job, answer in run_jobs(WORKERS, lambda: next(waiting, None), start):
        given.append(job)
        assert answer == job**2
    assert sorted(given) == list(range(10))
    assert tries == {job: 3 if job % 4 == 1 else 1 for job in range(10)}
    assert most == 3 * AHEAD


def test_what_an_answer_brings_up_is_run_too():
    waiting = [0]
    given = []
    for job, _ in run_jobs(WORKERS, lambda: waiting.pop() if waiting else None, answered):
        given.append(job)
        if job < 5:
            waiting.append(job + 1)
    assert given == list(range(6))


def test_a_dead_process_is_told_in_words():
    told = pytest.raises(InputError, match="--workers: a worker process died")
    with told, start_workers(1) as workers:
        run_all(os._exit, [3], workers.executor.map, "jobs")


@pytest.mark.parametrize("workers", [1, 2])
def test_outcomes_come_in_the_order_of_the_jobs(workers):
    with mapper(workers) as over:
        assert run_all(math.factorial, [5, 3, 4, 0], over, "jobs") == [120, 6, 24, 1]


PARENT = """
import os, time
from experiments.kit.executors import start_workers

with start_workers(1) as workers:
    print(workers.executor.submit(os.getpid).result(), flush=True)
    workers.executor.submit(time.sleep, 600).result()
"""


def test_processes_end_with_the_one_that_started_them():
    parent = subprocess.Popen([sys.executable, "-c", PARENT], stdout=subprocess.PIPE)
    parent.stdout.readline()
    parent.kill()
    parent.communicate(timeout=20)  # the pipe closes when all who write to it have ended
