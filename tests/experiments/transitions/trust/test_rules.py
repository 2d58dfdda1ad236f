"""Rules are judged by trials of the pairs that follow by them alone."""

from dataclasses import replace

import numpy as np
import pytest

from diagrams.trials.record import Outcome, Pair, Trial, TrialRecord
from experiments.kit.command import Output
from experiments.kit.shipped_data import load_feasibility
from experiments.transitions.trust.rules import (
    EXACT,
    THESIS,
    draw_rule_pairs,
    find_rules,
    judge,
    plot_rules,
)
from models.task.kernel_rules import EXACT_RULES, THESIS_RULES
from models.task.spaces import Action, Kind, State
from models.task.trial_classes import trial_classes

CLASSES = trial_classes()
DROP = Action(Kind.DROP).index
TRIED = Pair(State(8, 0, 10).index, DROP)
LEVEL = TrialRecord(Outcome.FREE)


@pytest.fixture(scope="module")
def rules():
    return find_rules(load_feasibility().mask(), [Trial(TRIED, 0, LEVEL)], CLASSES)


def test_every_rule_is_there_and_speaks_for_untried_pairs(rules):
    names = [(rule.source, rule.name) for rule in rules]
    assert names == [(EXACT, n) for n in EXACT_RULES] + [(THESIS, n) for n in THESIS_RULES]
    key = TRIED.key
    assert all(key not in rule.keys for rule in rules)
    pairs = {rule.name: rule.keys.size for rule in rules}
    assert pairs["place"] == pairs["columns"] == 8  # the other columns
    assert pairs["cube"] == 9 * 23
    assert pairs["quarter turns"] == 23
    assert pairs["upper layer"] == 0  # no translation was tried


def test_pairs_are_drawn_by_the_seed_and_evenly_over_the_kinds(rules):
    cube = next(rule for rule in rules if rule.name == "cube")
    drawn = draw_rule_pairs(cube, 20, np.random.default_rng(0))
    assert len(set(drawn)) == 20
    assert drawn == draw_rule_pairs(cube, 20, np.random.default_rng(0))
    grasp = Pair(State(8, 2).index, Action(Kind.GRASP, 10).index).key
    mixed = cube._replace(keys=np.append(cube.keys, grasp))
    kinds = {
        Action.from_index(p.action).kind
        for p in draw_rule_pairs(mixed, 2, np.random.default_rng(0))
    }
    assert kinds == {Kind.GRASP, Kind.DROP}


def test_what_came_about_is_compared_with_the_rule(rules, tmp_path):
    cube = next(rule for rule in rules if rule.name == "cube")
    kept, fell = draw_rule_pairs(cube, 2, np.random.default_rng(0))

    def trial(pair, next_state):
        return Trial(pair, 0, replace(LEVEL, next_state=next_state))

    orientation = State.from_index(kept.state).orientation
    cell = State.from_index(kept.state).position
    trials = [
        trial(kept, State(cell - cell % 2, orientation, None).index),
        trial(fell, State(0, (State.from_index(fell.state).orientation + 9) % 48, None).index),
        trial(TRIED, 0),  # not a pair of the rule
    ]
    (row,) = judge([cube], [[kept, fell]], trials)
    assert (row["source"], row["rule"], row["trials"]) == (EXACT, "cube", 2)
    groups = [part for part in row["by_action"].values() if part["trials"]]
    hits = [part["most_likely"][0] * part["trials"] for part in groups]
    assert (sum(hits), sum(part["trials"] for part in groups)) == (1, 2)
    assert all(part["expected"] == 1.0 for part in groups)
    (perfect,) = judge([cube], [[kept]], trials)
    with Output(tmp_path, None).figure("r.png") as figure:
        plot_rules(figure, [row, perfect])
    assert (tmp_path / "r.png").stat().st_size > 5_000
