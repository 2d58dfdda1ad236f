import numpy as np
import pytest

from diagrams.trials.counts import Evidence, TransitionEntries
from diagrams.trials.record import Outcome, Pair, Trial, TrialRecord
from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.transitions.export import to_entries
from experiments.transitions.trust.validation import draw_pairs, scores
from irl.task_data import load_task
from models.task.spaces import GRID_Z, POSITIONS, Action, Kind, State, decode_actions

HELD = State(8, 0, 10).index
DROP, UP = Action(Kind.DROP).index, Action(Kind.TRANSLATE, 9).index


def model(*entries):
    """(state, action, next state, probability, evidence), all else made up."""
    state, action, next_state, probability, evidence = zip(*entries, strict=True)
    return TransitionEntries(
        *(np.array(column, dtype=np.int32) for column in (state, action, next_state)),
        np.array(probability),
        np.ones(len(entries), dtype=np.int64),
        np.array(evidence, dtype=np.uint8),
    )


MODEL = model(
    (HELD, UP, 1000, 1.0, 1),
    (HELD, DROP, 3, 0.48, 1),
    (HELD, DROP, 4, 0.48, 1),
    (HELD, DROP, 5, 0.04, 1),
    (HELD + 1, UP, 1001, 1.0, 1),
)


def trial(action, next_state, state=HELD, outcome=Outcome.FREE):
    record = TrialRecord(outcome, next_state=next_state, fault="x\nTraceback")
    return Trial(Pair(state, action), 0, record)


def test_what_came_about_is_compared_with_what_was_predicted():
    observed = [trial(UP, 1000), *(trial(DROP, s) for s in (3, 4, 5, 6))]
    result = scores(MODEL, [*observed, trial(UP, 7, outcome=Outcome.FAULT)])
    assert result["trials"] == 5
    assert result["faults"] == [{"state": HELD, "action": UP, "fault": "x"}]
    drop = result["by_action"]["drop, lower layer"]
    assert result["by_action"]["drop, upper layer"]["trials"] == 0
    assert drop["expected"] == pytest.approx(0.48)
    assert drop["probable_expected"] == pytest.approx(0.96)
    # Of two equally likely states one is predicted; at 4 % none is to be expected.
    assert drop["most_likely"][0] == 0.25
    assert drop["probable"][0] == 0.5
    assert drop["most_likely"][1] < 0.25 < drop["most_likely"][2]
    # Two of three pairs are translations.
    assert result["most_likely"] == pytest.approx((2 * 1.0 + 0.25) / 3)


def test_pairs_are_drawn_evenly_by_kind_and_never_one_that_was_measured():
    task = load_task(SHIPPED_TASK)
    model = to_entries(task.transitions)
    drawn = draw_pairs(model, 40, np.random.default_rng(0))
    assert len(set(drawn)) == 40
    assert [int(decode_actions(pair.action).kind) for pair in drawn[:5]] == [0, 1, 2, 3, 3]
    assert [POSITIONS[State.from_index(pair.state).position][2] for pair in drawn[3:5]] == [*GRID_Z]
    assert all(task.model.pair_index(pair.state, pair.action) >= 0 for pair in drawn)
    assert not {pair.key for pair in drawn} & {*model.key[model.evidence == Evidence.MEASURED]}
    assert drawn == draw_pairs(model, 40, np.random.default_rng(0))
