"""Proofs with tools of one's own: what is welded to a link moves with it, whatever it is called."""

import numpy as np
import pytest
from pydrake.geometry import Box, HalfSpace, Sphere
from pydrake.math import RigidTransform

from models.errors import ModelError
from models.motion.bounds import MotionBounds
from models.motion.paths import PathPlanner
from models.scenes.planning_scene import HOME, PlanningScene
from models.scenes.robots import GEN3_LITE
from models.scenes.topology import links_of_bodies
from tests.models.tools import (
    BRACELET,
    FOREARM,
    HAND,
    add_body,
    hinged,
    link,
    random_tools,
    scene_with,
    weld_tool,
)

BAR = Box(0.03, 0.03, 0.10)
ABOVE = RigidTransform([0.12, 0.0, 0.0])


@pytest.mark.parametrize("seed", range(5))
def test_no_swing_declared_free_collides_and_what_keeps_clear_is_declared_free(seed):
    rng = np.random.default_rng(seed)
    scene = scene_with(lambda plant: random_tools(plant, rng))
    paths = PathPlanner(scene)
    low, high = np.maximum(scene.lower, -np.pi), np.minimum(scene.upper, np.pi)
    swings = free = 0
    while swings < 10:
        q_from = rng.uniform(low, high)
        if not scene.is_free(q_from, 0.0):
            continue
        swings += 1
        q_to = np.clip(q_from + rng.normal(0.0, rng.choice([0.2, 0.5, 1.0]), 7), low, high)
        step = scene.wind(q_to, q_from) - q_from
        shares = np.linspace(0.0, 1.0, 200)
        nearest = min(scene.clearance(q_from + share * step).distance for share in shares)
        verdict = paths.segment_is_free(q_from, q_to)
        assert not verdict or nearest > 0.0
        assert verdict or nearest < 0.005
        free += verdict
    assert 0 < free < swings


@pytest.mark.parametrize(("where", "number"), [(HAND, 7), (BRACELET, 7), (FOREARM, 4)])
@pytest.mark.parametrize("outwards", [True, False])
def test_a_tool_moves_with_the_joints_before_the_link_that_it_is_welded_to(where, number, outwards):
    scene = scene_with(lambda plant: weld_tool(plant, where, BAR, ABOVE, outwards=outwards))
    tool = scene.plant.GetBodyByName(f"tool_on_{where[1]}")
    assert links_of_bodies(scene)[tool.index()] == number
    bounds, rng = MotionBounds(scene), np.random.default_rng(0)
    low, high = np.maximum(scene.lower, -np.pi), np.minimum(scene.upper, np.pi)
    corners = np.array(np.meshgrid(*[[-0.015, 0.015]] * 2, [-0.05, 0.05])).reshape(3, 8)
    for q in rng.uniform(low, high, (40, 7)):
        step = rng.normal(size=7) * rng.choice([0.0, 1.0], 7)
        places = []
        for posture in (q, q + step):
            scene.forward(posture)
            places.append(tool.EvalPoseInWorld(scene.context) @ corners)
        moved = np.linalg.norm(places[1] - places[0], axis=0).max()
        assert moved <= bounds.rates(step)[0, number] + 1e-12


def test_a_tool_is_not_driven_through_a_post():
    """Both small and away from all else: 4 of these swings were declared free, 6 mm deep."""

    def add(plant):
        weld_tool(plant, HAND, small, RigidTransform([0.0, 0.12, 0.12]))
        post = add_body(plant, "post", small)
        plant.WeldFrames(plant.world_frame(), post.body_frame(), RigidTransform(at))

    small, at = Box(0.006, 0.006, 0.006), np.array([0.0, 0.0, 5.0])
    scene = scene_with(add)
    scene.forward(HOME)
    tool = scene.plant.GetBodyByName("tool_on_base").EvalPoseInWorld(scene.context)
    at = tool.translation()
    scene = scene_with(add)
    paths, rng = PathPlanner(scene), np.random.default_rng(0)
    for _ in range(200):
        way = rng.normal(size=7)
        way /= np.linalg.norm(way)
        q_from, q_to = HOME - rng.uniform(0.15, 0.6) * way, HOME + rng.uniform(0.15, 0.6) * way
        assert not (scene.is_free(q_from) and paths.segment_is_free(q_from, q_to))
    assert scene.clearance(HOME).distance < 0.0


def test_what_the_arm_and_a_joint_of_its_own_move_is_refused():
    scene = scene_with(lambda plant: hinged(plant, link(plant, HAND).body_frame()))
    with pytest.raises(ModelError, match="flap: the arm moves it, and so does hinge"):
        PathPlanner(scene)


def test_a_door_in_the_room_stands_where_it_is():
    scene = scene_with(lambda plant: hinged(plant, plant.world_frame()))
    assert links_of_bodies(scene)[scene.plant.GetBodyByName("flap").index()] == 0
    PathPlanner(scene)


def test_a_shape_without_bounds_is_refused():
    with pytest.raises(ModelError, match=r"floor_shape.*no bounds"):
        PathPlanner(
            scene_with(
                lambda plant: plant.WeldFrames(
                    plant.world_frame(), add_body(plant, "floor", HalfSpace()).body_frame()
                )
            )
        )


def test_any_shape_may_be_welded_on_that_drake_measures():
    scene = scene_with(lambda plant: weld_tool(plant, FOREARM, Sphere(0.03), ABOVE))
    assert PathPlanner(scene).segment_is_free(HOME, HOME + 0.1)


def test_the_gen3_lites_paths_are_proved_by_the_same_function():
    scene = PlanningScene(robot=GEN3_LITE)
    paths, rng = PathPlanner(scene), np.random.default_rng(0)
    judged = []
    while len(judged) < 30:
        q_from = rng.uniform(scene.lower, scene.upper)
        if not scene.is_free(q_from, 0.0):
            continue
        q_to = np.clip(q_from + rng.normal(0.0, 0.3, 6), scene.lower, scene.upper)
        between = q_from + np.linspace(0.0, 1.0, 150)[:, None] * (q_to - q_from)
        nearest = min(scene.clearance(q).distance for q in between)
        verdict = paths.segment_is_free(q_from, q_to)
        assert not verdict or nearest > 0.0
        assert verdict or nearest < 0.005
        judged.append(verdict)
    assert 0 < sum(judged) < 30
