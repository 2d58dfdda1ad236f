"""State and action spaces: counts, bijections, and what the tables of the thesis really give."""

import numpy as np
import pytest

from models.errors import ModelError
from models.rotations import geodesic_angle, rotation_x, rotation_y, rotation_z
from models.task import spaces, tables
from models.task.spaces import Action, Kind, State

STATES = np.arange(spaces.N_STATES)


def test_counts_of_the_thesis():
    assert spaces.N_STATES == 15_984 == spaces.LOST
    assert (spaces.N_FREE, spaces.N_HELD, spaces.N_ACTIONS) == (432, 15_552, 55)
    assert len(spaces.GRIPPER_NAMES) == len(set(spaces.GRIPPER_NAMES)) == 18


def test_positions_are_the_grid_in_index_order():
    assert spaces.POSITIONS.shape == (18, 3)
    np.testing.assert_array_equal(spaces.POSITIONS[(1 * 3 + 2) * 2 + 1], [0.55, 0.1, 0.6])
    np.testing.assert_array_equal(spaces.POSITIONS[spaces.GOAL_POSITION], [0.5, 0.0, 0.55])
    assert pytest.approx(0.52) == spaces.REST_HEIGHT


def test_state_indices_are_a_bijection():
    parts = spaces.decode_states(STATES)
    np.testing.assert_array_equal(spaces.encode_states(*parts), STATES)
    assert np.unique(np.stack(parts), axis=1).shape[1] == spaces.N_STATES
    assert ((parts.gripper < 0) == (STATES < 432)).all()
    assert [int(part) for part in spaces.decode_states(spaces.LOST)] == [-1, -1, -1]


def test_one_state_at_a_time_agrees_with_the_arrays():
    for index in range(0, spaces.N_STATES, 37):
        assert State.from_index(index).index == index
    assert State(4, 7).index == 2 * 48 + 7
    assert not State(4, 7).is_grasp
    assert State(5, 7, 3).index == 432 + (5 * 18 + 3) * 48 + 7
    assert State(5, 7, 3).is_grasp
    goal = State.from_index(spaces.GOAL_STATE)
    assert goal == State(spaces.GOAL_POSITION, spaces.GOAL_ORIENTATION)


def test_action_indices_are_a_bijection():
    actions = np.arange(55)
    parts = spaces.decode_actions(actions)
    np.testing.assert_array_equal(spaces.encode_actions(*parts), actions)
    assert [Action.from_index(i).index for i in actions] == actions.tolist()
    assert Action(Kind.GRASP, 5).index == 5
    assert Action(Kind.TRANSLATE, 5).index == 23
    assert Action(Kind.ROTATE, 5).index == 41
    assert Action(Kind.DROP).index == 54


def test_actions_say_what_they_do():
    assert str(Action(Kind.GRASP, 10)) == "grasp with 10 (vertical, turned 0°)"
    assert str(Action(Kind.TRANSLATE, 2)) == "translate to (0.5, 0, 0.55) m"
    assert str(Action(Kind.ROTATE, 0)) == "rotate to 0 (horizontal, front)"
    assert str(Action(Kind.DROP)) == "drop"


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: State(18, 0), "position 18 is out of range 0…17"),
        (lambda: State(0, -1), "orientation -1"),
        (lambda: State(1, 0), "layer z = 0.6"),
        (lambda: State(0, 0, 18), "gripper 18"),
        (lambda: State.from_index(spaces.LOST), "state index 15984 is out of range 0…15983"),
        (lambda: Action(Kind.DROP, 3), "none for a drop"),
        (lambda: Action(Kind.GRASP), "target None"),
        (lambda: Action.from_index(55), "action index 55 is out of range 0…54"),
        (lambda: spaces.decode_states([0.5]), "must be an integer"),
    ],
)
def test_what_is_no_state_or_action_is_refused(make, said):
    with pytest.raises(ModelError, match=said):
        make()


def test_cube_orientations_are_distinct_and_stand_on_a_face():
    apart = geodesic_angle(spaces.R_WO[:, None], spaces.R_WO[None]) + 10 * np.eye(48)
    assert apart.min() == pytest.approx(np.pi / 4)
    # A face is down when one axis of the cube is vertical.
    np.testing.assert_allclose(np.abs(spaces.R_WO[:, 2, :]).max(axis=1), 1, atol=1e-12)


@pytest.mark.parametrize(
    ("first", "axis", "sign"),
    [(0, 2, 1), (8, 1, 1), (16, 0, 1), (24, 2, -1), (32, 1, -1), (40, 0, -1)],
)
def test_table_4_1_names_the_axis_that_is_up(first, axis, sign):
    np.testing.assert_allclose(spaces.R_WO[first : first + 8, 2, axis], sign, atol=1e-12)


def test_table_4_1_turns_about_x_then_y_then_z_of_the_world():
    alpha, beta, gamma = np.radians(spaces.ORIENTATION_ANGLES[19])
    expected = rotation_z(gamma) @ rotation_y(beta) @ rotation_x(alpha)
    np.testing.assert_allclose(spaces.R_WO[19], expected, atol=1e-15)


def test_the_closing_axis_is_level():
    closing = np.degrees(np.arcsin(spaces.R_WG[:, 2, 1]))
    rounded = [7, 9]
    np.testing.assert_allclose(np.delete(closing, rounded), 0, atol=1e-12)
    # 125° printed for 125.264°: a quarter of a degree, mirror images of each other.
    np.testing.assert_allclose(closing[rounded], [-0.229, 0.229], atol=1e-3)
    mirror = np.diag([1.0, -1.0, 1.0])
    np.testing.assert_allclose(mirror @ spaces.R_WG[7] @ mirror, spaces.R_WG[9], atol=1e-15)


def test_the_approach_never_points_up_or_back():
    assert (spaces.R_WG[:, [0, 2], 2] * [1, -1] > -1e-12).all()


def test_kinds_of_gripper_orientation():
    slope = np.degrees(np.arcsin(np.clip(spaces.R_WG[:, 2, 2], -1, 1)))
    np.testing.assert_allclose(slope[spaces.HORIZONTAL], 0, atol=1e-9)
    np.testing.assert_allclose(slope[spaces.TILTED], [-45, -45, -30, -45, -30], atol=1e-9)
    np.testing.assert_allclose(slope[spaces.VERTICAL], -90, atol=1e-5)
    named = [*spaces.HORIZONTAL, *spaces.TILTED, *spaces.VERTICAL]
    assert named == list(range(18))


def test_the_camera_is_never_below_the_approach():
    # The camera sits on −G_x: above the fingers unless the gripper is vertical.
    assert (-spaces.R_WG[:10, 2, 0] > 0.7).all()


def test_rows_are_readable_and_complete():
    rows = list(tables.state_rows())
    assert [int(row[0]) for row in rows] == list(range(15_985))
    assert {len(row) for row in rows} == {len(tables.STATE_COLUMNS)}
    assert rows[spaces.GOAL_STATE] == (
        *(str(spaces.GOAL_STATE), "0.5", "0", "0.55", "0", "0", "0"),
        *("0", "", "", "", ""),
    )
    held = State(17, 19, 7)
    assert rows[held.index][1:] == (
        *("0.6", "0.1", "0.6", "0", "270", "135", "1", "7", "-135", "45", "125"),
    )
    assert set(rows[spaces.LOST][1:]) == {""}
    actions = list(tables.action_rows())
    assert actions[54] == ("54", "drop", "", "drop")
    assert actions[20] == ("20", "translate", "2", "translate to (0.5, 0, 0.55) m")
    assert len(actions) == 55
