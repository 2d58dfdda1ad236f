"""Compared with what the cube did in trials, and with what rigid motions compose to."""

import sqlite3

import numpy as np
import pytest

from experiments.kit.shipped_data import SHIPPED_TRIALS
from models.rotations import (
    geodesic_angle,
    rotation_vector_to_matrix,
    rotation_x,
    rotation_y,
    rotation_z,
)
from models.task.forecast import (
    Scenes,
    arrival,
    free_scene,
    held_scene,
    nearest_names,
    outcomes,
)
from models.task.spaces import (
    GOAL_STATE,
    LOST,
    N_STATES,
    POSITIONS,
    R_WG,
    R_WO,
    Action,
    Kind,
    State,
    decode_actions,
    decode_states,
)

DROP = Action(Kind.DROP).index
MIDDLE = np.array([0.55, 0.0, 0.52])


def after(scene, *actions):
    """The likeliest scene after some actions."""
    for action in actions:
        found = outcomes(scene, np.array([action]))
        scene = found.scenes.select(np.array([int(found.probability.argmax())]))
    return scene


def rotate(hand):
    return Action(Kind.ROTATE, hand).index


def misaligned(R_WO, hand):
    """Angle from the closing axis to the nearest face's normal [°]."""
    return np.degrees(np.arccos(np.abs((R_WG[hand].T @ R_WO)[1]).max()))


def test_turns_that_compose_to_nothing_bring_back_the_cube_and_not_only_its_name():
    scene = held_scene(State(8, 3, 12).index, rotation_x(0.3) @ rotation_y(0.2), [0.0, 0.0, 0.004])
    round_trip = after(scene, rotate(0), rotate(5), rotate(12))
    assert geodesic_angle(round_trip.R_WO, scene.R_WO) == pytest.approx(0.0, abs=1e-7)
    assert round_trip.p_WO == pytest.approx(scene.p_WO)
    assert round_trip.state == scene.state


def test_a_name_forgets_what_the_pose_keeps():
    """From the name's own orientation three turns end elsewhere than the cube itself does."""
    differ = 0
    for orientation in range(48):
        state = State(8, orientation, 10)
        R_GO = R_WG[10].T @ R_WO[orientation]
        true = named = held_scene(state.index, R_GO, np.zeros(3))
        for hand in (7, 2, 9):
            true = after(true, rotate(hand))
            named = after(named, rotate(hand))
            names = nearest_names(named.R_WO)
            named = named._replace(R_WO=R_WO[names])
        differ += int(true.state[0] != named.state[0])
    assert differ > 0


def test_a_carried_cube_keeps_its_pose_in_the_hand():
    scene = held_scene(State(8, 0, 12).index, rotation_z(0.1), [0.001, 0.0, 0.004])
    moved = after(scene, Action(Kind.TRANSLATE, 3).index)
    assert pytest.approx(scene.R_WO) == moved.R_WO
    assert moved.p_WO - scene.p_WO == pytest.approx((POSITIONS[3] - POSITIONS[8])[None])


@pytest.mark.parametrize(
    ("off", "low", "high"),
    # About the least and the most of nine trials each with the floating gripper, three hands.
    [(0.0, 0.0, 0.1), (8.0, 0.0, 5.0), (20.0, 6.0, 17.5), (36.0, 32.0, 36.5), (45.0, 44.0, 45.1)],
)
def test_closing_fingers_turn_the_cube_towards_flush(off, low, high):
    found = outcomes(free_scene(0, rotation_z(np.radians(off)), MIDDLE), np.array([12]))
    assert found.probability.sum() == pytest.approx(1.0)
    for R in found.scenes.R_WO:
        assert low <= misaligned(R, 12) <= high


def test_grasps_end_as_those_in_the_trial_database():
    with sqlite3.connect(f"file:{SHIPPED_TRIALS}?mode=ro", uri=True) as database:
        rows = database.execute(
            "SELECT state, action, turn_x, turn_y, turn_z, noise->>'yaw' FROM trial "
            "WHERE action < 18 AND outcome = 'held'"
        ).fetchall()
    assert len(rows) > 30
    worst, far = 0.0, 0
    for state, action, *turn, yaw in rows:
        _, orientation, _ = decode_states(state)
        scene = free_scene(state, rotation_z(yaw) @ R_WO[orientation], MIDDLE)
        found = outcomes(scene, np.array([action]))
        R_true = rotation_vector_to_matrix(np.array(turn)) @ R_WO[orientation]
        # The gripper's own tilt, up to 3°, is in the trials and not in the forecast.
        angle = np.degrees(geodesic_angle(found.scenes.R_WO, R_true).min())
        worst, far = max(worst, angle), far + (angle > 5.0)
    assert far <= 0.05 * len(rows)
    assert worst < 12.0


