"""Swings of the arm, beside what plain mechanics says of them."""

import numpy as np
import pytest

from diagrams.arm_controller import ACCELERATION_LIMIT
from experiments.hold.swings import AXES, motion, swings
from models.scenes.limits import arm_limits

SPEED_LIMIT = np.array([1.3963] * 4 + [1.2218] * 3)  # of gen3.urdf [rad/s]


@pytest.mark.parametrize("key", swings())
def test_a_swing_reaches_the_limits_and_keeps_them(key):
    swung = motion(swings()[key], 1.0)
    # By differences of the posture, not by what the motion says of itself.
    v = np.gradient(swung.q, swung.time, axis=0)
    a = np.gradient(v, swung.time, axis=0)[2:-2]
    joints = np.flatnonzero(np.ptp(swung.q, axis=0) > 0.0)
    np.testing.assert_allclose(np.abs(a).max(axis=0)[joints], ACCELERATION_LIMIT[joints], rtol=1e-2)
    shares = np.abs(v).max(axis=0)[joints] / SPEED_LIMIT[joints]
    assert shares.max() == pytest.approx(1.0, abs=2e-3)
    assert not arm_limits(7).beyond(swung.q).any()
    np.testing.assert_allclose(swung.q[[0, -1]], [swings()[key].posture] * 2, atol=1e-12)


def test_joint_one_swings_a_stretched_arm_as_a_turntable_does():
    swung = motion(swings()["sweep-across"], 1.0)
    # Radius from the drawing: the tool centre point from joint 1's axis.
    radius = np.hypot(1.04507502, 0.02484913)
    half = swung.time[-1] / 2
    wave = 2 * np.pi / half * swung.time
    alpha = np.where(swung.time <= half, 1, -1) * 5.2 * np.sin(wave)
    omega = 5.2 * half / (2 * np.pi) * (1 - np.cos(wave))
    size = radius * np.hypot(alpha, omega**2)
    np.testing.assert_allclose(np.linalg.norm(swung.a_G, axis=1), size, atol=1e-3)
    assert swung.largest == pytest.approx(size.max(), rel=1e-5)


@pytest.mark.parametrize("key", swings())
def test_a_swing_goes_along_the_axis_it_is_named_by_and_weighs_as_much_at_rest(key):
    swing = swings()[key]
    swung = motion(swing, 0.5)
    quarter = int(np.argmax(np.linalg.norm(swung.a_G[: len(swung.time) // 4], axis=1)))
    assert np.abs(swung.a_G[quarter]).argmax() == AXES[swing.axis]
    for end in (0, -1):
        np.testing.assert_allclose(np.linalg.norm(swung.felt_G[end]), 9.81, atol=1e-6)
    # Less than the whole of it, less acceleration.
    assert swung.largest < motion(swing, 1.0).largest
