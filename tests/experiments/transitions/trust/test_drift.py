import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from diagrams.gripper_controller import GRIP_FORCE
from diagrams.trials.database import TrialDatabase
from diagrams.trials.record import Pair, TrialConfig, TrialRecord
from experiments.kit.executors import start_workers
from experiments.transitions.options import floating_campaign
from experiments.transitions.trust import drift
from experiments.transitions.trust.drift import compare
from experiments.transitions.trust.elsewhere import start_elsewhere, trial_config
from experiments.transitions.worker import work
from irl.errors import InputError
from models.errors import ModelError
from models.task.spaces import N_FREE
from models.task.trial_classes import trial_classes

CLASSES = trial_classes()
QUICK = TrialConfig(close_s=0.1, settle_s=0.02, release_s=0.1, rest_limit_s=0.1)
BEFORE = TrialRecord("held", N_FREE + 5, displacement=(0.0, 0.0, 0.03))


def tried(number):
    return Pair(*(int(part) for part in CLASSES.tried(number, 0)))


def test_changes_are_counted_by_kind_and_over_all():
    grasp, carry, drop = (tried(number) for number in (0, 8, 162))
    free = replace(BEFORE, outcome="free", next_state=3)
    before = {(grasp, 0): BEFORE, (grasp, 1): BEFORE, (carry, 0): BEFORE, (drop, 0): free}
    before[drop, 1] = free
    after = {
        (grasp, 0): replace(BEFORE, cpu_s=9.0),
        (grasp, 1): replace(free, displacement=(0.0, 0.0, -0.03)),
        (carry, 0): replace(BEFORE, displacement=(0.0006, 0.0008, 0.03), next_state=N_FREE + 6),
        (drop, 0): replace(free, displacement=(0.0, 0.0002, 0.03)),
        (drop, 1): TrialRecord("fault", fault="the solver gave up"),
        (drop, 2): free,
    }
    rows = {row["action"]: row for row in compare(before, after, CLASSES)}
    names = ("trials", "faults", "outcomes", "states", "places", "same_bits")
    assert {action: [row[name] for name in names] for action, row in rows.items()} == {
        "grasp": [2, 0, 1, 1, 1, 1],
        "translate": [1, 0, 0, 1, 1, 0],
        "rotate": [0, 0, 0, 0, 0, 0],
        "drop": [1, 1, 0, 0, 0, 0],
        "all": [4, 1, 1, 2, 2, 1],
    }
    assert rows["all"]["place_change_max_m"] == pytest.approx(0.06)
    assert rows["drop"]["place_change_median_m"] == pytest.approx(0.0002)


def test_another_python_runs_the_same_trials_to_the_bit():
    campaign = floating_campaign(QUICK, 3)
    pairs = [tried(number) for number in (0, 8, 162)]
    with start_elsewhere(Path(sys.executable), 2) as (workers, versions):
        futures = [workers.executor.submit(work, campaign, pair, 1) for pair in pairs]
        there = [replace(future.result(), cpu_s=0.0) for future in futures]
    assert versions["drake"] == campaign.drake
    with start_workers(1) as workers:
        futures = [workers.executor.submit(work, campaign, pair, 1) for pair in pairs]
        assert there == [replace(future.result(), cpu_s=0.0) for future in futures]


def test_a_python_that_runs_no_trial_is_named(tmp_path):
    with (
        pytest.raises(InputError, match=r"--pythons: .*none: does not start"),
        start_elsewhere(tmp_path / "none", 1),
    ):
        pass
    bare = tmp_path / "python"
    bare.write_text(
        "#!/bin/sh\necho \"ModuleNotFoundError: No module named 'pydrake'\" >&2\nexit 1\n"
    )
    bare.chmod(0o755)
    with (
        pytest.raises(InputError, match=r"--pythons: .*no trial runs there .*No module.*pydrake"),
        start_elsewhere(bare, 1),
    ):
        pass


def test_the_sample_runs_here_and_there_by_the_solver_that_every_release_has(tmp_path, monkeypatch):
    monkeypatch.setattr(drift, "planned_classes", lambda *_: [0, 8])
    quick = replace(QUICK, solver="discrete")
    config = drift.Drift(
        (Path(sys.executable),), trial=quick, databases=tmp_path, repetitions=1, workers=1
    )
    assert drift.Drift(()).trial.solver == "discrete"
    result = drift.drift(config, None)
    assert result["trials"] == 2
    assert result["rows"][-1]["same_bits"] == 2
    here = TrialDatabase(tmp_path / "here.db", floating_campaign(quick, 0))
    assert len(list(here.trials())) == 2


def test_what_a_campaign_says_of_its_trials_is_what_they_run_by():
    for trial in (replace(QUICK, solver="discrete"), replace(QUICK, accuracy=1e-3)):
        content = json.loads(json.dumps(floating_campaign(trial, 0).content()))
        assert trial_config(content) == trial
    with pytest.raises(ModelError, match="other settings"):
        trial_config({"trial": {"speed": 3.0}})


def test_where_no_limit_can_be_set_the_file_says_the_same():
    """As under Drake 1.50, which lacks the call: the same trial, to the bit."""
    script = (
        "from pydrake.multibody.tree import JointActuator; del JointActuator.set_effort_limit;"
        "from experiments.transitions.trust import elsewhere; elsewhere._say_limits_in_file();"
        "from experiments.transitions.worker import work;"
        "from tests.experiments.transitions.trust.test_drift import *;"
        "print(replace(work(floating_campaign(TrialConfig(), 3), tried(0), 0), cpu_s=0.0))"
    )
    there = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    here = replace(work(floating_campaign(TrialConfig(), 3), tried(0), 0), cpu_s=0.0)
    assert there.stdout.strip() == str(here)
    assert here.pad_force == pytest.approx(GRIP_FORCE, rel=0.01)
