import numpy as np
import pytest

from diagrams.execution.clock import PERIOD, SLOWS, STOPS, Clock
from diagrams.execution.watches import BEHIND

FREELY = (-np.inf, np.inf)


def test_time_passes_as_it_does_while_the_arm_follows():
    clock = Clock(3.7)
    for now in np.arange(3.7, 9.0, 0.01):
        clock = clock.led(now, 0.9 * SLOWS, FREELY)
        assert clock.read(now) == now - 3.7  # to the bit
    assert clock == Clock(3.7)


def test_time_stands_while_the_arm_is_too_far_behind_and_goes_on_from_there():
    held = Clock(1.0).led(1.5, STOPS, FREELY)
    assert held.rate == 0.0
    assert held.read(1.5) == held.read(9.0) == 0.5
    free = held.led(9.0, 0.0, FREELY)
    assert free.read(9.0) == 0.5
    assert free.read(9.25) == 0.75


def test_its_rate_changes_no_faster_than_it_may():
    clock = Clock().led(1.0, 1.0, (-4.0, 2.0))
    assert clock.rate == pytest.approx(1.0 - 4.0 * PERIOD)
    assert clock.led(1.01, 0.0, (-4.0, 2.0)).rate == pytest.approx(1.0 - 2.0 * PERIOD)
    assert clock.led(1.01, 1.0, (0.0, 0.0)) is clock


@pytest.mark.parametrize("speed", [0.05, 0.3, 0.8, 1.39])
def test_a_plan_that_an_arm_does_not_follow_stands_soon_and_not_too_near(speed):
    """The arm stands at 0; the plan brakes by 4.7 rad/s² at most."""
    clock, far = Clock(), []
    for now in np.arange(0.0, 3.0, PERIOD):
        far.append(speed * clock.read(now))
        clock = clock.led(now, far[-1], (-4.7 / speed, 4.7 / speed))
    assert BEHIND < far[-1] < STOPS + speed * PERIOD + speed**2 / 2.0 / 4.7
    assert np.all(np.diff(far) >= 0.0)
    assert clock.rate < 0.1


@pytest.mark.parametrize("speed", [0.05, 0.3, 0.8, 1.39])
def test_a_command_that_takes_50_ms_to_arrive_leads_the_arm_more_slowly(speed):
    """The arm follows what was commanded 50 ms ago; the plan gathers speed in 0.3 s."""
    clock, command = Clock(), [0.0] * 5
    for now in np.arange(0.0, 5.0, PERIOD):
        t = clock.read(now)
        command.append(speed * (t - 0.15 if t > 0.3 else t**2 / 0.6))
        most = 4.7 / (speed * min(max(t, 0.01) / 0.3, 1.0))
        clock = clock.led(now, command[-1] - command[-6], (-most, most))
    lag = np.array(command[5:]) - np.array(command[:-5])
    assert lag.max() < 0.03
    assert lag[-100:].max() < BEHIND
    assert np.ptp(np.diff(command[-100:])) < 0.1 * speed * PERIOD  # evenly
    assert command[-1] > 0.2 * speed * 5.0
