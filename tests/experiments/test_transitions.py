import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from diagrams.transition_counts import transition_entries
from diagrams.trial_database import Campaign, TrialDatabase
from diagrams.trial_record import TrialConfig, TrialRecord
from experiments.robot_data import load_feasibility
from experiments.transitions import Run, planned_pairs, run_trials, task_data
from irl.task_data import load_task, save_task
from models.task.spaces import GOAL_STATE, LOST, N_ACTIONS, N_STATES, Kind
from models.task.symmetry import symmetry_classes

# A short course: what is tested is the bookkeeping.
QUICK = TrialConfig(close_s=0.1, settle_s=0.02, release_s=0.1, rest_limit_s=0.1)
CAMPAIGN = Campaign(QUICK, seed=3, description="d", drake="1")


def rows(database):
    return [
        (pair, repetition, replace(record, cpu_s=0.0))
        for pair, repetition, record in database.trials()
    ]


def run(path, repetitions, workers):
    database = TrialDatabase(path, CAMPAIGN)
    run_trials(
        database,
        planned_pairs()[:3],
        Run(repetitions=repetitions, workers=workers, trial=QUICK, seed=3),
    )
    return database


def test_plans_one_pair_for_every_class_that_the_arm_can_try():
    pairs = planned_pairs()
    assert len(set(pairs)) == len(pairs)
    classes = symmetry_classes()
    tried = {(p.kind, int(classes.pair_class[p.orientation, p.gripper]), p.layer) for p in pairs}
    drops = {(Kind.DROP, c, layer) for c in range(classes.n_classes) for layer in (0, 1)}
    assert drops <= tried
    # Horizontal hands would touch the table.
    assert all(p.gripper >= 5 for p in pairs if p.kind == Kind.GRASP)


def test_resumed_and_parallel_runs_give_the_rows_of_an_uninterrupted_one(tmp_path):
    whole = rows(run(tmp_path / "whole.db", repetitions=2, workers=1))
    run(tmp_path / "parts.db", repetitions=1, workers=2).close()
    parts = rows(run(tmp_path / "parts.db", repetitions=2, workers=2))
    assert len(whole) == 6
    assert whole == parts


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    folder = tmp_path_factory.mktemp("export")
    database = TrialDatabase(folder / "t.db", CAMPAIGN)
    for pair in planned_pairs():
        database.add(pair, 0, TrialRecord("held" if pair.kind == Kind.GRASP else "free"))
    feasible = load_feasibility().mask()
    entries = transition_entries(feasible, database.trials(), symmetry_classes())
    save_task(task_data(database, entries), folder / "task")
    return load_task(folder / "task")


def test_exported_task_data_say_what_is_measured_and_what_is_estimated(exported):
    task = exported
    assert (task.n_states, task.n_actions) == (N_STATES + 1, N_ACTIONS)
    assert task.goal_states.tolist() == [GOAL_STATE]
    assert task.fixed_vr == {LOST: -1.0}
    assert np.array_equal(task.model.mask, load_feasibility().mask())
    kind = task.transitions.action // 18
    estimated = task.transitions.evidence == 2
    assert estimated[np.isin(kind, [Kind.TRANSLATE, Kind.ROTATE])].all()
    assert not estimated[np.isin(kind, [Kind.GRASP, Kind.DROP])].any()
    assert (task.transitions.count[~estimated] > 0).all()
    assert task.provenance["campaign"]["seed"] == 3


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["status"], "none.db"),
        (["run", "--workers", "0"], "--workers"),
        (["run", "--repetitions", "0"], "--repetitions"),
        (["run", "--trial.time-step", "-1"], "time_step"),
    ],
)
def test_mistakes_are_told_in_one_line_and_leave_nothing(tmp_path, arguments, word):
    done = subprocess.run(
        [
            *(sys.executable, "-m", "experiments.transitions", *arguments),
            *("--database", str(tmp_path / "none.db"), "--out", str(tmp_path / "out")),
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert word in done.stderr
    assert list(tmp_path.iterdir()) == []
