"""Motions along a path: within the limits, on the path, no slower than they must be."""

import copy
import logging
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from models.errors import ModelError
from models.motion import timing
from models.motion.timing import ACCELERATION_LIMIT, SCALE, SHORTEST, time_path
from models.scenes.limits import LARGEST, JointLimits, arm_limits
from models.scenes.planning_scene import HOME

LIMITS = arm_limits(7)
WAYPOINTS = np.array([HOME, HOME + 0.5, HOME + np.array([0.1, 1, -1, 0, 0, 0.3, 2]), HOME])
VELOCITY_LIMIT = np.array([1.4, 1.4, 1.4, 1.4, 1.2, 1.2, 1.2])
CUTS = [None, np.zeros(4), np.array([0, 1e-3, 0.02, 0]), np.array([0, 0.3, 0.6, 0])]


def sampled(trajectory, n=4000):
    times = np.linspace(0.0, trajectory.end_time(), n)
    return [
        (trajectory.MakeDerivative(order) if order else trajectory).vector_values(times)
        for order in range(3)
    ]


def off_path(q, waypoints):
    """Distance [rad] of ``q`` from the nearest segment."""
    distances = []
    for a, b in pairwise(waypoints):
        share = np.clip((q - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        distances.append(np.linalg.norm(q - a - share * (b - a)))
    return min(distances)


def shares(trajectory, scale=SCALE, limit=ACCELERATION_LIMIT):
    """Largest velocity and acceleration as shares of what ``scale`` allows."""
    _, velocity, acceleration = sampled(trajectory)
    return (
        (np.abs(velocity).max(axis=1) / (scale * VELOCITY_LIMIT)).max(),
        np.abs(acceleration).max() / (scale * limit),
    )


@pytest.mark.parametrize("cuts", CUTS)
@pytest.mark.parametrize("scale", [SCALE, 0.3, 1.0])
def test_limits_are_respected_and_used(cuts, scale):
    largest = shares(time_path(WAYPOINTS, VELOCITY_LIMIT, cuts=cuts, scale=scale), scale)
    assert max(largest) <= 1.0 + 1e-4
    assert max(largest) > 0.98


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 6), st.floats(0.0, 1.0))
def test_any_path_is_timed_within_the_limits(seed, n, share):
    rng = np.random.default_rng(seed)
    steps = rng.normal(size=(n - 1, 7)) * 10.0 ** rng.uniform(-3, 0.3, (n - 1, 1))
    waypoints = HOME + np.vstack([np.zeros(7), np.cumsum(steps, axis=0)])
    waypoints = np.clip(waypoints, LIMITS.lower, LIMITS.upper)
    lengths = np.linalg.norm(np.diff(waypoints, axis=0), axis=1)
    cuts = np.zeros(n)
    cuts[1:-1] = share * np.minimum(lengths[:-1], lengths[1:]) / 2.0
    trajectory = time_path(waypoints, VELOCITY_LIMIT, cuts=cuts)
    assert max(shares(trajectory)) <= 1.0 + 1e-3
    position, velocity, _ = sampled(trajectory, 300)
    np.testing.assert_allclose(position[:, [0, -1]].T, waypoints[[0, -1]], atol=1e-9)
    np.testing.assert_allclose(velocity[:, [0, -1]], 0.0, atol=1e-6)
    assert max(off_path(q, waypoints) for q in position.T) <= 0.375 * cuts.max() + 1e-9


def test_without_cuts_the_motion_stays_on_the_segments_and_rests_at_the_waypoints():
    trajectory = time_path(WAYPOINTS, VELOCITY_LIMIT)
    position, velocity, _ = sampled(trajectory)
    assert max(off_path(q, WAYPOINTS) for q in position.T) < 1e-9
    for q in WAYPOINTS:
        nearest = np.linalg.norm(position.T - q, axis=1).argmin()
        assert np.linalg.norm(position[:, nearest] - q) < 1e-3
        assert np.abs(velocity[:, nearest]).max() < 0.01


