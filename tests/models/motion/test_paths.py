"""Joint paths: what is proved free, and how ways are found."""

from itertools import pairwise

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from models.motion.paths import PROVED, PathPlanner, plan_path, wind_path
from models.scenes.planning_scene import HOME, MARGIN, PlanningScene

LEFT, RIGHT = HOME + np.array([0.9] + [0.0] * 6), HOME - np.array([0.9] + [0.0] * 6)
ABOVE = HOME + np.array([0.0, -0.6, 0.0, 0.0, 0.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def carrying():
    return PathPlanner(PlanningScene(carrying=True))


@pytest.fixture
def paths(carrying):
    """The cube is before the hand at home, in the way from left to right."""
    scene = carrying.scene
    scene.place_cube(RigidTransform(scene.forward(HOME).translation()))
    return carrying


@pytest.fixture
def blocked(paths):
    return paths.scene


@pytest.fixture(scope="module")
def empty():
    return PathPlanner(PlanningScene())


def smallest_distance(scene, a, b, n=150):
    return min(scene.clearance(a + t * (b - a), 0.02).distance for t in np.linspace(0, 1, n))


def test_segment_through_an_obstacle_is_not_free(paths, blocked):
    assert blocked.is_free(LEFT) and blocked.is_free(RIGHT)
    assert not paths.segment_is_free(LEFT, RIGHT)
    assert not paths.segment_is_free(RIGHT, LEFT)


def test_verdicts_agree_with_a_fine_sweep(paths, blocked):
    rng = np.random.default_rng(0)
    verdicts = []
    while len(verdicts) < 30:
        a, b = np.array([LEFT, RIGHT]) + rng.normal(0.0, 0.3, (2, 7))
        if blocked.is_free(a) and blocked.is_free(b):
            free = paths.segment_is_free(a, b)
            distance = smallest_distance(blocked, a, b)
            assert distance > PROVED * MARGIN if free else distance <= MARGIN + 1e-3
            verdicts.append(free)
    assert 5 < sum(verdicts) < 25


@pytest.mark.parametrize(
    ("gap", "free"), [(1.05 * MARGIN, True), (0.95 * PROVED * MARGIN, False), (-1e-4, False)]
)
def test_a_short_brush_with_an_edge_is_found(carrying, gap, free):
    """The hand passes an upright edge of the cube that only its foremost part comes near."""
    scene = carrying.scene
    ends = HOME - np.eye(7)[0], HOME + np.eye(7)[0]
    x = scene.forward(HOME).translation() + np.array([0.08, 0.0, 0.0])
    for _ in range(4):
        scene.place_cube(RigidTransform(RollPitchYaw(0.0, 0.0, np.pi / 4), x))
        near = [HOME + turn * np.eye(7)[0] for turn in np.linspace(-0.05, 0.05, 401)]
        x[0] += gap - min(scene.clearance(q, 0.2).distance for q in near)
    assert carrying.segment_is_free(*ends) == free


def test_a_start_within_the_margin_may_be_left_but_an_end_may_not_be_entered(paths, empty):
    blocked = paths.scene
    assert not paths.segment_is_free(LEFT, HOME)
    assert empty.segment_is_free(HOME, LEFT)
    X_WG = blocked.forward(HOME)
    up = X_WG.translation() + np.array([0.0, 0.0, 0.0485])
    blocked.place_cube(RigidTransform(up))
    assert not blocked.is_free(HOME)
    lower = HOME + np.array([0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert paths.segment_is_free(HOME, lower)
    assert not paths.segment_is_free(lower, HOME)


def test_path_goes_through_the_first_via_that_serves(paths):
    assert paths.plan(LEFT, RIGHT) is None
    path = paths.plan(LEFT, RIGHT, [[HOME], [ABOVE], [LEFT, ABOVE]])
    np.testing.assert_allclose(path, [LEFT, ABOVE, RIGHT])
    # The short form measures the scene anew.
    again = plan_path(paths.scene, LEFT, RIGHT, [[HOME], [ABOVE]])
    np.testing.assert_array_equal(again, path)


def test_a_search_finds_what_no_via_does_and_the_same_every_time(paths, blocked):
    path, again = (
        paths.plan(LEFT, RIGHT, [[HOME]], search=np.random.default_rng(seed)) for seed in (0, 0)
    )
    np.testing.assert_array_equal(path, again)
    np.testing.assert_array_equal(path[0], LEFT)
    np.testing.assert_allclose(blocked.wind(path[-1], RIGHT), RIGHT, atol=1e-12)
    assert len(path) > 2
    for a, b in pairwise(path):
        assert smallest_distance(blocked, a, b) > PROVED * MARGIN
        assert blocked.within_limits(b)


def test_a_search_does_not_begin_for_an_end_that_is_not_free(paths):
    rng = np.random.default_rng(0)
    assert paths.plan(LEFT, HOME, search=rng) is None
    assert rng.random() == np.random.default_rng(0).random()


def test_endless_joints_go_the_shorter_way(empty):
    turns = 2 * np.pi * np.array([1, 0, -1, 0, 2, 0, 3])
    path = empty.plan(HOME, LEFT + turns)
    np.testing.assert_allclose(path, [HOME, LEFT], atol=1e-12)
    path = wind_path(empty.scene, [HOME + turns, LEFT, HOME])
    np.testing.assert_allclose(path, [HOME + turns, LEFT + turns, HOME + turns], atol=1e-12)


class TestCornerCuts:
    path = np.array([LEFT, ABOVE, RIGHT])

    def test_the_whole_triangle_is_free(self, paths, blocked):
        cuts = paths.corner_cuts(self.path)
        assert cuts[0] == cuts[2] == 0.0 and 0.0 < cuts[1] <= 0.5
        u, v = (d / np.linalg.norm(d) for d in np.diff(self.path, axis=0))
        rng = np.random.default_rng(0)
        for back, forth in rng.dirichlet([1, 1, 1], 200)[:, :2]:
            q = self.path[1] + cuts[1] * (forth * v - back * u)
            assert blocked.clearance(q).distance > PROVED * MARGIN

    def test_cuts_shrink_with_the_distance_and_vanish_within_the_margin(self, paths, blocked):
        X_WG = blocked.forward(ABOVE)
        cuts = []
        for below in (0.2, 0.12, 0.08, 0.05):
            blocked.place_cube(RigidTransform(X_WG.translation() - [0.0, 0.0, below]))
            cuts.append(paths.corner_cuts(self.path)[1])
        assert all(a >= b for a, b in pairwise(cuts)) and cuts[-1] == 0.0 < cuts[0]

    def test_no_cut_is_longer_than_half_a_segment(self, empty):
        short = ABOVE + 1e-3
        cuts = empty.corner_cuts(np.array([LEFT, ABOVE, short, RIGHT]))
        half = np.linalg.norm(short - ABOVE) / 2
        np.testing.assert_allclose(cuts, [0.0, half, half, 0.0])

    def test_a_repeated_waypoint_is_not_a_corner(self, empty):
        path = np.array([LEFT, ABOVE, ABOVE, RIGHT])
        np.testing.assert_array_equal(empty.corner_cuts(path), np.zeros(4))
