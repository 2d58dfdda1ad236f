"""Joint paths: what is checked, and how they are timed."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from models.errors import ModelError
from models.kinematics import HOME, PlanningScene
from models.paths import (
    ACCELERATION_LIMIT,
    LEVERS,
    SCALE,
    SHORTEST,
    coarse_to_fine,
    plan_path,
    segment_is_free,
    timed,
    wind_path,
)

LEFT, RIGHT = HOME + np.array([0.9] + [0.0] * 6), HOME - np.array([0.9] + [0.0] * 6)
ABOVE = HOME + np.array([0.0, -0.6, 0.0, 0.0, 0.0, 0.0, 0.0])


@pytest.fixture
def blocked():
    """A scene with the cube before the hand at home, in the way from left to right."""
    scene = PlanningScene(carrying=True)
    scene.place_cube(RigidTransform(scene.forward(HOME).translation()))
    return scene


@pytest.mark.parametrize("count", [1, 2, 3, 7, 8, 21])
def test_coarse_to_fine_visits_everything_once(count):
    assert sorted(coarse_to_fine(count)) == list(range(1, count + 1))


def test_coarse_to_fine_begins_in_the_middle():
    assert coarse_to_fine(8)[:4] == [8, 4, 2, 6]


def test_segment_through_an_obstacle_is_not_free(blocked):
    assert blocked.is_free(LEFT) and blocked.is_free(RIGHT)
    assert not segment_is_free(blocked, LEFT, RIGHT)
    assert not segment_is_free(blocked, RIGHT, LEFT)


def test_the_start_is_not_checked_but_the_end_is(blocked):
    assert not segment_is_free(blocked, LEFT, HOME)
    assert segment_is_free(PlanningScene(), HOME, LEFT)


def test_path_goes_through_the_first_via_that_serves(blocked):
    assert plan_path(blocked, LEFT, RIGHT) is None
    path = plan_path(blocked, LEFT, RIGHT, [[HOME], [ABOVE], [LEFT, ABOVE]])
    np.testing.assert_allclose(path, [LEFT, ABOVE, RIGHT])


def test_endless_joints_go_the_shorter_way():
    scene = PlanningScene()
    turns = 2 * np.pi * np.array([1, 0, -1, 0, 2, 0, 3])
    path = plan_path(scene, HOME, LEFT + turns)
    np.testing.assert_allclose(path, [HOME, LEFT], atol=1e-12)
    path = wind_path(scene, [HOME + turns, LEFT, HOME])
    np.testing.assert_allclose(path, [HOME + turns, LEFT + turns, HOME + turns], atol=1e-12)


def test_levers_bound_the_motion_of_the_hand():
    """Move each joint a little: no corner of the open hand goes further than its lever."""
    scene, rng = PlanningScene(), np.random.default_rng(0)
    corners = np.array([[x, y, 0.0] for x in (-0.02, 0.02) for y in (-0.06, 0.06)])
    low, high = np.maximum(scene.lower, -np.pi), np.minimum(scene.upper, np.pi)
    for q in rng.uniform(low, high, (100, 7)):
        before = scene.forward(q)
        for joint in range(7):
            after = scene.forward(q + 1e-4 * np.eye(7)[joint])
            moved = [np.linalg.norm(after @ p - before @ p) for p in corners]
            assert max(moved) <= 1e-4 * LEVERS[joint]


class TestTimed:
    waypoints = np.array([HOME, HOME + 0.5, HOME + np.array([0.1, 1, -1, 0, 0, 0.3, 2]), HOME])
    velocity_limit = np.array([1.4, 1.4, 1.4, 1.4, 1.2, 1.2, 1.2])

    def samples(self, **options):
        trajectory = timed(self.waypoints, self.velocity_limit, **options)
        times = np.linspace(0.0, trajectory.end_time(), 3000)
        return [trajectory.MakeDerivative(order).vector_values(times) for order in range(3)]

    @pytest.mark.parametrize("scale", [SCALE, 0.3, 1.0])
    def test_limits_are_respected_and_used(self, scale):
        _, velocity, acceleration = self.samples(scale=scale)
        share_v = np.abs(velocity).max(axis=1) / (scale * self.velocity_limit)
        share_a = np.abs(acceleration).max(axis=1) / (scale * ACCELERATION_LIMIT)
        assert max(share_v.max(), share_a.max()) <= 1.0 + 1e-6
        assert max(share_v.max(), share_a.max()) > 0.99

    def test_motion_stays_on_the_segments_and_rests_at_the_waypoints(self):
        position, velocity, acceleration = self.samples()
        for q in position.T:
            off = [
                np.linalg.norm((q - a) - (b - a) * ((q - a) @ (b - a)) / ((b - a) @ (b - a)))
                for a, b in zip(self.waypoints[:-1], self.waypoints[1:], strict=True)
            ]
            assert min(off) < 1e-9
        trajectory = timed(self.waypoints, self.velocity_limit)
        for time, q in zip(trajectory.get_segment_times(), self.waypoints, strict=True):
            np.testing.assert_allclose(trajectory.value(time).ravel(), q, atol=1e-9)
            np.testing.assert_allclose(trajectory.EvalDerivative(time, 1), 0.0, atol=1e-9)
        np.testing.assert_allclose(velocity[:, [0, -1]], 0.0, atol=1e-9)
        np.testing.assert_allclose(acceleration[:, [0, -1]], 0.0, atol=1e-6)

    def test_a_motion_to_the_same_place_is_short(self):
        trajectory = timed(np.array([HOME, HOME]), self.velocity_limit)
        assert trajectory.end_time() == pytest.approx(SHORTEST)
        np.testing.assert_allclose(trajectory.value(SHORTEST).ravel(), HOME)

    @pytest.mark.parametrize(
        ("waypoints", "options", "message"),
        [
            (np.zeros((1, 7)), {}, "waypoints.*n ≥ 2"),
            (np.full((2, 7), np.nan), {}, "waypoints.*finite"),
            (np.zeros((2, 7)), {"scale": 1.5}, "scale: 1.5; valid"),
            (np.zeros((2, 7)), {"acceleration_limit": 0.0}, "acceleration_limit"),
        ],
    )
    def test_bad_input_is_named(self, waypoints, options, message):
        with pytest.raises(ModelError, match=message):
            timed(waypoints, self.velocity_limit, **options)
