"""The same decisions elsewhere: other processes, settings of Python, orders, processors, threads.

The table in `experiments/same_decisions.md` says what these tests hold.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NETWORKS = {"fa_mlirl", "deep_max_ent", "active_fa_mlirl"}
"""What torch computes; all else is NumPy's, SciPy's and numba's."""
HERE = {"PYTHONHASHSEED": "0", "LC_ALL": "C.UTF-8", "OMP_NUM_THREADS": "1"}
OTHER_PYTHON = {"PYTHONHASHSEED": "4242", "LC_ALL": "C", "OMP_NUM_THREADS": "1"}


def decided(environment: dict[str, str], *parts: str) -> dict[str, tuple[str, str]]:
    """Hashes of bits and of decisions, by name, of a fresh process."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.decisions.decide", *parts],
        cwd=ROOT,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    lines = [line.split() for line in done.stdout.splitlines()]
    return {name: (bits, decisions) for name, bits, decisions in lines}


@pytest.fixture(scope="module")
def here():
    return decided(HERE, "active", "methods")


def test_other_processes_hash_seeds_locales_and_orders_give_the_same_bits(here):
    assert decided(OTHER_PYTHON, "methods", "active") == here
    assert len(here) == 14


def test_other_processors_and_threads_give_the_same_bits_but_of_networks(here):
    elsewhere = decided({"ATEN_CPU_CAPABILITY": "default", "OMP_NUM_THREADS": "2"}, "methods")
    for name, (bits, decisions) in elsewhere.items():
        assert name in NETWORKS or (bits, decisions) == here[name], name


@pytest.mark.soak
@pytest.mark.parametrize("capability", ["default", "avx2", "avx512"])
@pytest.mark.parametrize("threads", ["1", "2"])
def test_planning_counts_and_exports_are_the_same_bits_everywhere(capability, threads, everywhere):
    environment = {"ATEN_CPU_CAPABILITY": capability, "OMP_NUM_THREADS": threads}
    parts = ("kinematics", "export", "planning")
    assert decided(OTHER_PYTHON | environment, *parts) == everywhere


@pytest.fixture(scope="module")
def everywhere():
    return decided(HERE, "planning", "export", "kinematics")
