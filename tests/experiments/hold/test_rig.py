"""A cube held by the hand on slides: against Coulomb's law and the whole arm."""

from dataclasses import astuple

import numpy as np
import pytest
from pydrake.math import RigidTransform

from experiments.hold.cases import Case
from experiments.hold.held import HOLDS, LOST, SLIPS, judge
from experiments.hold.rig import Load, hold, slide_way
from experiments.hold.swings import motion, swings

GRAVITY = np.array([0.0, 0.0, -9.81])


@pytest.mark.parametrize("key", ["sweep-closing", "up-down-across"])
def test_the_slides_give_the_hand_what_the_arm_does(key):
    swung = motion(swings()[key], 1.0)
    way = slide_way(swung, GRAVITY)
    for i in range(5, len(swung.time) - 5, 40):
        v = [way.EvalDerivative(0.15 + swung.time[i] + dt, 1)[:, 0] for dt in (-1e-3, 1e-3)]
        felt_W = GRAVITY - (v[1] - v[0]) / 2e-3
        np.testing.assert_allclose(swung.R_WG.T @ felt_W, swung.felt_G[i], atol=0.02)
    assert way.EvalDerivative(0.1, 1) == pytest.approx(0.0)


@pytest.mark.parametrize(
    ("mass", "verdict"), [(0.5, HOLDS), (1.0, SLIPS), (3.0, LOST)], ids=["half", "one", "three"]
)
def test_the_verdict_is_coulombs(mass, verdict):
    """Up and down along the pads friction alone holds: 2 · 0.5 · 20 N against m (g + a)."""
    case = Case("up-down-across", 1.0, Load(mass, 0.5, 20.0))
    swung = case.motion
    needed = mass * np.linalg.norm(swung.felt_G[:, [0, 2]], axis=1).max()
    assert (needed < 20.0) == (verdict == HOLDS)
    # The ratio asks for the worst direction of the acceleration: never more hopeful.
    assert case.ratio(swung.largest) <= 20.0 / needed
    assert hold(swung, case.load, 0.002).verdict == verdict


def test_what_was_held_before_changes_nothing_and_half_the_step_little():
    swung, load = motion(swings()["sideways-across"], 1.0), Load(0.5, 0.5, 40.0)
    first = hold(swung, load, 0.002)
    hold(motion(swings()["up-down-approach"], 0.5), Load(2.0, 0.2, 40.0), 0.002)
    assert astuple(hold(swung, load, 0.002)) == astuple(first)
    halved = hold(swung, load, 0.001)
    assert (first.verdict, halved.verdict) == (HOLDS, HOLDS)
    assert abs(first.slip - halved.slip) < 5e-5
    assert first.force == pytest.approx((40.0, 40.0, 40.0), rel=0.02)


def poses(*millimetres):
    return [RigidTransform([1e-3 * x, 0.0, 0.0]) for x in millimetres]


def test_verdicts_by_their_definition():
    speed, force = np.zeros(3), np.full(3, 40.0)
    assert judge(poses(2, 2.5, 2.9), speed, force).verdict == HOLDS
    assert judge(poses(2, 3.1, 2), speed, force).verdict == SLIPS
    assert judge(poses(0, 1, 21), speed, force).verdict == LOST
    assert judge(poses(21), speed[:1], force[:1]).verdict == LOST
    assert judge(poses(0, 0, 0), speed, np.array([40.0, 40.0, 0.0])).verdict == LOST


def test_chatter_counts_turns_of_the_knuckle_and_no_noise():
    speed = np.array([0.01, -0.01, 1e-5, -1e-5, -0.01, 0.02, 0.0, 0.03])
    held = judge(poses(*[0.0] * 8), speed, np.full(8, 40.0))
    assert held.chatter == 2
    assert held.slip == 0.0
