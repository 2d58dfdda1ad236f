"""What rows come to: counted, compared in pairs, and by start."""

import numpy as np
import pytest

from experiments.simulate.counting import always, count, difference, paired


def row(success=True, actions=4, *, number=0, fault="", acted=True, verdict="goal", failures=()):
    return {
        "number": number,
        "verdict": verdict if success else "lost",
        "success": success,
        "false_success": False,
        "actions": [0] * actions,
        "chosen_by": ["policy"] * actions,
        "action_failures": list(failures),
        "fault": fault,
        "acted": acted,
        "limits": None,
        "seconds": 20.0,
        "cpu_s": 8.0,
    }


def test_faults_and_disturbances_that_did_not_act_judge_nothing():
    rows = [row(), row(False), row(fault="NaN"), row(False, acted=False)]
    result = count(rows)
    assert (result["successes"], result["trials"]) == (1, 2)
    assert (result["faults"], result["not_acted"]) == (1, 1)
    assert result["failures"] == {"lost": 1}
    assert result["real_time_factor"] == pytest.approx(2.5)


def test_failures_of_actions_are_counted_by_kind():
    rows = [row(failures=["", "grip lost"]), row(failures=["grip lost", "no path"])]
    assert count(rows)["action_failures"] == {"grip lost": 2, "no path": 1}


def test_pairs_are_compared_where_both_count():
    disturbed = [row(), row(False), row(acted=False), row(actions=6), row(fault="NaN")]
    usual = [row(), row(), row(), row(), row()]
    result = paired(disturbed, usual)
    assert result["pairs"] == 3
    assert (result["both_succeed"], result["only_undisturbed"]) == (2, 1)
    assert result["actions_more_mean"] == pytest.approx(1.0)
    assert result["difference"][0] == pytest.approx(-1 / 3)


def test_the_interval_of_a_paired_difference_is_newcombes():
    # The data of his table 3, row 1 (n = 50: 36 12 2 0), method 8: 0.0642 to 0.3310 or so.
    table = {(True, True): 36, (True, False): 12, (False, True): 2, (False, False): 0}
    d, low, high = difference(table)
    assert d == pytest.approx(0.20)
    assert 0.04 < low < 0.08 and 0.31 < high < 0.35


def test_the_interval_of_a_paired_difference_holds_the_truth_mostly():
    rng = np.random.default_rng(0)
    cells = [(True, True), (True, False), (False, True), (False, False)]
    chances = [0.7, 0.18, 0.07, 0.05]
    inside = 0
    for _ in range(500):
        drawn = rng.multinomial(60, chances)
        _, low, high = difference(dict(zip(cells, drawn.tolist(), strict=True)))
        inside += low <= 0.11 <= high
    assert inside >= 460


def test_a_start_counts_if_all_its_repetitions_do_and_succeeds_if_all_do():
    rows = [row(number=0), row(number=0), row(number=1), row(False, number=1)]
    rows += [row(number=2), row(fault="NaN", number=2)]
    result = always(rows, 2)
    assert (result["starts"], result["always"], result["share"]) == (2, 1, 0.5)
