"""The parts that an episode's time is split into."""

import time

import pytest

from experiments.bench import episodes
from experiments.bench.comparison import Peers


def test_what_is_timed_is_the_processor_time_of_one_method():
    class Worker:
        name = "w"

        def work(self, seconds):
            until = time.process_time() + seconds
            while time.process_time() < until:
                pass
            return self.name

        def rest(self):
            self.work(0.05)

    timed = episodes.Timed(Worker(), "work")
    assert timed.work(0.02) == timed.name == "w"
    timed.rest()
    timed.work(seconds=0.01)
    assert timed.seconds == pytest.approx(0.03, abs=0.01)


@pytest.mark.soak
def test_the_parts_are_shares_of_the_whole(monkeypatch):
    monkeypatch.setattr(episodes, "EPISODES", 1)
    (row,) = episodes.rows(Peers(), seed=7)
    parts = [row.details[name] for name in ("deciding", "planning", "simulating_and_watching")]
    assert sum(parts) == pytest.approx(1.0) and all(0.0 < part < 1.0 for part in parts)
    assert parts[0] < 0.05
    assert row.details["actions"] > 0 and row.other_s > 5.0
