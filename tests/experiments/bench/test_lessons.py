"""The speed of learning to grasp is measured on what the demo and the thesis do."""

import pytest

from experiments.bench import lessons
from experiments.bench.comparison import Peers
from experiments.grasping.learning import THESIS_DEMONSTRATIONS
from experiments.grasping.teacher import GraspTeacher


def test_rows_say_what_was_timed(monkeypatch):
    asked, runs = [], []

    def demo(teacher, config, seed):
        asked.append((teacher, config, seed))
        return 7.5

    def planned(name, problem, shown, *, rng):
        runs.append((name, len(shown), len(shown.ends)))
        return problem

    monkeypatch.setattr(lessons, "demo_seconds", demo)
    monkeypatch.setattr(lessons, "TIMED", 4)
    monkeypatch.setattr(lessons.methods, "learn", planned)
    first, single, second, third = lessons.rows(Peers(), seed=3)
    ((teacher, config, seed),) = asked
    assert isinstance(teacher, GraspTeacher)
    assert (config.demonstrations, seed) == (THESIS_DEMONSTRATIONS, 3)
    assert first.ratio == 2.0
    assert [(name, ends) for name, _, ends in runs] == [("planning", 1)] * 3
    assert all(labels >= 2 for _, labels, _ in runs)
    assert single.ours_s == max(single.details["each_s"])
    assert len(single.details["each_s"]) == 3
    assert second.ours_s == third.ours_s == pytest.approx(10_000 * second.details["an_iteration_s"])
    # 981 states lead to about half of all.
    assert 6000 < second.details["evaluated_states"] < 10_000
    # A part of the same work; four iterations are timed, so that the clock's noise may be a half.
    assert 0 < third.other_s < 1.5 * third.ours_s
