"""Campaigns under fire: many kills, any number of workers, thousands of trials in one process.

Minutes, so not part of the suite: ``python -m pytest -m soak``.
"""

import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from threading import Event, Thread

import pytest

from diagrams.trials.database import Campaign, TrialDatabase
from diagrams.trials.record import Pair, TrialConfig
from experiments.kit.shipped_data import load_feasibility
from experiments.transitions.campaign import planned_classes
from experiments.transitions.worker import work
from models.task.spaces import Kind
from models.task.trial_classes import trial_classes

pytestmark = pytest.mark.soak

DRIVER_KILLS, WORKER_KILLS = 50, 20
TRIALS_OF_ONE_WORKER = 5000
SHORT = {"close_s": 0.05, "settle_s": 0.01, "release_s": 0.05, "rest_limit_s": 0.05}
COURSE = [
    word for name, s in SHORT.items() for word in (f"--trial.{name.replace('_', '-')}", f"{s}")
]
PLAN = ["--plan.block", "1", "--plan.least", "4", "--plan.most", "4"]


def command(folder, name, *options):
    database = ["--database", str(folder / "t.db"), "--out", str(folder / "out")]
    return [sys.executable, "-m", "experiments.transitions", name, *database, *options]


def rows(folder):
    """Every row, but for what it cost."""
    return [
        (pair, repetition, replace(record, cpu_s=0.0))
        for pair, repetition, record in TrialDatabase(folder / "t.db").trials()
    ]


def finished(folder, *options):
    """Run to the end and export: the rows, and the hash of the task data."""
    run = command(folder, "run", *COURSE, *PLAN, *options)
    subprocess.run(run, check=True, capture_output=True)
    export = command(folder, "export", "--to", str(folder / "task"))
    subprocess.run(export, check=True, capture_output=True)
    result = json.loads((folder / "out" / "result.json").read_text())
    return rows(folder), result["task_hash"]


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    return finished(tmp_path_factory.mktemp("whole"), "--workers", "1")


@pytest.mark.parametrize("workers", ["2", "4"])
def test_any_number_of_workers_gives_the_same(uninterrupted, tmp_path, workers):
    assert finished(tmp_path, "--workers", workers) == uninterrupted


def test_killed_drivers_lose_and_double_nothing(uninterrupted, tmp_path):
    moments = random.Random(0)
    kept = []
    for _ in range(DRIVER_KILLS):
        run = command(tmp_path, "run", *COURSE, *PLAN, "--workers", "2")
        process = subprocess.Popen(run, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        # From the very start to well after the first trials.
        time.sleep(moments.uniform(0.0, 10.0))
        process.send_signal(signal.SIGKILL)
        process.wait()
        there = rows(tmp_path) if (tmp_path / "t.db").exists() and tables(tmp_path) else []
        assert len({row[:2] for row in there}) == len(there)
        known = {row[:2]: row for row in there}
        assert all(known[row[:2]] == row for row in kept)
        kept = there
    print(f"{len(kept)} trials committed in the course of {DRIVER_KILLS} kills")
    assert finished(tmp_path, "--workers", "2") == uninterrupted


def tables(folder):
    try:
        TrialDatabase(folder / "t.db").close()
    except Exception as error:  # a database whose first transaction never came
        assert "holds no campaign" in str(error)
        return False
    return True


def test_killed_workers_of_a_cluster_change_nothing(uninterrupted, tmp_path):
    distributed = pytest.importorskip("distributed")
    moments = random.Random(1)
    killed = []
    over = Event()
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=50
    ) as cluster:

        def kill():
            while len(killed) < WORKER_KILLS and not over.wait(moments.uniform(1.0, 6.0)):
                # A worker that is being restarted is not there, or has no process yet.
                pids = [nanny.pid for nanny in list(cluster.workers.values()) if nanny.pid]
                with contextlib.suppress(IndexError, ProcessLookupError):
                    os.kill(pid := moments.choice(pids), signal.SIGKILL)
                    killed.append(pid)

        killer = Thread(target=kill)
        killer.start()
        try:
            found = finished(tmp_path, "--cluster", cluster.scheduler_address)
        finally:
            over.set()
            killer.join()
    print(f"{len(killed)} workers killed")
    assert found == uninterrupted
    assert len(killed) == WORKER_KILLS


def test_memory_of_a_worker_stays_flat():
    def resident():
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    classes = trial_classes()
    numbers = planned_classes(classes, load_feasibility().mask())
    grasps = [number for number in numbers if classes.kind(number) == Kind.GRASP]
    others = [number for number in numbers if classes.kind(number) != Kind.GRASP]
    campaign = Campaign(TrialConfig(**SHORT), seed=0, description="d", drake="1")
    sizes = []
    for trial in range(TRIALS_OF_ONE_WORKER):
        # Grasps are the shortest; every tenth is another action.
        these, place = (others, trial // 10) if trial % 10 == 9 else (grasps, trial)
        repetition, place = divmod(place, len(these))
        tried = classes.tried(these[place], repetition)
        work(campaign, Pair(int(tried.state), int(tried.action)), repetition)
        if trial % 100 == 99:
            sizes.append(resident() / 2**20)
    print(f"MiB after every 100 trials: {[round(size) for size in sizes]}")
    assert max(sizes) < 1.1 * sizes[0]
