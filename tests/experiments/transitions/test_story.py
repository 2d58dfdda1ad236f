import csv
import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagrams.trials.counts import transition_entries
from diagrams.trials.database import Campaign, TrialDatabase
from diagrams.trials.plan import Plan
from diagrams.trials.record import Pair, Trial, TrialConfig, TrialRecord
from experiments.kit.command import Output
from experiments.kit.executors import start_workers
from experiments.kit.shipped_data import SHIPPED_TRIALS, load_feasibility
from experiments.transitions import story
from experiments.transitions.campaign import ClassTrials, planned_classes, run_campaign
from experiments.transitions.export import save_tables, task_data
from irl.errors import InputError
from irl.task_data import load_task, save_task
from models.errors import ModelError
from models.task.spaces import GOAL_STATE, LOST, N_ACTIONS, N_FREE, N_STATES, Kind, decode_actions
from models.task.trial_classes import trial_classes

# A short course: what is tested is the bookkeeping.
QUICK = TrialConfig(close_s=0.1, settle_s=0.02, release_s=0.1, rest_limit_s=0.1)
CAMPAIGN = Campaign(QUICK, seed=3, description="d", drake="1")
CLASSES = trial_classes()
SOME = [0, 8, 162]  # a class of grasps, of translations and of drops


def rows(path):
    return [
        (pair, repetition, replace(record, cpu_s=0.0))
        for pair, repetition, record in TrialDatabase(path).trials()
    ]


