"""What is shipped follows from itself: the task data from the trials, the trials from a seed."""

import json
from dataclasses import replace

import numpy as np
import pytest

from diagrams.trials.counts import TransitionEntries, transition_entries
from diagrams.trials.database import TrialDatabase
from diagrams.trials.plan import Plan
from diagrams.trials.record import Outcome, TrialConfig
from experiments.kit.shipped_data import SHIPPED_TASK, SHIPPED_TRIALS, load_feasibility
from experiments.transitions.campaign import ClassTrials, planned_classes
from experiments.transitions.options import floating_campaign
from experiments.transitions.worker import work
from irl.task import EVIDENCE
from irl.task_data import load_task
from models.task.spaces import Kind
from models.task.trial_classes import trial_classes

CLASSES = trial_classes()


@pytest.fixture(scope="module")
def database():
    return TrialDatabase(SHIPPED_TRIALS)


@pytest.fixture(scope="module")
def trials(database):
    return list(database.trials())


def test_the_task_data_are_what_the_trials_say(database, trials):
    task = load_task(SHIPPED_TASK)
    entries = transition_entries(load_feasibility().mask(), trials, CLASSES)
    for name in TransitionEntries._fields:
        assert np.array_equal(getattr(task.transitions, name), getattr(entries, name)), name
    assert task.provenance["campaign"] == database.content
    assert task.provenance["trials"] == len(trials)


def test_every_feasible_pair_rests_on_trials():
    task = load_task(SHIPPED_TASK)
    assert np.array_equal(task.model.mask, load_feasibility().mask())
    assert not (task.transitions.evidence == EVIDENCE.index("estimated")).any()
    assert (task.transitions.count > 0).all()


def test_the_trials_are_those_that_the_command_runs_by_default(database, trials):
    ours = floating_campaign(TrialConfig(), seed=0).content()
    assert {**database.content, "drake": ours["drake"]} == ours
    source = ClassTrials(CLASSES, planned_classes(CLASSES, load_feasibility().mask()), Plan())
    for trial in trials:
        source.add(*trial)
    assert source.progress() == (len(trials), len(trials))
    assert source.next() is None
    assert not [trial for trial in trials if trial.record.outcome == Outcome.FAULT]


@pytest.mark.parametrize("kind", list(Kind))
def test_a_trial_run_again_comes_out_the_same(trials, kind):
    campaign = floating_campaign(TrialConfig(), seed=0)
    pair, repetition, stored = next(
        trial for trial in trials if CLASSES.kind(trial.pair.number(CLASSES)) == kind
    )
    again = work(campaign, pair, repetition)
    assert (again.outcome, again.next_state) == (stored.outcome, stored.next_state)
    assert again.noise == stored.noise
    # To the last bit on one kind of processor; mathematical libraries differ between them.
    np.testing.assert_allclose(again.displacement, stored.displacement, atol=1e-4)
    assert replace(again, cpu_s=0.0).fault == ""


def test_the_rows_name_their_seeds(database):
    rows = database._connection.execute("SELECT seed, state, action, repetition FROM trial")
    assert all(json.loads(seed) == [0, *key] for seed, *key in rows)
