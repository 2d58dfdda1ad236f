"""The fast collision check against Drake's shapes and distances."""

import numpy as np
import pytest
from pydrake.geometry import Box, Capsule, Cylinder, Sphere
from pydrake.math import RigidTransform

from models.errors import ModelError
from models.gen3.capsules import DOUBTFUL, FREE, FURNITURE, SELF, capsules_of, enclose, verdicts
from models.scenes.planning_scene import MARGIN, PlanningScene
from tests.models.tools import FOREARM, random_tools, scene_with, weld_tool


def surface(shape, rng, count=400):
    """Random points on, or at the rim of, a shape ``[count, 3]``."""
    if isinstance(shape, Box):
        return rng.choice([-0.5, 0.5], (count, 3)) * shape.size()
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    ends = rng.choice([-0.5, 0.5], count) * shape.length()
    rim = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1) * shape.radius()
    return rim + ends[:, None] * np.eye(3)[2]


@pytest.mark.parametrize(
    "shape", [Box(0.1, 0.02, 0.05), Box(0.02, 0.03, 0.3), Cylinder(0.03, 0.1), Capsule(0.02, 0.2)]
)
def test_a_capsule_contains_its_shape(shape):
    half, radius, exact = enclose(shape)
    points = surface(shape, np.random.default_rng(0))
    along = np.clip(points @ half / (half @ half), -1.0, 1.0)
    distance = np.linalg.norm(points - along[:, None] * half, axis=1)
    assert distance.max() <= radius + 1e-12
    assert exact == isinstance(shape, Capsule)


def test_other_shapes_are_refused():
    with pytest.raises(ModelError, match="valid: capsule, cylinder, box"):
        enclose(Sphere(0.1))


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
    assert capsules.exact.sum() == 7
    assert (capsules.link[capsules.exact] == range(7)).all()
    # Box and table end at the base's height.
    np.testing.assert_allclose(capsules.high[:, 2], 0.0, atol=1e-12)
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