def run(path, most, workers):
    database = TrialDatabase(path, CAMPAIGN)
    plan = Plan(block=1, least=most, most=most)
    run_campaign(database, CAMPAIGN, ClassTrials(CLASSES, SOME, plan), workers)
    database.close()


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The trials of an uninterrupted run on one worker."""
    path = tmp_path_factory.mktemp("whole") / "t.db"
    with start_workers(1) as workers:
        run(path, 3, workers)
    return rows(path)


def test_every_class_that_the_arm_can_try_is_planned():
    feasible = load_feasibility().mask()
    planned = planned_classes(CLASSES, feasible)
    assert set(planned) <= set(range(CLASSES.n_classes))
    everything = transition_entries(
        feasible, [Trial(tried(n), 0, TrialRecord("free")) for n in planned], CLASSES
    )
    assert not (everything.evidence == 2).any()


def test_resumed_and_parallel_runs_give_the_rows_of_an_uninterrupted_one(tmp_path, whole):
    assert len(whole) == 9
    with start_workers(2) as workers:
        run(tmp_path / "parts.db", 1, workers)
        run(tmp_path / "parts.db", 3, workers)
    assert rows(tmp_path / "parts.db") == whole


def test_a_cluster_gives_the_rows_of_one_process_though_its_workers_die(tmp_path, whole):
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=50
        ) as cluster,
        start_workers(1, cluster.scheduler_address) as workers,
    ):
        run(tmp_path / "part.db", 1, workers)
        os.kill(cluster.workers[0].pid, signal.SIGKILL)
        run(tmp_path / "part.db", 3, workers)
    assert rows(tmp_path / "part.db") == whole


def test_workers_that_come_to_a_cluster_later_are_counted():
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=0, processes=False, threads_per_worker=1, dashboard_address=":0"
        ) as cluster,
        start_workers(1, cluster.scheduler_address) as workers,
    ):
        assert workers.count() == 1  # one is hoped for
        cluster.scale(3)
        deadline = time.monotonic() + 30
        while workers.count() < 3:
            assert time.monotonic() < deadline
            time.sleep(0.1)


def test_a_cluster_that_does_not_answer_is_named():
    pytest.importorskip("distributed")
    with (
        pytest.raises(InputError, match=r"--cluster tcp://127\.0\.0\.1:9"),
        start_workers(1, "tcp://127.0.0.1:9"),
    ):
        pass


def tried(number, repetition=0):
    return Pair(*(int(part) for part in CLASSES.tried(number, repetition)))


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """Task data and tables of a campaign in which rotations were not tried."""
    folder = tmp_path_factory.mktemp("export")
    database = TrialDatabase(folder / "t.db", CAMPAIGN)
    feasible = load_feasibility().mask()
    for number in planned_classes(CLASSES, feasible):
        if CLASSES.kind(number) != Kind.ROTATE:
            held = CLASSES.kind(number) != Kind.DROP
            record = TrialRecord("held", N_FREE) if held else TrialRecord("free", 0)
            database.add(tried(number), 0, record)
    entries = transition_entries(feasible, database.trials(), CLASSES)
    save_task(task_data(database, entries), folder / "task")
    save_tables(entries, Output(folder / "out", None))
    return folder


def test_exported_task_data_say_what_is_measured_and_what_is_estimated(exported):
    task = load_task(exported / "task")
    assert (task.n_states, task.n_actions) == (N_STATES + 1, N_ACTIONS)
    assert task.goal_states.tolist() == [GOAL_STATE]
    assert task.fixed_vr == {LOST: -1.0}
    assert np.array_equal(task.model.mask, load_feasibility().mask())
    kind = decode_actions(task.transitions.action).kind
    estimated = task.transitions.evidence == 2
    assert np.array_equal(estimated, kind == Kind.ROTATE)
    assert (task.transitions.count[~estimated] > 0).all()
    assert task.provenance["campaign"]["seed"] == 3


def test_the_thesis_tables_hold_the_same_model(exported):
    task = load_task(exported / "task")
    model, counts, successors = (
        json.loads((exported / "out" / f"{name}.json").read_text())
        for name in ("transition_model", "pair_counts", "next_states")
    )
    t = task.transitions
    assert len(model) == t.state.size
    for row in range(0, t.state.size, 50_000):
        pair = f"{t.state[row]}, {t.action[row]}"
        assert model[f"{pair}, {t.next_state[row]}"] == t.probability[row]
        assert t.next_state[row] in successors[pair]
        assert counts[pair] == (0 if t.evidence[row] == 2 else 1)
    with (exported / "out" / "transitions.csv").open() as file:
        first = next(csv.DictReader(file))
    assert first["evidence"] == "kernel"
    # One trial of one: Wilson's interval is wide.
    assert 0.2 < float(first["low"]) < 0.21 and float(first["high"]) == 1.0


def command(folder, *arguments):
    return [
        *(sys.executable, "-m", "experiments.transitions", *arguments),
        *("--database", str(folder / "none.db"), "--out", str(folder / "out")),
    ]


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["status"], "none.db"),
        (["run", "--workers", "0"], "--workers"),
        (["run", "--plan.least", "0"], "least"),
        (["run", "--hours", "-1"], "--hours"),
        (["run", "--trial.time-step", "-1"], "--trial.time-step"),
    ],
)
def test_mistakes_are_told_in_one_line_and_leave_nothing(tmp_path, arguments, word):
    done = subprocess.run(
        command(tmp_path, *arguments), capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert word in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_export_would_not_overwrite_is_refused_before_the_work(refused, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    # There is no such database: who looked at it first would say so.
    told = refused(story, "export", "--database", tmp_path / "none.db", "--to", tmp_path)
    assert told.startswith(f"error: --to: {tmp_path}: exists and is not a task data directory")
    same = tmp_path / "refused"
    told = refused(story, "export", "--database", tmp_path / "none.db", "--to", same)
    assert told.startswith("error: --to: is the folder of --out")
    nowhere = ["--to", tmp_path / "task", "--archive", tmp_path / "no" / "trials.db"]
    assert "--archive: " in refused(story, "export", "--database", tmp_path / "none.db", *nowhere)


def test_status_shows_the_shipped_trials_where_none_were_run(tmp_path):
    def status(*options):
        return subprocess.run(
            [sys.executable, "-m", "experiments.transitions", "status", "--out", "out", *options],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": str(Path.cwd())},
            capture_output=True,
            text=True,
            check=False,
        )

    done = status()
    assert done.returncode == 0, done.stderr
    first = done.stdout.splitlines()[0]
    assert "out/transitions/trials.db is missing" in first and str(SHIPPED_TRIALS) in first
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert result["trials"] > 0 and result["estimated"] == 0

    # Whoever names a file wants that one.
    named = status("--database", "out/transitions/trials.db")
    assert named.returncode == 2
    assert named.stderr.startswith("error: out/transitions/trials.db: no such trial database")


QUICK_RUN = (
    *("run", "--workers", "1", "--plan.block", "1", "--plan.least", "1", "--plan.most", "1"),
    *("--trial.close-s", "0.05", "--trial.settle-s", "0.01", "--trial.release-s", "0.05"),
    *("--trial.rest-limit-s", "0.05"),
)


def runs(pid):
    status = Path(f"/proc/{pid}/status")
    return status.exists() and "\nState:\tZ" not in status.read_text()


def test_workers_end_with_a_driver_that_is_killed(tmp_path):
    script = (
        "import time\n"
        "from experiments.kit.executors import start_workers\n"
        "if __name__ == '__main__':\n"
        "    with start_workers(2) as workers:\n"
        "        for future in [workers.executor.submit(time.sleep, 0.1) for _ in range(4)]:\n"
        "            future.result()\n"
        "        print(*workers.executor._processes, flush=True)\n"
        "        time.sleep(60)\n"
    )
    (tmp_path / "driver.py").write_text(script)
    process = subprocess.Popen(
        [sys.executable, str(tmp_path / "driver.py")],
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": str(Path.cwd())},
    )
    pids = [int(pid) for pid in process.stdout.readline().split()]
    assert len(pids) == 2 and all(map(runs, pids))
    process.kill()
    process.wait()
    process.stdout.close()
    deadline = time.monotonic() + 20
    while any(map(runs, pids)):
        assert time.monotonic() < deadline
        time.sleep(0.1)


def test_a_killed_run_keeps_what_it_committed_and_goes_on(tmp_path):
    database = tmp_path / "none.db"
    process = subprocess.Popen(
        command(tmp_path, *QUICK_RUN), stderr=subprocess.DEVNULL, start_new_session=True
    )
    deadline = time.monotonic() + 120
    before = []
    while not before and time.monotonic() < deadline:
        time.sleep(0.2)
        # Missing at first, then without a campaign.
        with suppress(ModelError):
            before = rows(database)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    kept = rows(database)
    assert kept[: len(before)] and len(kept) == len({row[:2] for row in kept})

    # Room for a few trials only, as on a full disk: told in one line, what was there is kept.
    limit = database.stat().st_size + 100_000
    script = (
        "import resource, runpy, sys;"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}));"
        "sys.argv[0] = 'transitions';"
        "runpy.run_module('experiments.transitions', run_name='__main__')"
    )
    full = subprocess.run(
        [sys.executable, "-c", script, *command(tmp_path, *QUICK_RUN)[3:]],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert full.returncode == 2
    assert "none.db" in full.stderr.splitlines()[-1]
    assert set(map(str, kept)) <= set(map(str, rows(database)))