def test_a_cut_corner_is_rounded_inside_its_triangle_without_a_stop():
    cuts = CUTS[-1]
    trajectory = time_path(WAYPOINTS, VELOCITY_LIMIT, cuts=cuts)
    position, velocity, _ = sampled(trajectory)
    speed = np.linalg.norm(velocity, axis=0)
    for i in (1, 2):
        corner = WAYPOINTS[i]
        near = np.linalg.norm(position.T - corner, axis=1) < cuts[i]
        u, v = corner - WAYPOINTS[i - 1], WAYPOINTS[i + 1] - corner
        edges = np.array([-u / np.linalg.norm(u), v / np.linalg.norm(v)]) * cuts[i]
        # In the triangle's coordinates: both at least 0, their sum at most 1.
        shares, residual, *_ = np.linalg.lstsq(edges.T, position[:, near] - corner[:, None])
        assert shares.min() > -1e-9 and shares.sum(axis=0).max() < 1.0 + 1e-9
        assert residual.max() < 1e-18
        assert speed[near].min() > 0.05
    assert trajectory.end_time() < time_path(WAYPOINTS, VELOCITY_LIMIT).end_time()


def test_a_straight_move_takes_as_long_as_theory_says():
    """Accelerate, cruise, brake: T = d / v + v / a; without cruise T = 2 √(d / a)."""
    v, a = SCALE * VELOCITY_LIMIT[0], SCALE * ACCELERATION_LIMIT
    for d, expected in ((2.0, 2.0 / v + v / a), (0.1, 2.0 * np.sqrt(0.1 / a))):
        trajectory = time_path(np.array([HOME, HOME + d * np.eye(7)[0]]), VELOCITY_LIMIT)
        assert expected - 1e-9 <= trajectory.end_time() < 1.03 * expected


def test_waypoints_on_one_line_cost_no_time():
    line = HOME + np.array([0.0, 0.3, 0.7, 1.0])[:, None] * np.ones(7)
    cuts = np.array([0.0, 0.2, 0.2, 0.0])
    direct = time_path(line[[0, -1]], VELOCITY_LIMIT).end_time()
    assert time_path(line, VELOCITY_LIMIT, cuts=cuts).end_time() < 1.03 * direct


@pytest.mark.parametrize("n", [2, 4])
def test_a_motion_to_the_same_place_is_short(n):
    trajectory = time_path(np.tile(HOME, (n, 1)), VELOCITY_LIMIT)
    assert trajectory.end_time() == pytest.approx(SHORTEST)
    np.testing.assert_allclose(trajectory.value(SHORTEST).ravel(), HOME)


def test_repeated_waypoints_are_passed_over():
    repeated = WAYPOINTS[[0, 0, 1, 1, 2, 3, 3]]
    ends = [time_path(w, VELOCITY_LIMIT).end_time() for w in (WAYPOINTS, repeated)]
    assert ends[0] == pytest.approx(ends[1])


def test_trajectories_can_be_copied():
    trajectory = time_path(WAYPOINTS, VELOCITY_LIMIT, cuts=CUTS[-1])
    np.testing.assert_array_equal(copy.deepcopy(trajectory).value(1.0), trajectory.value(1.0))


def any_path(rng):
    """Segments of any length from 1e-16 to 3 rad, and cuts at their corners, in half of them."""
    low, high = np.maximum(LIMITS.lower, -6.0), np.minimum(LIMITS.upper, 6.0)
    waypoints = [np.zeros(7) if rng.random() < 0.5 else rng.uniform(low, high)]
    for _ in range(rng.integers(1, 6)):
        way = rng.normal(size=7)
        way *= 10.0 ** rng.uniform(-16, np.log10(3.0)) / np.linalg.norm(way)
        waypoints.append(np.clip(waypoints[-1] + way, low, high))
    lengths = np.linalg.norm(np.diff(waypoints, axis=0), axis=1)
    cuts = np.zeros(len(waypoints))
    if rng.random() < 0.5:
        cuts[1:-1] = rng.random(len(cuts) - 2) * np.minimum(lengths[:-1], lengths[1:]) / 2.0
    return np.array(waypoints), cuts


