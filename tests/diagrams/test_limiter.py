import numpy as np
import pytest

from diagrams.limiter import LEAD, Limiter
from models.errors import ModelError
from models.motion.timing import time_path
from models.scenes.limits import JointLimits

PERIOD = 0.002
SPEED, ACCELERATION = np.array([1.4, 1.2]), np.array([5.2, 10.0])
RANGES = JointLimits(("hinge", "wheel"), np.array([-2.0, -np.inf]), np.array([2.0, np.inf]))


@pytest.fixture(scope="module")
def limiter():
    return Limiter(RANGES, SPEED, ACCELERATION, PERIOD)


def followed(limiter, commands, start=None):
    """References ``[m, 2]`` and how many samples were limited, of commands ``[m, 2]``."""
    memory = limiter.at_rest(commands[0] if start is None else np.array(start))
    references = []
    for command in commands:
        memory = limiter.follow(command, memory, memory[:2])
        references.append(memory[:2])
    return np.array(references), int(memory[-1])


def rates(references, start):
    """Largest speed and acceleration of each joint, by differences, from rest at ``start``."""
    path = np.vstack([start, start, references])
    speed = np.diff(path, axis=0) / PERIOD
    return np.abs(speed).max(axis=0), np.abs(np.diff(speed, axis=0)).max(axis=0) / PERIOD


def held(target, seconds):
    return np.tile(np.array(target, dtype=float), (round(seconds / PERIOD), 1))


@pytest.mark.parametrize("scale", [0.4, 0.8, 1.0])
def test_motions_within_the_limits_pass_to_the_bit(limiter, scale):
    rng = np.random.default_rng(0)
    for _ in range(5):
        waypoints = rng.uniform(-1.9, 1.9, (4, 2))
        motion = time_path(waypoints, SPEED, ACCELERATION, scale=scale, limits=RANGES)
        times = np.arange(0.0, motion.end_time() + 0.1, PERIOD)
        commands = motion.vector_values(np.minimum(times, motion.end_time())).T
        references, limited = followed(limiter, commands)
        assert limited == 0
        np.testing.assert_array_equal(references, commands)


@pytest.mark.parametrize("size", [1e-6, 3e-5, 1e-3, 0.1, 1.0, 1.9])
def test_a_step_is_followed_as_fast_as_can_be_and_not_overshot(limiter, size):
    step = np.array([size, -size])
    references, limited = followed(limiter, held(step, 3.0), start=[0.0, 0.0])
    speed, acceleration = rates(references, [0.0, 0.0])
    assert (speed <= SPEED * (1 + 1e-5)).all()
    assert (acceleration <= ACCELERATION * (1 + 1e-5)).all()
    progress = references * [1, -1]
    assert (np.diff(progress, axis=0) >= 0.0).all() and (progress <= size).all()
    np.testing.assert_array_equal(references[-1], step)
    # In continuous time: as much of a trapezium as the way needs, at 98 % of the speed limit.
    cruise = np.maximum(size - (0.98 * SPEED) ** 2 / ACCELERATION, 0.0)
    fastest = 2.0 * np.sqrt((size - cruise) / ACCELERATION) + cruise / (0.98 * SPEED)
    taken = PERIOD * np.argmax(progress == size, axis=0)
    assert (np.abs(taken - fastest) <= 3 * PERIOD).all()
    assert 0 <= limited - taken.max() / PERIOD <= 2 or size < 2e-5


def test_whatever_is_commanded_stays_within_the_limits(limiter):
    rng = np.random.default_rng(1)
    for _ in range(40):
        values = rng.normal(0.0, 10.0 ** rng.uniform(-6, 3, 2), (30, 2))
        lengths = rng.integers(1, 60, 30)
        commands = np.repeat(values, lengths, axis=0)
        if rng.random() < 0.5:
            commands = np.cumsum(commands * PERIOD, axis=0)
        references, _ = followed(limiter, commands, start=[0.0, 0.0])
        speed, acceleration = rates(references, [0.0, 0.0])
        assert (speed <= SPEED * (1 + 1e-5)).all()
        assert (acceleration <= ACCELERATION * (1 + 1e-4)).all()


def test_commands_that_are_held_between_jumps_are_never_passed(limiter):
    rng = np.random.default_rng(2)
    for _ in range(20):
        # As a slider is dragged: always on, with rests of two samples or more.
        values = np.cumsum(rng.exponential(10.0 ** rng.uniform(-6, -2), (200, 2)), axis=0)
        commands = np.repeat(np.minimum(values, 1.9), rng.integers(2, 12, 200), axis=0)
        commands = np.vstack([commands, held(commands[-1], 3.0)])
        references, _ = followed(limiter, commands, start=[0.0, 0.0])
        assert (references <= commands + 1e-12).all()
        np.testing.assert_array_equal(references[-1], commands[-1])


def test_a_motion_that_was_lost_is_caught_up_with(limiter):
    times = np.arange(0.0, 3.0, PERIOD)
    motion = np.outer(np.sin(times), [0.8, -0.8])
    references, limited = followed(limiter, motion, start=[0.3, 0.3])
    apart = (references != motion).any(axis=1)
    assert 0 < limited < 1.0 / PERIOD
    assert not apart[limited:].any()


