import itertools

import numpy as np
import pytest

from diagrams.trials.plan import Plan, Queue, interval_width, outcome_label
from diagrams.trials.record import Outcome, Pair, TrialRecord
from irl.metrics import wilson_interval
from models.errors import ModelError
from models.task.spaces import Action, Kind, State

PLAN = Plan(width=0.25, block=4, least=8, most=24)


def test_the_width_is_that_of_wilsons_interval():
    low, high = wilson_interval(7, 10)
    assert interval_width("aaaaaaabbc") == pytest.approx(high - low)
    assert interval_width("") == 1.0


def run(queue, outcome, at_once=1):
    """Work the queue off, several trials on their way, ended in a scrambled order."""
    rng = np.random.default_rng(at_once)
    running, done = [], {}
    while True:
        while len(running) < at_once and (job := queue.next()):
            running.append(job)
        if not running:
            return done
        number, repetition = running.pop(int(rng.integers(len(running))))
        assert (number, repetition) not in done
        done[number, repetition] = outcome(number, repetition)
        queue.add(number, repetition, done[number, repetition])


def toss(number, repetition):
    """Class 0 always ends alike, class 1 nearly so, class 2 is a coin."""
    share = (1.0, 0.9, 0.5)[number]
    return np.random.default_rng([number, repetition]).random() < share


def test_what_is_sure_needs_few_trials_and_what_is_not_gets_most():
    done = run(Queue(PLAN, range(3)), toss)
    trials = [sum(number == n for number, _ in done) for n in range(3)]
    assert trials[0] == 12  # the first block at which 12 of 12 alike are sure enough
    assert trials[0] <= trials[1] <= trials[2] == PLAN.most


@pytest.mark.parametrize("at_once", [2, 4, 9])
def test_a_finished_campaign_holds_the_same_trials_in_whatever_order_they_ended(at_once):
    assert run(Queue(PLAN, range(3)), toss, at_once) == run(Queue(PLAN, range(3)), toss)


@pytest.mark.parametrize("kept", range(0, 40, 7))
def test_a_campaign_goes_on_from_any_part_of_its_trials(kept):
    whole = run(Queue(PLAN, range(3)), toss, at_once=4)
    queue = Queue(PLAN, range(3))
    some = dict(itertools.islice(whole.items(), kept))
    for (number, repetition), label in some.items():
        queue.add(number, repetition, label)
    assert queue.done == len(some)
    assert {**some, **run(queue, toss, at_once=3)} == whole
    assert queue.done == queue.wanted == len(whole)


def test_classes_never_tried_come_first_then_the_least_known():
    queue = Queue(PLAN, range(3))
    assert [queue.next()[0] for _ in range(3)] == [0, 1, 2]
    for repetition, label in enumerate("aaaaaa"):
        queue.add(0, repetition, label)
    for repetition, label in enumerate("ababab"):
        queue.add(1, repetition, label)
    queue.add(2, 0, "a")
    assert queue.next()[0] == 2


def test_outcomes_differ_by_what_becomes_of_the_cube_and_not_by_a_millimetre():
    pair = Pair(State(8, 0, 10).index, Action(Kind.DROP).index)
    flat = TrialRecord(Outcome.FREE, displacement=(0.002, -0.001, -0.03))
    near = TrialRecord(Outcome.FREE, displacement=(0.0, 0.0, -0.03), turn=(0.0, 0.0, 0.1))
    tipped = TrialRecord(Outcome.FREE, turn=(np.pi / 2, 0.0, 0.0))
    away = TrialRecord(Outcome.FREE, displacement=(0.04, 0.0, -0.03))
    labels = [outcome_label(pair, record) for record in (flat, near, tipped, away)]
    assert labels[0] == labels[1]
    assert len(set(labels)) == 3


@pytest.mark.parametrize(
    "wrong", [{"width": 0.0}, {"block": 0}, {"least": 3}, {"most": 8}], ids=lambda w: next(iter(w))
)
def test_plans_that_cannot_be_are_named(wrong):
    with pytest.raises(ModelError, match=next(iter(wrong))):
        Plan(**wrong)
