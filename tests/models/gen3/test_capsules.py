"""The fast collision check against Drake's shapes and distances."""

import numpy as np
import pytest
from pydrake.geometry import Box, Capsule, Cylinder, Ellipsoid, Sphere
from pydrake.math import RigidTransform, RollPitchYaw

from models.gen3.capsules import DOUBTFUL, FREE, FURNITURE, SELF, capsules_of, enclose, verdicts
from models.scenes.planning_scene import MARGIN, PlanningScene
from models.scenes.setup import Obstacle, Setup, Tool
from tests.models.tools import FOREARM, hinged, random_tools, scene_with, weld_tool


def surface(shape, rng, count=400):
    """Random points on, or at the rim of, a shape ``[count, 3]``."""
    if isinstance(shape, Box):
        return rng.choice([-0.5, 0.5], (count, 3)) * shape.size()
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    ends = rng.choice([-0.5, 0.5], count) * shape.length()
    rim = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1) * shape.radius()
    return rim + ends[:, None] * np.eye(3)[2]


SHAPES = [
    Box(0.1, 0.02, 0.05),
    Box(0.02, 0.03, 0.3),
    Box(0.1, 0.1, 0.1),
    Cylinder(0.03, 0.1),
    Cylinder(0.05, 0.02),
    Capsule(0.02, 0.2),
]


@pytest.mark.parametrize("shape", SHAPES)
def test_a_capsule_contains_its_shape_which_contains_the_core(shape):
    _, half, radius, (share, within) = enclose(shape)
    points = surface(shape, np.random.default_rng(0))
    along = np.clip(points @ half / (half @ half), -1.0, 1.0)
    distance = np.linalg.norm(points - along[:, None] * half, axis=1)
    assert distance.max() <= radius + 1e-12
    assert (share == 1.0) == isinstance(shape, Capsule)
    if not isinstance(shape, Capsule):
        along = np.clip(points @ half / (half @ half), -share, share)
        assert np.linalg.norm(points - along[:, None] * half, axis=1).min() >= within - 1e-12


def test_a_ball_is_its_own_capsule_and_what_drake_alone_measures_has_none():
    _, half, radius, core = enclose(Sphere(0.1))
    assert (half == 0.0).all() and radius == core[1] == 0.1
    assert enclose(Ellipsoid(0.1, 0.2, 0.3)) is None


@pytest.mark.parametrize("carrying", [False, True])
@pytest.mark.parametrize("margin", [MARGIN, 0.01])
def test_verdicts_agree_with_drake(carrying, margin):
    """Postures bent towards body and table, where the arm often collides."""
    scene = PlanningScene(carrying=carrying)
    capsules = capsules_of(scene)
    rng = np.random.default_rng(1)
    low = np.maximum(scene.lower, [-np.pi, -2.24, -np.pi, -2.57, -np.pi, -2.09, -np.pi])
    high = np.minimum(scene.upper, -low)
    q = rng.uniform(low, high, (1500, 7))
    q[::2, 3] = rng.choice([-1.0, 1.0], 750) * rng.uniform(2.0, 2.57, 750)
    q[::3, 1] = rng.choice([-1.0, 1.0], 500) * rng.uniform(1.4, 2.24, 500)
    found = verdicts(capsules, q, margin)
    free = np.array([scene.is_free(row, margin) for row in q])
    assert free[found == FREE].all()
    assert not free[np.isin(found, (SELF, FURNITURE))].any()
    # All of them occur, and doubt is the exception.
    assert set(found.tolist()) == {FREE, DOUBTFUL, SELF, FURNITURE}
    assert (found == DOUBTFUL).mean() < 0.15


def test_what_the_capsules_stand_for():
    capsules = capsules_of(PlanningScene())
    assert sorted(set(capsules.link.tolist())) == list(range(8))
    # The seven links before the bracelet are capsules already.
    exact = capsules.core[:, 0] == 1.0
    assert exact.sum() == 7
    assert (capsules.link[exact] == range(7)).all()
    assert capsules.robot.all() and capsules.complete
    # Box and table end at the base's height.
    np.testing.assert_allclose(capsules.centre[:, 2] + capsules.extent[:, 2], 0.0, atol=1e-12)
    assert len(capsules_of(PlanningScene(carrying=True)).radius) == len(capsules.radius) + 1


