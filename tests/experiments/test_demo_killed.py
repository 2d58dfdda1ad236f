"""A demo that is killed while it trains: two runs of it, a minute. ``python -m pytest -m soak``."""

import json
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from experiments.grasping.learning import CHECKPOINT
from irl.active_state import EVERY, TRAINING
from irl.files import sha256
from irl.tensor_file import from_bytes

TINY = [
    *("--learning.demonstrations", "60"),
    *("--learning.active.initial.iterations", "500"),
    *("--learning.active.refine.iterations", "5"),
    *("--learning.active.budget", "2"),
    *("--learning.active.max-demonstrated", "100"),
    *("--starts", "0"),
]


@pytest.mark.soak
def test_a_demo_that_was_killed_in_its_first_training_does_not_start_at_0(tmp_path, command):
    options = [*TINY, "--out"]
    whole = command("demo", *options, str(tmp_path / "whole"))
    assert whole.returncode == 0, whole.stderr
    assert "goes on at" not in whole.stdout + whole.stderr

    out = tmp_path / "cut"
    process = subprocess.Popen(
        [sys.executable, "-m", "experiments.demo", *options, str(out)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    training = Path(f"{out / CHECKPOINT}{TRAINING}main")
    deadline = time.monotonic() + 120
    while not (training.exists() and saved_iterations(training) >= EVERY):
        assert time.monotonic() < deadline and process.poll() is None
        time.sleep(0.01)
    process.kill()
    process.wait()
    assert not (out / CHECKPOINT).exists()

    again = command("demo", *options, str(out))
    assert again.returncode == 0, again.stderr
    (at,) = re.findall(r"learning goes on at iteration (\d+)", again.stdout + again.stderr)
    assert int(at) > EVERY
    assert sha256(out / "policy.safetensors") == sha256(tmp_path / "whole/policy.safetensors")
    assert {p.name for p in out.iterdir()} == {p.name for p in (tmp_path / "whole").iterdir()}


def saved_iterations(path):
    """Iterations that a training had done when it saved itself last."""
    _, metadata = from_bytes(path.read_bytes())
    content = json.loads(json.loads(metadata["checkpoint"])["content"])
    return content["state"]["done"]