@pytest.mark.parametrize("seed", range(10))
def test_a_path_however_short_its_segments_is_timed_from_its_first_to_its_last_waypoint(seed):
    rng = np.random.default_rng(seed)
    for _ in range(10):
        waypoints, cuts = any_path(rng)
        trajectory = time_path(waypoints, VELOCITY_LIMIT, cuts=cuts)
        position, velocity, acceleration = sampled(trajectory, 300)
        np.testing.assert_allclose(position[:, [0, -1]].T, waypoints[[0, -1]], atol=1e-12)
        assert np.isfinite(velocity).all() and np.isfinite(acceleration).all()
        assert max(shares(trajectory)) <= 1.0 + 1e-3


@pytest.mark.parametrize("length", [5e-324, 1e-200, 1e-16, 1e-12, 1e-9, 6e-7, 1e-5, 3e-5, 1e-3])
def test_a_short_way_takes_little_time_and_ends_where_it_should(length):
    ends = np.array([np.zeros(7), length * np.eye(7)[2]])
    trajectory = time_path(ends, VELOCITY_LIMIT)
    assert trajectory.value(trajectory.end_time()).ravel() == pytest.approx(ends[1], rel=1e-9)
    # The briefest for no jerk to speak of, or half as long again as theory says.
    theory = 2.0 * np.sqrt(length / (SCALE * ACCELERATION_LIMIT))
    assert trajectory.end_time() <= max(1e-3, 1.5 * theory)


def test_a_detour_of_a_rounding_is_passed():
    """A long way, and a waypoint that misses its like by a nanoradian."""
    waypoints = np.vstack([WAYPOINTS[:2], WAYPOINTS[1] + 1e-9, WAYPOINTS[2:]])
    ends = [time_path(w, VELOCITY_LIMIT).end_time() for w in (WAYPOINTS, waypoints)]
    assert ends[0] < ends[1] < ends[0] + 0.01


def test_an_arm_of_six_joints_is_timed_within_its_limits():
    waypoints = np.array([np.zeros(6), np.full(6, 0.5), np.full(6, 0.5 + 1e-10)])
    trajectory = time_path(waypoints, np.full(6, 0.7))
    _, velocity, _ = sampled(trajectory)
    assert 0.98 < np.abs(velocity).max() / (SCALE * 0.7) <= 1.0 + 1e-4
    assert trajectory.value(trajectory.end_time()).ravel() == pytest.approx(waypoints[-1])


def test_a_failure_of_toppra_is_not_printed(monkeypatch, capfd):
    """Rounding that TOPP-RA is made to refuse: the motion rests at the corners instead."""
    monkeypatch.setattr(timing.Toppra, "SolvePathParameterization", lambda _: log_an_error())
    trajectory = time_path(WAYPOINTS, VELOCITY_LIMIT, cuts=CUTS[-1])
    assert capfd.readouterr() == ("", "")
    assert max(shares(trajectory)) <= 1.0 + 1e-6
    assert trajectory.value(trajectory.end_time()).ravel() == pytest.approx(WAYPOINTS[-1])


def log_an_error():
    logging.getLogger("drake").error("Toppra failed to find the maximum path acceleration.")


