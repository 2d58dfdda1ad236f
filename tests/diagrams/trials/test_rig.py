import sys

import numpy as np
import pytest
from pydrake.math import RigidTransform

from diagrams.faults import SimulatorFault
from diagrams.trials.floating import run_trial
from diagrams.trials.record import Outcome, Pair, TrialConfig, spawn_key
from diagrams.trials.rig import COLUMN, TrialRig
from diagrams.trials.scene import TrialScene
from models.scenes import gripper
from models.task.spaces import R_WG, REST_HEIGHT


@pytest.fixture(scope="module", params=["cenic", "discrete"])
def rig(request):
    return TrialRig(TrialConfig(solver=request.param))


def python_calls(action):
    """How many Python functions run during an action."""
    count = 0

    def profile(frame, event, argument):
        nonlocal count
        count += event == "call"

    sys.setprofile(profile)
    try:
        action()
    finally:
        sys.setprofile(None)
    return count


def test_no_step_of_a_simulation_calls_python(rig):
    scene = TrialScene(rig, R_WG[10], friction=0.8, mass=0.1)
    p_WG = np.array([*COLUMN, REST_HEIGHT])
    scene.start(p_WG, gripper.MAX_OPENING, RigidTransform(p_WG))
    scene.command(np.add(p_WG, [0.0, 0.0, 0.03]), 0.0)
    scene.advance(0.01)
    short, long = (python_calls(lambda s=s: scene.advance(s)) for s in (0.01, 0.1))
    assert long == short


def test_fingers_faster_than_any_hands_are_a_fault(rig, monkeypatch):
    scene = TrialScene(rig, R_WG[10], friction=0.8, mass=0.1)
    p_WG = np.array([*COLUMN, REST_HEIGHT])
    scene.start(p_WG, gripper.MAX_OPENING, RigidTransform(p_WG))
    scene.command(p_WG, 0.0)
    scene.advance(0.05)
    # They close at 0.5 rad/s.
    monkeypatch.setattr("diagrams.trials.scene.FASTEST_KNUCKLE", 0.1)
    with pytest.raises(SimulatorFault, match=r"came apart.* 0\.\d+ rad/s"):
        scene.advance(0.05)


@pytest.mark.parametrize("repetition", [0, 3])
def test_what_is_read_at_the_end_of_a_phase_is_no_matter_of_rounding(repetition):
    """Phases of 0.3, 0.5 and 0.8 s; steps that divided them left one of 1e-16 s."""
    config = TrialConfig(solver="cenic")
    pair = Pair(8736, 21)
    seed = np.random.SeedSequence(0, spawn_key=spawn_key(pair, repetition))
    record = run_trial(TrialRig(config), config, pair, seed)
    assert record.outcome == Outcome.HELD
    assert record.pad_force == pytest.approx(40.0, rel=0.1)
