"""Scenes of one's own: another base, obstacles, tools. Each is asked for what its arm can do."""

import time

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from models.inverse_kinematics.solution import ANGLE_TOLERANCE, POSITION_TOLERANCE
from models.inverse_kinematics.solver import IkSolver
from models.scenes.planning_scene import MARGIN, PlanningScene
from models.scenes.robots import GEN3, GEN3_LITE
from models.scenes.setup import Obstacle, Setup, Tool

POLE = Obstacle("pole", "cylinder", [0.02, 1.0], RigidTransform([0.4, 0.35, 1.0]))
BALL = Obstacle("ball", "sphere", [0.08], RigidTransform([0.5, -0.3, 0.9]))
TURNED = RigidTransform(RollPitchYaw(0.3, 0.4, 0.7), [0.3, -0.5, 0.8])
CRATE = Obstacle("crate", "box", [0.1, 0.2, 0.3], TURNED)
EGG = Obstacle("egg", "ellipsoid", [0.05, 0.1, 0.15], RigidTransform([-0.3, 0.4, 1.0]))
AHEAD = RigidTransform([0.0, 0.0, 0.1])
PROBE = Tool("cylinder", [0.01, 0.2], pose=AHEAD, tcp=AHEAD)

SETUPS = {
    "yawed": Setup(base=RigidTransform(RollPitchYaw(0.0, 0.0, np.pi / 6), [0.0, 0.0, 0.5])),
    "hanging": Setup(base=RigidTransform(RollPitchYaw(np.pi, 0.0, 0.0), [0.3, 0.0, 1.7])),
    "obstacles": Setup(obstacles=[POLE, BALL, CRATE]),
    "probe": Setup(tool=PROBE),
    "tilted, all": Setup(
        base=RigidTransform(RollPitchYaw(0.4, -0.3, 0.2), [0.0, 0.0, 0.6]),
        tool=Tool("sphere", [0.03], "", "gripper", RigidTransform([0.0, 0.0, 0.2])),
        obstacles=[POLE, BALL, CRATE, EGG],
        furniture=False,
    ),
}


def assert_solved(scene: PlanningScene, count: int, median: float) -> None:
    """Poses of ``count`` free postures: at least 98 % have an answer that Drake confirms."""
    low, high = np.maximum(scene.lower, -np.pi), np.minimum(scene.upper, np.pi)
    rng, solver, poses = np.random.default_rng(0), IkSolver(scene), []
    while len(poses) < count:
        q = rng.uniform(low, high)
        if scene.is_free(q):
            poses.append(scene.forward(q))
    solver.solve(poses[0])
    times, solved = [], 0
    for X_WG in poses:
        began = time.process_time()
        answer = solver.solve(X_WG)
        times.append(time.process_time() - began)
        if answer.q is None:
            continue
        position, angle = scene.error(answer.q, X_WG)
        assert position <= POSITION_TOLERANCE and angle <= ANGLE_TOLERANCE
        assert scene.within_limits(answer.q) and scene.is_free(answer.q, MARGIN)
        solved += 1
    print(f"{solved} of {count}, median {1e3 * np.median(times):.2f} ms")
    assert solved >= 0.98 * count
    assert np.median(times) < median


@pytest.mark.parametrize("robot", [GEN3, GEN3_LITE], ids=["gen3", "gen3_lite"])
@pytest.mark.parametrize("name", SETUPS)
def test_what_the_arm_can_do_is_solved(name, robot):
    assert_solved(PlanningScene(setup=SETUPS[name], robot=robot), 25, 1.0)


@pytest.mark.soak
@pytest.mark.parametrize("robot", [GEN3, GEN3_LITE], ids=["gen3", "gen3_lite"])
@pytest.mark.parametrize("name", SETUPS)
def test_what_the_arm_can_do_is_solved_in_50_ms(name, robot):
    assert_solved(PlanningScene(setup=SETUPS[name], robot=robot), 500, 0.05)
