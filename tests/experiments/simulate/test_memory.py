"""Hundreds of episodes in one process. A quarter of an hour: ``python -m pytest -m soak``."""

import os
from pathlib import Path

import numpy as np
import pytest

from diagrams.scenarios import load_scenario
from experiments.simulate.episodes import Job, Setting, play
from models.task.spaces import N_FREE

pytestmark = pytest.mark.soak

EPISODES = 500
NAMES = ("", "push", "noise", "distractor", "delay")
"""Scenarios, in turn."""


def resident():
    """Memory of this process [MiB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def test_memory_of_a_worker_stays_flat(policy_file):
    texts = [load_scenario(name).text() if name else "" for name in NAMES]
    settings = [Setting(policy_file, max_actions=1, scenario=text, seed=3) for text in texts]
    starts = np.random.default_rng(3).integers(0, N_FREE, EPISODES)
    sizes = []
    for number, start in enumerate(starts):
        scenario = number // 20 % len(settings)
        outcome = play(settings[scenario], Job(number, int(start), 0, bool(scenario)), False)
        assert not outcome.row["fault"]
        if number % 100 == 99:
            sizes.append(resident())
    print(f"MiB after every 100 episodes: {[round(size) for size in sizes]}")
    assert max(sizes) - sizes[0] < 50.0