@pytest.mark.parametrize(
    ("tilt", "shift"),
    # Drops of the floating gripper with the cube turned about the closing axis: where it came to
    # rest on the way to its face [mm], the mean of two.
    [(10, 2.5), (20, 6.5), (30, 11.6), (35, 14.7), (40, 19.3), (44, 19.6)],
)
def test_a_tilted_cube_falls_on_its_nearest_face_over_its_lowest_edge(tilt, shift):
    R_GO = R_WG[10].T @ rotation_vector_to_matrix(R_WG[10][:, 1] * np.radians(tilt))
    found = outcomes(held_scene(State(8, 0, 10).index, R_GO, np.zeros(3)), np.array([DROP]))
    likeliest = int(found.probability.argmax())
    assert found.scenes.R_WO[likeliest] == pytest.approx(np.eye(3), abs=1e-9)
    x, y, z = found.scenes.p_WO[likeliest] - MIDDLE
    assert (1000 * x, 1000 * y, z) == pytest.approx((-shift, 0.0, 0.0), abs=3.0)
    assert found.probability.size == (1 if tilt < 42 else 2)


def test_a_cube_dropped_from_the_upper_layer_may_tumble_over_each_edge():
    R_GO = R_WG[10].T @ rotation_z(np.radians(30.0))
    above, below = (State(position, 0, 10).index for position in (9, 8))
    drop = np.array([DROP])
    (_, (sure,), _) = outcomes(held_scene(below, R_GO, np.zeros(3)), drop)
    found = outcomes(held_scene(above, R_GO, np.zeros(3)), drop)
    scenes = found.scenes
    assert sure == 1.0
    assert found.probability.sum() == pytest.approx(1.0)
    assert sorted(found.probability) == pytest.approx([0.175] * 4 + [0.3])
    stays = int(found.probability.argmax())
    for i in set(range(5)) - {stays}:
        moved = scenes.p_WO[i] - scenes.p_WO[stays]
        over = scenes.R_WO[i] @ scenes.R_WO[stays].T
        # It rolls without slipping: by an edge's length, a quarter turn about what is level
        # and square to the way.
        assert moved[2] == pytest.approx(0.0, abs=1e-12)
        assert np.linalg.norm(moved) == pytest.approx(0.04)
        axis = np.cross([0.0, 0.0, 1.0], moved / 0.04)
        assert over == pytest.approx(rotation_vector_to_matrix(0.5 * np.pi * axis), abs=1e-9)
        # Along an edge of the face, which is turned by 30°.
        assert np.degrees(np.arctan2(moved[1], moved[0])) % 90 == pytest.approx(30.0)


def test_a_cube_dropped_beside_the_grid_is_in_its_column_and_beside_the_table_lost():
    def drop(p_GO):
        scene = held_scene(State(0, 0, 10).index, R_WG[10].T, R_WG[10].T @ p_GO)
        return int(after(scene, DROP).state[0])

    assert drop(np.array([-0.027, 0.0, 0.0])) == State(0, 0).index
    assert drop(np.array([-0.10, 0.0, 0.0])) == State(0, 0).index
    assert drop(np.array([-0.16, 0.0, 0.0])) == LOST


def test_many_scenes_at_once_end_as_each_does_alone():
    rng = np.random.default_rng(0)
    states = [State(8, int(rng.integers(48)), int(rng.integers(18))) for _ in range(12)]
    scenes = [
        held_scene(s.index, R_WG[s.gripper].T @ R_WO[s.orientation], rng.normal(0, 0.003, 3))
        for s in states
    ]
    together = Scenes(*(np.concatenate(c) for c in zip(*scenes, strict=True)))
    actions = np.array([DROP if k % 3 else rotate(k) for k in range(12)])
    found = outcomes(together, actions)
    for row, (scene, action) in enumerate(zip(scenes, actions, strict=True)):
        alone = outcomes(scene, action[None])
        mine = found.origin == row
        assert found.probability[mine] == pytest.approx(alone.probability)
        assert found.scenes.state[mine].tolist() == alone.scenes.state.tolist()
        assert decode_actions(action).kind in (Kind.DROP, Kind.ROTATE)


def test_arrival_follows_the_policy_to_the_goal_and_no_further_than_it_may():
    policy = np.full(N_STATES, -1)
    start = free_scene(State(14, 0).index, np.eye(3), [0.6, 0.0, 0.52])
    policy[State(14, 0, 10).index] = Action(Kind.TRANSLATE, 2).index
    policy[State(2, 0, 10).index] = DROP
    goals = np.zeros(LOST + 1, dtype=bool)
    goals[GOAL_STATE] = True
    assert arrival(start, [10], policy, goals, 3) == pytest.approx([1.0])
    assert arrival(start, [10], policy, goals, 2) == pytest.approx([0.0])
    # Another hand leads to where the policy knows nothing.
    assert arrival(start, [12], policy, goals, 12) == pytest.approx([0.0])
