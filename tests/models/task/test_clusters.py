"""Clusters, comfort and state preferences, in the words of the thesis."""

import numpy as np

from models.task import clusters, estimate, pairs, spaces
from models.task.spaces import LOST, POSITIONS, R_WG, R_WO, State


def test_there_are_twenty_clusters_of_states():
    found = clusters.clusters()
    assert len(found) == 20
    for members in found.values():
        assert members.size > 0 and members.max() < LOST
        assert (np.diff(members) > 0).all()


def test_divisions_cover_what_they_divide():
    found = clusters.clusters()
    everything = np.arange(spaces.N_STATES)
    for division in (
        ["not_grasped", "grasped"],
        ["object_z_vertical", "object_x_vertical", "object_y_vertical"],
        ["object_z_0", "object_z_45", "object_z_90", "object_z_135"],
        ["under_limit", "upper_limit"],
    ):
        union = np.concatenate([found[name] for name in division])
        np.testing.assert_array_equal(np.sort(union), everything)


def test_gripper_clusters_hold_the_cube_and_point_so():
    found = clusters.clusters()
    for name, axis, sign in [
        ("gripper_down", 2, -1),
        ("gripper_front", 0, 1),
        ("gripper_right", 1, -1),
        ("gripper_left", 1, 1),
    ]:
        gripper = spaces.decode_states(found[name]).gripper
        assert (gripper >= 0).all()
        assert (sign * R_WG[gripper, axis, 2] > 0.9).all()
    assert set(spaces.decode_states(found["gripper_down"]).gripper) == set(spaces.VERTICAL)
    assert set(spaces.decode_states(found["gripper_left"]).gripper) == {1}
    assert set(spaces.decode_states(found["gripper_right"]).gripper) == {3}


def test_vertical_axis_of_the_cube():
    found = clusters.clusters()
    for axis, name in enumerate("xyz"):
        orientation = spaces.decode_states(found[f"object_{name}_vertical"]).orientation
        np.testing.assert_allclose(np.abs(R_WO[orientation, 2, axis]), 1, atol=1e-12)


def test_zones():
    found = clusters.clusters()
    p = POSITIONS[spaces.decode_states(found["center"]).position]
    assert set(map(tuple, p)) == {(0.55, 0.0, 0.55), (0.55, 0.0, 0.6)}
    assert State(0, 0).index in found["right_limit"]
    assert State(4, 0).index in found["left_limit"]
    assert State(4, 0).index in found["back_limit"]


def test_uncomfortable_poses_reach_across():
    bad = clusters.uncomfortable_poses()
    assert bad[0, 1] and not bad[0, 3] and not bad[2].any()
    assert bad[4, 3] and not bad[4, 1] and not bad[0, 6]
    states = clusters.uncomfortable_states()
    assert states.size == 2 * 6 * 48
    assert State(0, 5, 1).index in states and State(0, 5).index not in states


def test_state_preferences():
    entries = estimate.estimated_transitions(pairs.nominal_pairs())
    found = clusters.state_preferences(entries.state, entries.next_state)
    preferred, avoided = found["preferred"], found["avoided"]
    assert preferred.size == 1 + 2 * 18
    assert spaces.GOAL_STATE in preferred and State(3, 0, 9).index in preferred
    assert not np.intersect1d(preferred, avoided).size
    # Standing on the x face, held from above: turning to the front rights it.
    assert State(8, 40, 10).index not in avoided
    # Yawed by 45° in a level hand: no rotation undoes that.
    assert State(8, 24, 10).index in avoided
    assert State(0, 0, 1).index in avoided  # uncomfortable
    assert (spaces.decode_states(avoided).gripper >= 0).all()


def test_preferences_follow_the_transitions():
    held, upright = State(8, 24, 10).index, State(8, 0, 0).index
    none = clusters.state_preferences(np.array([], int), np.array([], int))
    assert held in none["avoided"] and upright not in none["avoided"]
    some = clusters.state_preferences(np.array([held, held, LOST]), np.array([upright, LOST, LOST]))
    assert held not in some["avoided"]
