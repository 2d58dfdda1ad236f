"""Scenes that tests of several rooms share; each module gets its own, since scenes are moved."""

import pytest

from models.scenes.planning_scene import PlanningScene


@pytest.fixture(scope="module")
def empty():
    """The open, empty hand before box and table."""
    return PlanningScene()


@pytest.fixture(scope="module")
def carrying():
    """The hand with a cube in it."""
    return PlanningScene(carrying=True)
