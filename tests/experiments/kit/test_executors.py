"""Jobs run ahead of the workers, again where a worker was lost, and each is answered once."""

from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool

import pytest

from experiments.kit.executors import AHEAD, Workers, run_jobs
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
    waiting = iter([0])
    with pytest.raises(InputError, match="--workers: a worker process died"):
        list(
            run_jobs(
                WORKERS, lambda: next(waiting, None), lambda _: answered(BrokenProcessPool("x"))
            )
        )
