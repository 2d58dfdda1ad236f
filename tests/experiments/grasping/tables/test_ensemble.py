"""Lessons that an ensemble ends, led with a learner that is told what it knows."""

import numpy as np
import pytest

from experiments.grasping.tables import ensemble
from experiments.grasping.tables.ensemble import RULES, counted, one_lesson
from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.report.network_tables import ensemble as told
from irl.demonstrations import Demonstrations
from irl.ensemble import Member

FOLDER = str(SHIPPED_TASK)


class Learning:
    """Knows the demonstrator's values after ``after`` batches, and nothing before."""

    def __init__(self, teacher, seed, first, after=2):
        self.teacher, self.left = teacher, after
        state = int(teacher.task.model.acting[0])
        self.shown = Demonstrations.from_pairs([(state, 0)] * first, 0)
        self.ends = teacher.task.goal_states
        self.own = self.learn_from(self.shown, 0)

    def ask(self, number):
        self.left -= 1
        more = Demonstrations.from_pairs(self.shown.pairs[:1] * number, 1 + len(self.shown))
        self.shown = Demonstrations.concatenate([self.shown, more])
        self.own = self.learn_from(self.shown, 0)

    def learn_from(self, shown, k):
        model, best = self.teacher.task.model, self.teacher.oracle.optimal_actions
        knows = best.astype(float)
        guess = np.random.default_rng([max(self.left, 0), k]).random(knows.shape)
        return Member(np.where(model.mask, knows if self.left <= 0 else guess, -np.inf), 30.0)


@pytest.fixture
def learning(monkeypatch):
    monkeypatch.setattr(ensemble, "TAUGHT", {"fa_mlirl": Learning})


def test_a_lesson_goes_on_until_both_rules_ended_it(learning):
    lesson = one_lesson(FOLDER, (2, 5, 100), ("fa_mlirl", 0))
    labels = [check["labels"] for check in lesson["checks"]]
    assert labels == [5, 10, 15, 20, 25]
    predicted = [check["predicted"][1] for check in lesson["checks"]]
    assert max(predicted[:2]) < 0.9 and min(predicted[2:]) == 1.0
    assert [check["right"] for check in lesson["checks"]] == [False] * 2 + [True] * 3
    # The policy changed once more when it knew; predictions were good at once.
    assert lesson["ended"] == dict(zip(RULES, (3, 4), strict=True))


def test_a_lesson_that_nothing_ends_has_an_end(learning):
    lesson = one_lesson(FOLDER, (2, 5, 10), ("fa_mlirl", 0))
    assert [check["labels"] for check in lesson["checks"]] == [5, 10]
    assert lesson["ended"] == {}


def test_stops_are_counted_and_told():
    right = {"labels": 20, "predicted": [1.0, 0.96], "true": [1.0, 0.97], "right": True}
    wrong = {"labels": 40, "predicted": [1.0, 0.96], "true": [0.5, 0.8], "right": False}
    lessons = [
        {"checks": [wrong, right], "ended": {RULES[0]: 1, RULES[1]: 0}},
        {"checks": [wrong], "ended": {RULES[0]: 0}},
        {"checks": [wrong], "ended": {}},
    ]
    first, second = (counted(lessons, rule) for rule in RULES)
    assert (first["lessons"], first["ended"], first["wrong"]) == (3, 2, 1)
    assert first["labels"][0] == 30
    assert (second["ended"], second["wrong"]) == (1, 1)
    none = counted(lessons[2:], RULES[0])
    assert none == {"lessons": 1, "ended": 0, "wrong": 0}
    rows = [
        {"learner": "planning", "rule": r} | e for r, e in zip("ab", (first, none), strict=True)
    ]
    lines = told({"rows": rows})
    assert any("| planning | a | 3 | 2 | 1 | 30 [20, 40] | 96.0" in line for line in lines)
    assert any("| planning | b | 1 | 0 | 0 |  |" in line for line in lines)