@pytest.mark.parametrize("turns", [-3, -1, 1, 2])
def test_another_winding_is_the_same_angle(limiter, turns):
    away = np.array([0.0, 2.0 * np.pi * turns])
    references, limited = followed(limiter, held(away + 0.4, 1.0), start=[0.4, 0.4])
    assert limited == 0
    np.testing.assert_allclose(references, 0.4, atol=1e-14)
    # And a motion commanded there is followed here.
    times = np.arange(0.0, 2.0, PERIOD)
    motion = 0.4 + np.outer(np.sin(times) ** 2, [0.2, 0.2])
    references, limited = followed(limiter, motion + away, start=[0.4, 0.4])
    assert limited == 0
    np.testing.assert_allclose(references, motion, atol=1e-13)


def test_a_wheel_takes_the_short_way_and_may_turn_for_ever(limiter):
    references, _ = followed(limiter, held([0.0, 4.0], 5.0), start=[0.0, 0.0])
    assert references[-1][1] == pytest.approx(4.0 - 2.0 * np.pi)
    times = np.arange(0.0, 20.0, PERIOD)
    turning = np.column_stack([0.0 * times, times - np.sin(times)])
    turning[:, 1] *= 0.5
    references, limited = followed(limiter, turning)
    assert limited == 0
    np.testing.assert_array_equal(references, turning)


def test_a_hinge_goes_to_its_end_and_no_further(limiter):
    references, limited = followed(limiter, held([7.0, 0.0], 4.0), start=[0.0, 0.0])
    assert references.max() == pytest.approx(2.0, abs=1e-8)
    assert limited == 4.0 / PERIOD


def test_the_reference_waits_for_a_joint_that_is_held_up(limiter):
    target, memory = np.array([0.6, -0.6]), limiter.at_rest(np.zeros(2))
    for _ in range(500):
        memory = limiter.follow(target, memory, np.zeros(2))
        assert (np.abs(memory[:2]) <= LEAD).all()
    assert np.abs(memory[:2]) == pytest.approx(LEAD)
    assert memory[-1] == 500
    # Let go of, it goes on from there, as from rest.
    references = [memory[:2]]
    for _ in range(700):
        memory = limiter.follow(target, memory, memory[:2])
        references.append(memory[:2])
    speed, acceleration = rates(np.array(references[1:]), references[0])
    assert (speed <= SPEED * (1 + 1e-5)).all()
    assert (acceleration <= ACCELERATION * (1 + 1e-5)).all()
    assert references[-1] == pytest.approx(target, abs=1e-6)


def test_a_joint_that_lags_is_led_on_more_slowly_and_one_that_is_thrown_within_its_limit(
    limiter,
):
    """For what has fallen behind catches up once it comes free."""
    speeds = []
    for lag in (0.0, 0.5 * LEAD, LEAD):
        memory = limiter.at_rest(np.zeros(2))
        for _ in range(600):
            memory = limiter.follow(np.full(2, 1.9), memory, memory[:2] - lag)
        speeds.append(memory[2:4] / SPEED)
    assert (speeds[0] > 0.97).all()
    assert (speeds[2] < 0.8).all() and (speeds[2] < speeds[1]).all() and (speeds[1] < 0.9).all()

    # Be the command one that could be followed, if the joint is held up.
    for lag, limited in ((LEAD, True), (0.008, False)):
        motion, memory = np.zeros(2), limiter.at_rest(np.zeros(2))
        for sample in range(600):
            motion = motion + np.minimum(sample * PERIOD * ACCELERATION, 0.9 * SPEED) * PERIOD
            memory = limiter.follow(motion, memory, memory[:2] - lag)
        assert (memory[-1] > 0) == limited
        assert (memory[2:4] <= 0.8 * SPEED).all() == limited

    thrown = np.zeros(2)
    for _ in range(50):
        thrown = thrown + 3.0 * SPEED * PERIOD
        memory = limiter.follow(np.full(2, 1.9), memory, thrown)
        assert (memory[2:4] <= SPEED * (1 + 1e-9)).all()


@pytest.mark.parametrize("angle", [np.nan, np.inf, -np.inf, 1e7])
def test_what_is_no_angle_is_refused_by_its_joint(limiter, angle):
    with pytest.raises(ModelError, match=f"wheel {angle:g}".replace("+", r"\+")):
        limiter.follow(np.array([0.0, angle]), limiter.at_rest(np.zeros(2)), np.zeros(2))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((RANGES, SPEED * 0, ACCELERATION, PERIOD), "velocity"),
        ((RANGES, SPEED, [1.0, -1.0], PERIOD), "acceleration"),
        ((RANGES, SPEED, [1.0], PERIOD), "acceleration"),
        ((RANGES, SPEED, ACCELERATION, 0.0), "period"),
    ],
)
def test_limits_are_above_zero(arguments, message):
    with pytest.raises(ModelError, match=message):
        Limiter(*arguments)
