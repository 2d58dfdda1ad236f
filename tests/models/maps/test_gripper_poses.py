"""The poses that the task needs, and their keys."""

import numpy as np
import pytest

from models.errors import ModelError
from models.maps.gripper_poses import (
    RETREAT,
    VIA_HEIGHT,
    Layer,
    grasp_position,
    gripper_pose,
    pose_key,
    standard_poses,
)
from models.task.spaces import HORIZONTAL, POSITIONS, R_WG, TILTED, VERTICAL


def test_keys_round_to_a_tenth_of_a_millimetre():
    p = np.array([0.55, -0.1, 0.6])
    assert pose_key(p, 3) == (5500, -1000, 6000, 3)
    assert pose_key(p + 4e-5, 3) == pose_key(p, 3)
    assert pose_key(p + 6e-5, 3) != pose_key(p, 3)


@pytest.mark.parametrize(
    ("p", "gripper", "message"),
    [([0.5, 0.0], 0, "position"), ([0, 0, np.nan], 0, "position"), ([0, 0, 0], 18, "0…17")],
)
def test_bad_poses_are_named(p, gripper, message):
    with pytest.raises(ModelError, match=message):
        pose_key(np.array(p), gripper)


def test_tilted_hands_stop_short_of_the_cube():
    p_WO = np.array([0.55, 0.0, 0.52])
    for g in (*HORIZONTAL, *TILTED):
        short = p_WO - grasp_position(p_WO, g)
        np.testing.assert_allclose(short, RETREAT * R_WG[g][:, 2], atol=1e-15)
    for g in VERTICAL:
        np.testing.assert_array_equal(grasp_position(p_WO, g), p_WO)


def test_pose_carries_the_orientation_of_the_table():
    X_WG = gripper_pose(np.array([0.5, 0.1, 0.6]), 7)
    np.testing.assert_allclose(X_WG.rotation().matrix(), R_WG[7])


def test_standard_poses_are_all_there_once():
    for gripper in (0, 7, 12):
        poses = list(standard_poses(gripper))
        layers = [layer for layer, _ in poses]
        assert [layers.count(layer) for layer in Layer] == [18, 9, 9, 0]
        assert len({pose_key(p, gripper) for _, p in poses}) == 36
        cells = {pose_key(p, gripper) for layer, p in poses if layer == Layer.CELL}
        assert cells == {pose_key(p, gripper) for p in POSITIONS}
        assert all(p[2] == VIA_HEIGHT for layer, p in poses if layer == Layer.VIA)
