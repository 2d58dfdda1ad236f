"""Braking: on the path, without a jump in speed, as hard as the vendor allows and no harder."""

import numpy as np
import pytest

from diagrams.arm_controller import ACCELERATION_LIMIT
from diagrams.execution.phases import Watch
from diagrams.execution.timeline import Timeline
from experiments.kit.shipped_data import load_planner
from models.maps.gripper_poses import gripper_pose
from models.motion.failures import Infeasible
from models.motion.moves import CLOSE, Grip, Move
from models.scenes.planning_scene import HOME
from models.task.spaces import POSITIONS, Action, Kind

H = 0.002
"""The station's step [s]."""


@pytest.fixture(scope="module")
def timelines():
    """Of carrying the cube about, some from hand to hand."""
    planner, rng, found = load_planner(), np.random.default_rng(0), []
    while len(found) < 8:
        position, hand, target = (int(i) for i in rng.integers(18, size=3))
        q = planner.posture(position, hand)
        action = Action([Kind.TRANSLATE, Kind.ROTATE][len(found) % 2], target)
        if q is None:
            continue
        X_WO = gripper_pose(POSITIONS[position], hand)
        try:
            plan = planner.plan(action, position, hand, q, 0.0, X_WO)
        except Infeasible:
            continue
        found.append(Timeline(q, 0.0, plan, planner.velocity_limit))
    return found


@pytest.mark.parametrize("share", [0.02, 0.15, 0.3, 0.5, 0.7, 0.85, 0.99])
def test_braking_stays_on_the_path_is_smooth_and_takes_at_most_300_ms(timelines, share):
    for timeline in timelines:
        at = share * timeline.duration
        rest = timeline.braked(at)
        assert rest.duration <= 0.3
        times = H * np.arange(-3, int(rest.duration / H) + 5)
        q = np.array([timeline.arm(at + t) if t < 0.0 else rest.arm(t) for t in times])
        np.testing.assert_array_equal(rest.arm(0.0), timeline.arm(at))
        np.testing.assert_allclose(rest.arm(9.0), rest.arm(rest.duration), atol=1e-12)
        speed = np.diff(q, axis=0) / H
        # A jump in speed would need more than any acceleration that is allowed.
        assert (np.abs(np.diff(speed, axis=0)) / H <= ACCELERATION_LIMIT).all()
        assert np.abs(speed[-1]).max() < 1e-9
        along = np.array([timeline.arm(t) for t in np.arange(at, at + 0.31, 1e-4)])
        for point in q[3:]:
            assert np.linalg.norm(along - point, axis=1).min() < 2e-4


def test_what_is_watched_follows_the_parts_and_ends_with_them():
    move = Move(np.array([HOME, HOME + 0.1]))
    timeline = Timeline(HOME, 0.085, (move, CLOSE, move), np.ones(7))
    half = (timeline.duration - CLOSE.seconds) / 2
    assert timeline.watch(0.0) == timeline.watch(half - 0.01) == Watch.CUBE
    assert timeline.watch(half + 0.01) == Watch.NOTHING
    assert timeline.watch(half + CLOSE.seconds + 0.01) == Watch.GRIP
    assert timeline.watch(-1.0) == timeline.watch(timeline.duration + 0.01) == Watch.NOTHING


def test_braking_while_the_fingers_move_keeps_the_arm_and_their_command():
    timeline = Timeline(
        HOME, 0.085, (Grip(0.0, 1.0), Move(np.array([HOME, HOME + 0.1]))), np.ones(7)
    )
    rest = timeline.braked(0.5)
    np.testing.assert_array_equal(rest.arm(0.0), HOME)
    assert (rest.duration, rest.width(0.0), rest.width(5.0)) == (0.0, 0.0, 0.0)
    assert rest.plan == timeline.plan
