"""The same trials under other settings: what changed is counted by class, kind and layer."""

from dataclasses import replace

import numpy as np
import pytest

from diagrams.trials.record import Outcome, Pair, TrialConfig, TrialRecord
from experiments.kit.command import Output
from experiments.transitions.trust.sensitivity import (
    ROTATIONS,
    compare,
    plot_sensitivity,
    print_summary,
    sample_classes,
    summarise,
    variants,
)
from models.task.spaces import Action, Kind, State
from models.task.trial_classes import trial_classes

CLASSES = trial_classes()
DROP = Action(Kind.DROP).index
LOWER, UPPER = (Pair(State(cell, 0, 10).index, DROP) for cell in (8, 9))
LEVEL = TrialRecord(Outcome.FREE)
OVER = replace(LEVEL, turn=(np.pi / 2, 0.0, 0.0), displacement=(0.0, 0.04, 0.0))


def test_variants_differ_from_the_reference_in_one_setting_each():
    trial = TrialConfig(solver="discrete")
    reference, finer, slippery = variants(trial).values()
    assert reference == replace(trial, friction=(0.8, 0.8))
    assert finer == replace(reference, time_step=trial.time_step / 2)
    assert slippery == replace(reference, friction=(0.5, 0.5))


def test_the_finer_variant_of_error_control_has_a_tenth_of_the_errors():
    reference, finer, _ = variants(TrialConfig()).values()
    errors = ("accuracy", "turning_accuracy", "creeping_accuracy", "landing_accuracy")
    assert finer == replace(reference, **{name: getattr(finer, name) for name in errors})
    for name in errors:
        assert getattr(finer, name) == pytest.approx(getattr(reference, name) / 10)


def test_all_classes_take_part_but_for_most_rotations():
    every = range(CLASSES.n_classes)
    drawn = sample_classes(CLASSES, every, np.random.default_rng(0))
    kinds = [CLASSES.kind(number) for number in drawn]
    assert kinds.count(Kind.ROTATE) == ROTATIONS
    assert len(drawn) - ROTATIONS == sum(CLASSES.kind(n) != Kind.ROTATE for n in every)
    assert drawn == sample_classes(CLASSES, every, np.random.default_rng(0))


@pytest.fixture(scope="module")
def rows():
    fault = TrialRecord(Outcome.FAULT)
    tried = {
        "reference": {(UPPER, 0): LEVEL, (UPPER, 1): LEVEL, (LOWER, 0): LEVEL, (LOWER, 1): LEVEL},
        "finer": {(UPPER, 0): LEVEL, (UPPER, 1): OVER, (LOWER, 0): LEVEL, (LOWER, 1): fault},
    }
    return compare(tried, CLASSES)


def test_changes_are_counted_and_faults_left_out(rows, capsys):
    lower, upper = sorted(rows, key=lambda row: row["layer"])
    assert (upper["layer"], upper["trials"], upper["held"], upper["face"]) == ("upper", 2, 0, 1)
    assert upper["orientation"] == 1
    assert upper["drift_change_m"] == pytest.approx(0.04)
    assert (lower["layer"], lower["trials"], lower["face"]) == ("lower", 1, 0)
    total = summarise([*rows, {**upper, "class": 999}])
    assert {row["action"]: (row["classes"], row["trials"], row["face"]) for row in total} == {
        "drop, lower layer": (1, 1, 0),
        "drop, upper layer": (2, 4, 2),
    }
    print_summary(total)
    assert "drop, upper layer" in capsys.readouterr().out


def test_the_picture_is_drawn(rows, tmp_path):
    with Output(tmp_path, None).figure("s.png") as figure:
        plot_sensitivity(figure, rows)
    assert (tmp_path / "s.png").stat().st_size > 5_000