@pytest.mark.parametrize("seed", range(3))
def test_verdicts_agree_with_drake_where_tools_are_welded_on(seed):
    rng = np.random.default_rng(seed)
    scene = scene_with(lambda plant: random_tools(plant, rng))
    capsules = capsules_of(scene)
    low = np.maximum(scene.lower, -np.pi)
    q = rng.uniform(low, -low, (600, 7))
    found = verdicts(capsules, q, MARGIN)
    free = np.array([scene.is_free(row, MARGIN) for row in q])
    assert free[found == FREE].all()
    assert not free[np.isin(found, (SELF, FURNITURE))].any()
    assert (found == FREE).mean() > 0.1


def test_a_tool_counts_with_the_link_that_it_is_welded_to():
    scene = scene_with(
        lambda plant: weld_tool(plant, FOREARM, Capsule(0.02, 0.1), RigidTransform())
    )
    before = capsules_of(PlanningScene()).link.tolist()
    assert sorted(capsules_of(scene).link.tolist()) == sorted([*before, 4])


def turned(roll, pitch, yaw, p):
    return RigidTransform(RollPitchYaw(roll, pitch, yaw), p)


OBSTACLES = [
    Obstacle("pole", "cylinder", [0.03, 1.0], RigidTransform([0.4, 0.3, 1.0])),
    Obstacle("ball", "sphere", [0.12], RigidTransform([0.4, -0.3, 1.0])),
    Obstacle("rod", "capsule", [0.02, 0.5], turned(1.0, 0.2, 0.0, [-0.4, 0.3, 0.9])),
    Obstacle("crate", "box", [0.2, 0.3, 0.4], turned(0.5, 0.7, 0.9, [-0.4, -0.3, 1.0])),
    Obstacle("turned", "box", [0.1, 0.2, 0.3], turned(0.0, 0.0, np.pi / 2, [0.0, 0.6, 1.0])),
]
EGG = Obstacle("egg", "ellipsoid", [0.05, 0.1, 0.15], RigidTransform([0.0, -0.6, 1.0]))


@pytest.mark.parametrize(
    "setup",
    [
        Setup(obstacles=OBSTACLES),
        Setup(obstacles=[*OBSTACLES, EGG]),
        Setup(base=turned(0.3, -0.4, 0.5, [0.1, 0.2, 0.9])),
        Setup(base=turned(np.pi, 0.0, 0.2, [0.3, 0.0, 1.6]), obstacles=OBSTACLES),
        Setup(tool=Tool("cylinder", [0.02, 0.3], pose=RigidTransform([0.0, 0.0, 0.15]))),
        Setup(tool=Tool("sphere", [0.05], on="gripper", pose=RigidTransform([0.0, 0.0, 0.2]))),
    ],
    ids=["obstacles", "egg", "tilted", "hanging", "probe", "ball on the gripper"],
)
def test_verdicts_agree_with_drake_in_scenes_of_ones_own(setup):
    scene = PlanningScene(setup=setup)
    capsules = capsules_of(scene)
    low = np.maximum(scene.lower, -np.pi)
    q = np.random.default_rng(0).uniform(low, -low, (1000, 7))
    found = verdicts(capsules, q, MARGIN)
    free = np.array([scene.is_free(row, MARGIN) for row in q])
    assert free[found == FREE].all()
    assert not free[np.isin(found, (SELF, FURNITURE))].any()
    assert (found == FREE).mean() > 0.1
    assert np.isin(found, (SELF, FURNITURE)).sum() > 0.5 * (~free).sum()


def test_where_a_shape_has_no_capsule_nothing_is_proved_free():
    """A flap on a hinge of its own: who knows how it stands."""
    scene = scene_with(lambda plant: hinged(plant, plant.world_frame()))
    capsules = capsules_of(scene)
    assert not capsules.complete
    found = verdicts(capsules, np.random.default_rng(0).uniform(-1.0, 1.0, (50, 7)), MARGIN)
    assert (found != FREE).all()