class TestLimits:
    BEYOND = HOME + np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.2 - HOME[5], 0.0])  # the limit is 2.09

    def test_a_goal_beyond_a_limit_is_refused_by_name(self):
        with pytest.raises(ModelError, match=r"waypoints\[1\]: joint_6 at 2.2 rad; valid: -2.09"):
            time_path(np.array([HOME, self.BEYOND]), VELOCITY_LIMIT)

    def test_a_start_beyond_a_limit_may_be_left_by_and_by(self):
        back = [self.BEYOND, 0.5 * (self.BEYOND + HOME) + 0.02, HOME]
        trajectory = time_path(np.array(back), VELOCITY_LIMIT)
        assert trajectory.value(trajectory.end_time()).ravel() == pytest.approx(HOME)

    def test_a_start_beyond_a_limit_may_not_be_left_outwards(self):
        further = self.BEYOND + 0.1 * np.eye(7)[5]
        with pytest.raises(ModelError, match=r"waypoints\[1\]: joint_6 at 2.3 rad"):
            time_path(np.array([self.BEYOND, further, HOME]), VELOCITY_LIMIT)

    def test_a_joint_at_its_limit_is_within_by_a_rounding(self):
        at = HOME.copy()
        at[5] = LIMITS.upper[5] + 1e-12
        assert time_path(np.array([HOME, at]), VELOCITY_LIMIT).end_time() > 0.5

    def test_limits_of_ones_own_are_taken(self):
        limits = JointLimits(("a", "b"), np.zeros(2), np.ones(2))
        with pytest.raises(ModelError, match="b at 2 rad; valid: 0 to 1 rad"):
            time_path([[0.0, 0.0], [1.0, 2.0]], 1.0, limits=limits)


@pytest.mark.parametrize(
    ("waypoints", "options", "message"),
    [
        (np.zeros((1, 7)), {}, "waypoints.*m ≥ 2"),
        (np.zeros((2, 0)), {}, "waypoints.*m ≥ 2"),
        (np.zeros(7), {}, "waypoints.*m ≥ 2"),
        (np.zeros((2, 6)), {}, "velocity_limit has shape"),
        (np.zeros((2, 8)), {}, "velocity_limit has shape"),
        ([["a"] * 7] * 2, {}, "waypoints.*real numbers"),
        ([[0.0], [0.0, 1.0]], {}, "waypoints.*real numbers"),
        (np.zeros((2, 7)) + 1j, {}, "waypoints.*real numbers"),
        (np.full((2, 7), np.nan), {}, "waypoints.*finite"),
        (np.full((2, 7), 2.0 * LARGEST) * np.eye(7)[0], {}, "joint_1 at 2e"),
        (np.full((2, 7), 90.0), {}, "joint_[246] at 90 rad"),
        (np.zeros((2, 7)), {"scale": 1.5}, "scale: 1.5; valid"),
        (np.zeros((2, 7)), {"scale": np.nan}, "scale: nan; valid"),
        (np.zeros((2, 7)), {"scale": "fast"}, "scale: 'fast'; valid"),
        (np.zeros((2, 7)), {"acceleration_limit": 0.0}, "acceleration_limit"),
        (np.zeros((2, 7)), {"acceleration_limit": np.inf}, "acceleration_limit"),
        (np.zeros((2, 7)), {"acceleration_limit": np.ones((7, 7))}, "acceleration_limit"),
        (np.zeros((2, 7)), {"cuts": np.zeros(3)}, "cuts: shape"),
        (np.zeros((2, 7)), {"cuts": -np.ones(2)}, "cuts.*≥ 0"),
        (np.zeros((2, 7)), {"cuts": np.array([0.0, np.nan])}, "cuts.*finite"),
        (WAYPOINTS, {"cuts": np.full(4, 2.0)}, "cuts: two overlap"),
    ],
)
def test_bad_input_is_named(waypoints, options, message):
    with pytest.raises(ModelError, match=message):
        time_path(waypoints, VELOCITY_LIMIT, **options)


@pytest.mark.parametrize("limit", [0.0, -1.0, np.nan, "fast", None, VELOCITY_LIMIT[:6]])
def test_a_velocity_limit_is_above_zero(limit):
    with pytest.raises(ModelError, match="velocity_limit"):
        time_path(WAYPOINTS, limit)


@pytest.mark.parametrize(("velocity", "acceleration"), [(1e-9, 1e-12), (1e-3, 1e9), (1e9, 1e-9)])
def test_limits_far_from_any_arms_are_no_error(velocity, acceleration):
    trajectory = time_path(WAYPOINTS, velocity, acceleration)
    assert trajectory.value(trajectory.end_time()).ravel() == pytest.approx(WAYPOINTS[-1])
    _, v, a = sampled(trajectory)
    assert np.abs(v).max() <= velocity and np.abs(a).max() <= acceleration
