"""Bounds on the robot's motion, against motions."""

import numpy as np
import pytest
from pydrake.multibody.tree import BodyIndex

from models.motion.bounds import QUERY, MotionBounds
from models.scenes.gripper import MAX_OPENING
from models.scenes.parsing import ARM, GRIPPER
from models.scenes.planning_scene import MARGIN, PlanningScene

KEPT = MARGIN / 2


@pytest.fixture(scope="module", params=[False, True], ids=["empty", "carrying"])
def bounds(request):
    return MotionBounds(PlanningScene(carrying=request.param))


def postures(scene, n, seed=0):
    low, high = np.maximum(scene.lower, -np.pi), np.minimum(scene.upper, np.pi)
    return np.random.default_rng(seed).uniform(low, high, (n, 7))


def link_points(scene, q):
    """Points on the collision shapes of link 0 … 7 and the links' poses, at ``q``."""
    plant = scene.plant
    inspector = plant.get_geometry_query_input_port().Eval(scene.context).inspector()
    scene.forward(q)
    arm, hand = (plant.GetModelInstanceByName(name) for name in (ARM, GRIPPER))
    moving = [plant.GetJointByName(f"joint_{i}", arm).child_body() for i in range(1, 8)]
    groups = [[body] for body in moving]
    groups[-1] += [plant.get_body(BodyIndex(i)) for i in plant.GetBodyIndices(hand)]
    poses = [plant.world_body().EvalPoseInWorld(scene.context)]
    poses += [body.EvalPoseInWorld(scene.context) for body in moving]
    points = [np.zeros((3, 1))]
    for bodies in groups:
        of_link = []
        for body in bodies:
            for geometry in plant.GetCollisionGeometriesForBody(body):
                box = inspector.GetObbInGeometryFrame(geometry)
                # The middles of the box's faces are points of capsules and cylinders too.
                faces = box.pose() @ np.hstack([s * np.diag(box.half_width()) for s in (1, -1)])
                X_WG = body.EvalPoseInWorld(scene.context) @ inspector.GetPoseInFrame(geometry)
                of_link.append(X_WG @ faces)
        points.append(np.hstack(of_link))
    return points, poses


def test_no_point_moves_further_than_its_bound_seen_from_any_link(bounds):
    scene, rng = bounds.scene, np.random.default_rng(1)
    tightest = 0.0
    for q in postures(scene, 60):
        step = rng.normal(size=7) * rng.choice([0.0, 1.0], 7) * rng.choice([1e-3, 0.1, 1.0])
        rates = bounds.rates(step)
        (before, X0), (after, X1) = link_points(scene, q), link_points(scene, q + step)
        for low in range(8):
            for high in range(low + 1, 8):
                seen = X0[low].inverse() @ before[high], X1[low].inverse() @ after[high]
                moved = np.linalg.norm(seen[1] - seen[0], axis=0).max()
                assert moved <= rates[low, high] + 1e-12
                if rates[low, high] > 0.0:
                    tightest = max(tightest, moved / rates[low, high])
    assert tightest > 0.8


def test_bounds_hold_for_any_opening_of_the_fingers():
    scene = PlanningScene()
    bounds = MotionBounds(scene)
    turn = 1e-3 * np.eye(7)[6]
    for width in np.linspace(0.0, MAX_OPENING, 7):
        scene.open_to(width)
        before, after = (link_points(scene, q)[0] for q in (np.zeros(7), turn))
        moved = np.linalg.norm(after[7] - before[7], axis=0).max()
        assert 0.5 * bounds.rates(turn)[0, 7] < moved <= bounds.rates(turn)[0, 7]


def test_links_move_with_the_joints_between_them_only(bounds):
    rates = bounds.rates(np.eye(7)[3])  # joint 4 is between links 3 and 4
    np.testing.assert_array_equal(rates, rates.T)
    np.testing.assert_array_equal(rates > 0.0, np.not_equal.outer(*2 * [np.arange(8) > 3]))


def test_a_free_share_is_free_both_ways(bounds):
    scene, rng = bounds.scene, np.random.default_rng(2)
    found = 0
    for q in postures(scene, 150):
        step = rng.normal(size=7)
        share = bounds.free_share(q, bounds.rates(step), margin=MARGIN, kept=KEPT)
        distance = scene.clearance(q, QUERY).distance
        assert (share > 0.0) == (distance > MARGIN)
        if share > 0.0:
            found += 1
            for t in np.linspace(-1.0, 1.0, 15) * share:
                assert scene.clearance(q + t * step, QUERY).distance >= KEPT - 1e-6
    assert found > 20
