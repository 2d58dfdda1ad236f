"""Sizes: within what the scenario says, the same for the same seed, and each drawn by itself."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from diagrams.scenarios import draw, load_scenario
from diagrams.scenarios.draws import within_reach
from diagrams.scenarios.schema import Distractor, parse_scenario
from models.errors import ModelError
from models.scenes.planning_scene import HOME, PlanningScene

X_WO = RigidTransform([0.55, 0.0, 0.52])
KEYS = [(7, number, 0) for number in range(200)]


def test_pushes_fill_the_range_either_way_round():
    leads = [draw(load_scenario("push"), key).leads[0] for key in KEYS]
    distance = np.array([lead.distance for lead in leads])
    turn = np.degrees([lead.turn for lead in leads])
    assert 0.02 <= distance.min() < 0.022 and 0.048 < distance.max() <= 0.05
    assert 20.0 <= np.abs(turn).min() < 21.0 and 39.0 < np.abs(turn).max() <= 40.0
    assert 0.35 < (turn > 0).mean() < 0.65


def test_episode_seed_and_repetition_make_a_difference_and_nothing_else_does():
    both = parse_scenario("push: {distance: 0.03}\nmass: !Uniform {min: 0.1, max: 0.3}", "both")
    one = parse_scenario("mass: !Uniform {min: 0.1, max: 0.3}", "one")
    assert draw(both, (1, 2, 0)).mass == draw(one, (1, 2, 0)).mass
    drawn = {draw(one, key).mass for key in [(1, 2, 0), (1, 3, 0), (2, 2, 0), (1, 2, 1)]}
    assert len(drawn) == 4


def test_the_base_is_off_by_so_much_in_any_direction():
    moved = [draw(load_scenario("base"), key).X_BB for key in KEYS]
    offsets = np.array([X.translation() for X in moved])
    assert np.linalg.norm(offsets, axis=1) == pytest.approx(0.005)
    assert np.abs(offsets.mean(axis=0)).max() < 0.001
    angles = [np.degrees(X.rotation().ToAngleAxis().angle()) for X in moved]
    assert angles == pytest.approx([1.0] * len(angles))


def test_noise_has_the_root_mean_square_that_the_scenario_says():
    from diagrams.scenarios.pose_noise import PoseNoise

    scenario = load_scenario("noise")
    noise, draws = PoseNoise(scenario.noise), draw(scenario, (0, 0, 0))
    errors = [noise.error(draws, number) for number in range(4000)]
    distance = [np.linalg.norm(X.translation()) for X in errors]
    angle = [np.degrees(X.rotation().ToAngleAxis().angle()) for X in errors]
    assert np.sqrt(np.mean(np.square(distance))) == pytest.approx(0.005, rel=0.03)
    assert np.sqrt(np.mean(np.square(angle))) == pytest.approx(5.0, rel=0.03)


def test_postures_differ_and_are_free_of_collisions():
    scene = PlanningScene()
    scene.place_cube(X_WO)
    drawn = [draw(load_scenario("posture"), key).start_posture(X_WO) for key in KEYS[:5]]
    for q in drawn:
        assert scene.is_free(q) and scene.within_limits(q)
        assert np.abs(q - HOME).max() > 0.2
    assert len({tuple(q) for q in drawn}) == 5
    assert draw(load_scenario("push"), KEYS[0]).start_posture(X_WO) is HOME


def test_a_distractor_lies_within_reach_apart_from_cube_and_goal():
    goal = np.array([0.5, 0.0, 0.55])
    for key in KEYS[:50]:
        p = draw(load_scenario("distractor"), key).second_cube(X_WO.translation(), [goal])
        p = p.translation()
        assert 0.08 <= np.linalg.norm(p - X_WO.translation()) <= 0.15
        assert np.linalg.norm(p[:2] - goal[:2]) >= 0.08
        assert within_reach(p) and p[2] == pytest.approx(0.52)
    # From the grid's side there are few places at this distance.
    scenario = replace(load_scenario("distractor"), distractor=Distractor(0.18))
    beside = np.array([0.6, -0.1, 0.52])
    for number in range(200):
        p = draw(scenario, (0, number, 0)).second_cube(beside, [goal]).translation()
        assert np.linalg.norm(p - beside) == pytest.approx(0.18)
    everywhere = [np.array([x, y, 0.5]) for x in (0.47, 0.55, 0.63) for y in (-0.12, 0.0, 0.12)]
    with pytest.raises(ModelError, match="no place"):
        draw(load_scenario("distractor"), KEYS[0]).second_cube(X_WO.translation(), everywhere)
