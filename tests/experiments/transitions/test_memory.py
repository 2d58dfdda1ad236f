"""A name that is exact predicts the next turn; one that is halfway off does not."""

import pytest

from diagrams.trials.counts import transition_entries
from experiments.kit.shipped_data import load_feasibility
from experiments.transitions.memory import BINS, print_two_turns, two_turns
from models.task.trial_classes import trial_classes


@pytest.fixture(scope="module")
def rigid():
    """What geometry alone says: no trial, so that only the names can be wrong."""
    return two_turns(transition_entries(load_feasibility().mask(), [], trial_classes()))


def test_an_exact_name_predicts_all_and_half_a_turn_off_less_than_half(rigid, capsys):
    assert rigid.keys() == {*BINS, "all"}
    assert sum(rigid[name]["share"] for name in BINS) == pytest.approx(1.0)
    near, middle, halfway = (rigid[name] for name in BINS)
    assert near["probable"] == pytest.approx(1.0)
    assert near["most_likely"] > middle["most_likely"] > halfway["most_likely"]
    assert halfway["most_likely"] < 0.5
    for measure in ("most_likely", "probable"):
        mean = sum(rigid[name]["share"] * rigid[name][measure] for name in BINS)
        assert rigid["all"][measure] == pytest.approx(mean)
    print_two_turns(rigid)
    assert "halfway" in capsys.readouterr().out
