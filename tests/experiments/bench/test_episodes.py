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

    before = Worker.work
    with episodes.timed(Worker, "work") as watch:
        worker = Worker()
        assert worker.work(0.02) == "w"
        worker.rest()
        worker.work(seconds=0.01)
    assert watch.seconds == pytest.approx(0.08, abs=0.01)
    assert Worker.work is before


@pytest.mark.soak
def test_the_parts_are_shares_of_the_whole(monkeypatch):
    monkeypatch.setattr(episodes, "EPISODES", 1)
    (row,) = episodes.rows(Peers(), seed=7)
    names = ("deciding", "planning", "watching", "monitoring", "simulating")
    parts = [row.details[name] for name in names]
    assert sum(parts) == pytest.approx(1.0) and all(0.0 < part < 1.0 for part in parts)
    assert parts[0] + parts[2] + parts[3] < 0.05  # what looks ahead, watches and monitors
    assert row.details["actions"] > 0 and row.other_s > 5.0
