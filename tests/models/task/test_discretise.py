"""State identification: table poses name themselves, neighbours snap, what has left is lost."""

import numpy as np
import pytest

from models.errors import ModelError
from models.rotations import rotation_vector_to_matrix, rotation_z
from models.task import discretise, spaces
from models.task.spaces import LOST, POSITIONS, R_WG, R_WO, State

REST = np.array([0.55, 0.0, spaces.REST_HEIGHT])


def free(p_WO, R=R_WO[0]):
    return discretise.identify(R, p_WO, R_WG[10], [0.4, 0.0, 0.75], False)


def test_every_state_identifies_itself_from_its_own_pose():
    index = np.arange(spaces.N_STATES)
    position, orientation, gripper = spaces.decode_states(index)
    held = gripper >= 0
    p_WG = POSITIONS[position]
    p_WO = np.where(held[:, None], p_WG, p_WG * [1, 1, 0] + [0, 0, spaces.REST_HEIGHT])
    found = discretise.identify(R_WO[orientation], p_WO, R_WG[gripper], p_WG, held)
    np.testing.assert_array_equal(found.state, index)
    np.testing.assert_allclose(found.orientation_angle, 0, atol=1e-12)
    np.testing.assert_allclose(found.distance, 0, atol=1e-12)
    np.testing.assert_allclose(found.gripper_angle[held], 0, atol=1e-12)
    assert np.isnan(found.gripper_angle[~held]).all()


def test_small_disturbances_snap_back_and_are_told():
    rng = np.random.default_rng(0)
    n = 500
    position, orientation, gripper = (rng.integers(high, size=n) for high in (18, 48, 18))
    turn = rng.normal(size=(2, n, 3))
    size = np.radians(20) * rng.uniform(size=(2, n, 1))
    turn = rotation_vector_to_matrix(size * turn / np.linalg.norm(turn, axis=-1, keepdims=True))
    found = discretise.identify(
        turn[0] @ R_WO[orientation],
        POSITIONS[position],
        R_WG[gripper] @ np.where(gripper[:, None, None] < 10, np.eye(3), turn[1]),
        POSITIONS[position] + [0.01, -0.02, 0.02],
        np.ones(n, dtype=bool),
    )
    np.testing.assert_array_equal(found.state, spaces.encode_states(position, orientation, gripper))
    np.testing.assert_allclose(found.orientation_angle, size[0, :, 0], atol=1e-12)
    np.testing.assert_allclose(found.distance, 0.03, atol=1e-12)


def test_a_free_cubes_height_does_not_raise_it_to_the_upper_layer():
    assert free([0.5, 0.0, 0.61]).state == State(2, 0).index


@pytest.mark.parametrize(
    ("p_WO", "lost"),
    [
        (REST, False),
        ([0.475, -0.15, 0.52], False),
        ([0.625, 0.15, 0.52], False),
        ([0.474, 0.0, 0.52], True),
        ([0.626, 0.0, 0.52], True),
        ([0.55, 0.151, 0.52], True),
        ([0.55, -0.151, 0.52], True),
        ([0.55, 0.0, 0.49], True),
        ([0.55, 0.0, 0.02], True),
    ],
)
def test_a_free_cube_off_the_grid_or_the_table_is_lost(p_WO, lost):
    assert (free(p_WO).state == LOST) == lost
    assert discretise.off_table(p_WO) == lost


def test_a_held_cube_is_where_the_tool_is_and_never_lost():
    found = discretise.identify(R_WO[3], [0.9, 0.9, 0.1], R_WG[2], [0.7, 0.3, 0.6], True)
    assert found.state == State(17, 3, 2).index
    assert found.distance == pytest.approx(np.hypot(0.1, 0.2))


