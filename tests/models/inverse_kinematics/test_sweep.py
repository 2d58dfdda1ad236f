"""The Gen3's swept closed form, compared with the plant and with a finer sweep."""

import numpy as np
import pytest

from models.gen3.closed_form import solve_batch, solve_first
from models.gen3.newton import MET
from models.inverse_kinematics.solution import posture_cost, reaches
from models.inverse_kinematics.sweep import Sweep
from models.scenes.planning_scene import MARGIN, PlanningScene
from models.scenes.robots import GEN3_LITE


@pytest.fixture(scope="module")
def sweep():
    return Sweep.of(PlanningScene())


def postures(scene, count, seed):
    low, high = np.maximum(scene.lower, -np.pi), np.minimum(scene.upper, np.pi)
    return np.random.default_rng(seed).uniform(low, high, (count, 7))


def test_only_the_gen3_has_it():
    assert Sweep.of(PlanningScene(robot=GEN3_LITE)) is None


def test_poses_of_random_postures_are_met(sweep):
    """Collisions aside: at least 999 of 1,000, each confirmed by the plant."""
    scene = sweep.scene
    poses = [scene.forward(q) for q in postures(scene, 1000, seed=1)]
    R, p = (np.array(part) for part in zip(*map(sweep.end_effector, poses), strict=True))
    q, met = solve_first(R, p, np.linspace(-np.pi, np.pi, 64))
    confirmed = [
        status == MET and reaches(scene, answer, X_WG)
        for answer, status, X_WG in zip(q, met, poses, strict=True)
    ]
    assert sum(confirmed) >= 999


def test_answer_is_the_nearest_of_a_fine_sweep_of_the_redundancy(sweep):
    scene = sweep.scene
    rng = np.random.default_rng(3)
    for q in [q for q in postures(scene, 30, seed=4) if scene.is_free(q)][:12]:
        X_WG, seed = scene.forward(q), q + rng.uniform(-0.4, 0.4, 7)
        R, p = sweep.end_effector(X_WG)
        branches = solve_batch(R[None], p[None], np.linspace(-np.pi, np.pi, 2000))
        every = scene.wind(branches.reshape(-1, 7)[~np.isnan(branches.reshape(-1, 7)[:, 0])], seed)
        cost = posture_cost(scene, every, seed)
        nearest = next(i for i in np.argsort(cost) if scene.is_free(every[i]))
        answer = sweep.solve(X_WG, seed, MARGIN)
        assert reaches(scene, answer.q, X_WG) and scene.is_free(answer.q)
        assert posture_cost(scene, answer.q, seed) <= cost[nearest] + 0.01


def test_a_posture_at_a_limit_counts_as_further_away(sweep):
    scene = sweep.scene
    middle, edge = np.zeros(7), np.zeros(7)
    edge[5] = scene.upper[5] - 1e-3
    assert posture_cost(scene, middle, middle) == 0.0
    assert posture_cost(scene, edge, edge) == pytest.approx(1.0, abs=0.02)
    # Where it can, the answer moves off the limit.
    answer = sweep.solve(scene.forward(edge), edge, MARGIN)
    assert abs(answer.q[5]) < edge[5] or np.linalg.norm(answer.q - edge) < 1e-3
