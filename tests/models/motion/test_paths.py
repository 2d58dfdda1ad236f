"""Joint paths: what is proved free, and how ways are found."""

from itertools import pairwise

import numpy as np
import pytest
from pydrake.geometry import Box
from pydrake.math import RigidTransform, RollPitchYaw

from models.errors import ModelError
from models.inverse_kinematics.optimised import follow
from models.motion.paths import PROVED, PathPlanner, plan_path, wind_path
from models.motion.timing import time_path
from models.scenes.planning_scene import HOME, MARGIN, PlanningScene
from tests.models.tools import add_body, scene_with

LEFT, RIGHT = HOME + np.array([0.9] + [0.0] * 6), HOME - np.array([0.9] + [0.0] * 6)
UP = np.array([0.0, 0.0, 1.0])
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


def test_ways_with_more_room_come_first(paths):
    near = next(
        via
        for lift in np.linspace(0.1, 0.6, 51)
        if paths.plan(LEFT, RIGHT, [[via := HOME - lift * np.eye(7)[1]]]) is not None
    )
    vias = [[near], [ABOVE]]
    np.testing.assert_array_equal(paths.plan(LEFT, RIGHT, vias)[1], near)
    np.testing.assert_array_equal(paths.plan(LEFT, RIGHT, vias, room=0.02)[1], ABOVE)
    # Where nothing has that much, or an end has not, it is as if none had been asked for.
    np.testing.assert_array_equal(paths.plan(LEFT, RIGHT, vias[:1], room=0.02)[1], near)
    np.testing.assert_array_equal(paths.plan(LEFT, RIGHT, vias, room=0.4)[1], near)


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


class TestRefusals:
    BEYOND = HOME + (2.2 - HOME[5]) * np.eye(7)[5]  # of joint 6, whose limit is 2.09

    def test_a_goal_beyond_a_joint_limit_is_refused_by_name(self, empty):
        with pytest.raises(ModelError, match=r"q_to: joint_6 at 2.2 rad; valid: -2.09 to 2.09"):
            empty.plan(HOME, self.BEYOND)
        with pytest.raises(ModelError, match=r"via: joint_6 at 2.2 rad"):
            empty.plan(HOME, HOME + 0.1, [[self.BEYOND]])
        with pytest.raises(ModelError, match=r"q_to: joint_4 at -130.061 rad"):
            plan_path(empty.scene, HOME, np.degrees(HOME))

    def test_a_goal_at_a_limit_is_none_beyond(self, empty):
        at = HOME + (empty.scene.upper[5] + 1e-12 - HOME[5]) * np.eye(7)[5]
        assert empty.plan(HOME, at) is not None

    def test_a_start_beyond_a_limit_may_be_left(self, empty):
        path = empty.plan(self.BEYOND, HOME)
        np.testing.assert_array_equal(path, [self.BEYOND, HOME])
        assert time_path(path, empty.scene.velocity_limit).end_time() > 0.5

    @pytest.mark.parametrize("q", [HOME[:6], np.append(HOME, 0.0), HOME * np.nan, HOME + 1j, "q"])
    def test_what_is_no_posture_is_refused(self, empty, q):
        for ask in (
            lambda: empty.plan(q, HOME),
            lambda: empty.plan(HOME, q),
            lambda: empty.plan(HOME, HOME + 0.1, [[q]]),
            lambda: empty.segment_is_free(q, HOME),
            lambda: empty.segment_is_free(HOME, q),
            lambda: empty.corner_cuts([q, q]),
        ):
            with pytest.raises(ModelError, match=r"q_from|q_to|via|waypoints"):
                ask()

    @pytest.mark.parametrize("margin", [0.0, -0.001, np.nan, np.inf, "wide", None])
    def test_a_margin_is_above_zero(self, empty, margin):
        with pytest.raises(ModelError, match="margin"):
            PathPlanner(empty.scene, margin)

    @pytest.mark.parametrize("room", [0.5 * MARGIN, 0.0, -1.0, np.nan])
    def test_room_is_at_least_the_margin(self, empty, room):
        with pytest.raises(ModelError, match=r"room|margin"):
            empty.plan(LEFT, RIGHT, room=room)

    def test_a_search_draws_from_a_generator(self, empty):
        with pytest.raises(ModelError, match="search: 0"):
            empty.plan(HOME, LEFT, search=0)

    def test_scenes_are_scenes(self):
        with pytest.raises(ModelError, match="scene: NoneType"):
            PathPlanner(None)


def test_a_wide_margin_is_kept_as_well(blocked):
    """Wider than a distance query looks in general."""
    q_from, q_to = LEFT, LEFT + 0.05 * np.eye(7)[0]
    nearest = smallest_distance(blocked, q_from, q_to)
    wide = PathPlanner(blocked, max(0.04, nearest + 0.01))
    assert not wide.segment_is_free(q_from, q_to)


def distance_of(scene, name):
    """Of a body, from whatever is nearest to it at home."""
    scene.forward(HOME)
    query = scene.plant.get_geometry_query_input_port().Eval(scene.context)
    ids = set(scene.plant.GetCollisionGeometriesForBody(scene.plant.GetBodyByName(name)))
    pairs = query.ComputeSignedDistancePairwiseClosestPoints(0.2)
    return min(pair.distance for pair in pairs if {pair.id_A, pair.id_B} & ids)


def test_a_start_near_a_thin_plate_may_be_left_but_not_through_it(empty):
    """The plate is thinner than the way that a start within the margin may go to gain it."""

    def scene_at(height):
        def add(plant):
            plate = add_body(plant, "plate", Box(0.2, 0.2, 0.004))
            X_WP = RigidTransform(tcp + height * UP)
            plant.WeldFrames(plant.world_frame(), plate.body_frame(), X_WP)

        return scene_with(add)

    X_WG = empty.scene.forward(HOME)
    tcp = X_WG.translation()
    height = 0.15
    for _ in range(6):
        paths = PathPlanner(scene_at(height))
        height -= distance_of(paths.scene, "plate") - MARGIN / 2.0
    assert paths.scene.clearance(HOME).distance == pytest.approx(MARGIN / 2.0, rel=0.1)
    higher, lower = (
        follow(paths.scene, RigidTransform(X_WG.rotation(), tcp + rise * UP), HOME)
        for rise in (0.1, -0.1)
    )
    assert paths.scene.is_free(lower) and smallest_distance(paths.scene, HOME, higher) < 0.0
    assert not paths.segment_is_free(HOME, higher)
    assert paths.segment_is_free(HOME, lower)
    assert not paths.segment_is_free(lower, HOME)