def test_ties_go_by_the_measured_pose():
    halfway = np.radians(22.5)
    assert free(REST, rotation_z(halfway - 1e-6)).state == State(8, 0).index
    assert free(REST, rotation_z(halfway + 1e-6)).state == State(8, 1).index
    near = discretise.all_nearest_orientations(rotation_z(halfway), 1e-9)
    np.testing.assert_array_equal(np.flatnonzero(near), [0, 1])
    near = discretise.all_nearest_orientations(rotation_z(halfway - 1e-6), 1e-9)
    np.testing.assert_array_equal(np.flatnonzero(near), [0])


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((2 * np.eye(3), REST, R_WG[0], REST, True), "R_WO is not a rotation"),
        ((R_WO[0], REST, np.eye(2), REST, True), "R_WG has shape"),
        ((R_WO[0], [0.5, np.nan, 0.5], R_WG[0], REST, False), "p_WO holds a value"),
        ((R_WO[0], REST, R_WG[0], [0.5, 0.5], False), "p_WG has shape"),
    ],
)
def test_what_is_no_pose_is_refused(arguments, said):
    with pytest.raises(ModelError, match=said):
        discretise.identify(*arguments)


def test_a_cube_on_the_table_beside_the_grid_belongs_to_the_nearest_column():
    on_table = np.array([[0.5, -0.1], [0.473, -0.1], [0.4, 0.02], [0.34, 0.0], [0.7, 0.21]])
    p_WO = np.column_stack([on_table, np.full(5, spaces.REST_HEIGHT)])
    assert discretise.nearest_column(p_WO).tolist() == [0, 0, 2, -1, -1]
    assert discretise.off_table(p_WO).tolist() == [False, True, True, True, True]
    corners = np.array([[x, y, spaces.REST_HEIGHT] for x in (0.36, 0.74) for y in (-0.19, 0.19)])
    assert discretise.nearest_column(corners).tolist() == [0, 4, 12, 16]
    # What leans on something, or has fallen, does not lie.
    assert discretise.nearest_column(p_WO + np.array([0.0, 0.0, 0.012]))[0] == -1
    assert discretise.nearest_column(p_WO - np.array([0.0, 0.0, 0.5]))[0] == -1


ASIDE = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])


def test_within_its_margin_a_cube_keeps_its_name_and_just_beyond_it_may_lose_it():
    rng = np.random.default_rng(4)
    for _ in range(40):
        R = rotation_vector_to_matrix(rng.normal(size=3))
        p = np.array([rng.uniform(0.475, 0.625), rng.uniform(-0.15, 0.15), spaces.REST_HEIGHT])
        distance, angle = discretise.name_margin(R, p)
        assert distance >= 0.0 and angle >= 0.0
        own = discretise.nearest_orientation(R)[0]
        axes = rng.normal(size=(100, 3))
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        turned = rotation_vector_to_matrix(0.99 * angle * axes) @ R
        assert (discretise.nearest_orientation(turned)[0] == own).all()
        column = int(discretise.nearest_column(p))
        near, far = (p + share * distance * ASIDE for share in (0.99, 1.01))
        assert (discretise.nearest_column(near) == column).all()
        assert ((discretise.nearest_column(far) != column) | discretise.off_table(far)).any()


@pytest.mark.parametrize(("yaw", "angle"), [(0.0, 22.5), (20.0, 2.5), (22.4, 0.1), (44.0, 21.5)])
def test_between_two_yaws_the_margin_is_the_way_to_the_middle(yaw, angle):
    R = rotation_z(np.radians(yaw)) @ R_WO[0]
    distance, found = discretise.name_margin(R, [0.56, 0.03, spaces.REST_HEIGHT])
    assert np.degrees(found) == pytest.approx(angle)
    assert distance == pytest.approx(0.015)  # to x = 0.575


def test_off_the_grid_there_is_no_margin():
    distance, _ = discretise.name_margin(R_WO[0], [0.63, 0.0, spaces.REST_HEIGHT])
    assert distance == pytest.approx(-0.005)
