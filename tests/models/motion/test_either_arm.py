"""Paths, proofs and timing of either arm, by the same functions; compared with fine sweeps."""

from itertools import pairwise

import numpy as np
import pytest
from pydrake.math import RigidTransform

from models.errors import ModelError
from models.motion.bounds import QUERY, MotionBounds
from models.motion.paths import PROVED, PathPlanner, plan_path, wind_path
from models.motion.timing import ACCELERATION_LIMIT, SCALE, time_path
from models.scenes.planning_scene import MARGIN, PlanningScene
from models.scenes.robots import GEN3, GEN3_LITE


@pytest.fixture(scope="module", params=[GEN3, GEN3_LITE], ids=["gen3", "gen3_lite"])
def paths(request):
    """The cube is before the hand at home, in the way from left to right."""
    scene = PlanningScene(carrying=True, robot=request.param)
    scene.place_cube(RigidTransform(scene.forward(scene.robot.home).translation()))
    return PathPlanner(scene)


@pytest.fixture(scope="module")
def scene(paths):
    return paths.scene


@pytest.fixture(scope="module")
def ends(scene):
    """Left and right of home."""
    side = 0.9 * np.eye(len(scene.arm_index))[0]
    return scene.robot.home + side, scene.robot.home - side


def postures(scene, rng, count):
    low, high = np.maximum(scene.lower, -np.pi), np.minimum(scene.upper, np.pi)
    return rng.uniform(low, high, (count, len(low)))


def smallest_distance(scene, a, b, n=150):
    return min(scene.clearance(a + t * (b - a), 0.02).distance for t in np.linspace(0, 1, n))


def test_segment_through_an_obstacle_is_not_free(paths, scene, ends):
    assert all(scene.is_free(q) for q in ends)
    assert not paths.segment_is_free(*ends)
    assert not paths.segment_is_free(*ends[::-1])


def test_verdicts_agree_with_a_fine_sweep(paths, scene, ends):
    rng = np.random.default_rng(0)
    verdicts = []
    while len(verdicts) < 30:
        a, b = np.array(ends) + rng.normal(0.0, 0.3, (2, len(ends[0])))
        if scene.is_free(a) and scene.is_free(b):
            free = paths.segment_is_free(a, b)
            distance = smallest_distance(scene, a, b)
            assert distance > PROVED * MARGIN if free else distance <= MARGIN + 1e-3
            verdicts.append(free)
    assert 3 < sum(verdicts) < 27


def test_a_search_finds_a_way_and_the_same_every_time(paths, scene, ends):
    path, again = (paths.plan(*ends, search=np.random.default_rng(0)) for _ in range(2))
    np.testing.assert_array_equal(path, again)
    assert len(path) > 2
    for a, b in pairwise(path):
        assert smallest_distance(scene, a, b) > PROVED * MARGIN
        assert scene.within_limits(b)
    # Through its own waypoints, by the short form.
    via = plan_path(scene, *ends, [list(path[1:-1])])
    np.testing.assert_allclose(via, wind_path(scene, list(path)), atol=1e-12)


def test_a_free_share_is_free_both_ways(scene):
    bounds, rng = MotionBounds(scene), np.random.default_rng(2)
    found = 0
    for q in postures(scene, rng, 150):
        step = rng.normal(size=len(q))
        share = bounds.free_share(q, bounds.rates(step), margin=MARGIN, kept=MARGIN / 2)
        assert (share > 0.0) == (scene.clearance(q, QUERY).distance > MARGIN)
        if share > 0.0:
            found += 1
            for t in np.linspace(-1.0, 1.0, 15) * share:
                assert scene.clearance(q + t * step, QUERY).distance >= MARGIN / 2 - 1e-6
    assert found > 20


def test_links_move_with_the_joints_between_them_only(scene):
    n_joints = len(scene.arm_index)
    rates = MotionBounds(scene).rates(np.eye(n_joints)[3])  # joint 4 is between links 3 and 4
    np.testing.assert_array_equal(rates, rates.T)
    apart = np.not_equal.outer(*2 * [np.arange(n_joints + 1) > 3])
    np.testing.assert_array_equal(rates > 0.0, apart)


def test_any_path_is_timed_within_the_limits(scene):
    rng = np.random.default_rng(3)
    for waypoints in postures(scene, rng, 60).reshape(20, 3, -1):
        steps = rng.choice([1e-9, 1e-4, 0.1, 1.0], (2, 1))
        waypoints[1:] = waypoints[:-1] + steps * (waypoints[1:] - waypoints[:-1])
        waypoints[2] = np.clip(waypoints[2], scene.lower, scene.upper)
        motion = time_path(waypoints, scene.velocity_limit)
        times = np.linspace(0.0, motion.end_time(), 500)
        velocity, acceleration = (
            np.abs(motion.MakeDerivative(order).vector_values(times)) for order in (1, 2)
        )
        assert (velocity.max(axis=1) <= SCALE * scene.velocity_limit * 1.001).all()
        assert acceleration.max() <= SCALE * ACCELERATION_LIMIT * 1.001
        ends = motion.vector_values([0.0, motion.end_time()]).T
        np.testing.assert_allclose(ends, waypoints[[0, -1]], atol=1e-9)


def test_a_goal_beyond_a_joint_limit_is_refused_by_name(paths, scene):
    home = scene.robot.home
    joint = int(np.flatnonzero(~scene.continuous)[-1])
    beyond = home + (scene.upper[joint] + 0.1 - home[joint]) * np.eye(len(home))[joint]
    name = scene.robot.joints[joint]
    with pytest.raises(ModelError, match=rf"q_to: {name} at .* rad; valid"):
        paths.plan(home, beyond)
    with pytest.raises(ModelError, match=rf"waypoints\[1\]: {name} at .* rad; valid"):
        time_path([home, beyond], scene.velocity_limit)
    with pytest.raises(ModelError, match="q_to"):
        paths.plan(home, home[:-1])
