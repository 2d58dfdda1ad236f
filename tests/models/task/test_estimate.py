"""Geometric estimates: every pair has its outcomes, and known moves end where they must."""

import numpy as np
import pytest

from models.errors import ModelError
from models.rotations import geodesic_angle
from models.task import estimate, pairs, spaces
from models.task.spaces import LOST, N_ACTIONS, N_STATES, R_WG, R_WO, Action, Kind, State


@pytest.fixture(scope="module")
def transitions():
    return estimate.estimated_transitions(pairs.nominal_pairs())


@pytest.fixture(scope="module")
def outcomes(transitions):
    def look_up(state: State, action: Action) -> dict[State, float]:
        rows = (transitions.state == state.index) & (transitions.action == action.index)
        return {
            State.from_index(int(s)): float(p)
            for s, p in zip(
                transitions.next_state[rows], transitions.probability[rows], strict=True
            )
        }

    return look_up


def test_nominal_pairs_are_counted():
    nominal = pairs.nominal_pairs()
    n_actions = nominal.sum(axis=1)
    assert (n_actions[: spaces.N_FREE] == 18).all()
    assert (n_actions[spaces.N_FREE :] == 17 + 17 + 1).all()


def test_every_nominal_pair_has_probability_one_in_order(transitions):
    pair = pairs.pair_key(transitions.state, transitions.action)
    entry = pair * N_STATES + transitions.next_state
    assert (np.diff(entry) > 0).all()
    unique, row = np.unique(pair, return_inverse=True)
    np.testing.assert_array_equal(unique, np.flatnonzero(pairs.nominal_pairs()))
    np.testing.assert_allclose(np.bincount(row, transitions.probability), 1, atol=1e-15)
    assert (transitions.next_state != LOST).all()
    assert [column.dtype.name for column in transitions] == ["int32", "int32", "int32", "float64"]


def test_only_feasible_pairs_are_estimated():
    feasible = np.zeros((N_STATES + 1, N_ACTIONS), dtype=bool)
    feasible[State(4, 7).index, :2] = True
    feasible[State(4, 7, 3).index, 36 + 3] = True  # a rotation to where it is: no action
    found = estimate.estimated_transitions(feasible)
    assert found.action.tolist() == [0, 1]


def test_simple_actions_end_as_meant(outcomes):
    assert outcomes(State(4, 7), Action(Kind.GRASP, 3)) == {State(4, 7, 3): 1.0}
    held = State(5, 7, 3)
    assert outcomes(held, Action(Kind.TRANSLATE, 16)) == {State(16, 7, 3): 1.0}
    assert outcomes(held, Action(Kind.DROP)) == {State(4, 7): 1.0}


def test_a_cube_turns_over_by_vertical_grasp_horizontal_rotation_and_drop(outcomes):
    def only(state, action):
        ((successor, probability),) = outcomes(state, action).items()
        assert probability == 1.0
        return successor

    def up(state):
        axis = int(np.argmax(np.abs(R_WO[state.orientation][2])))
        return "xyz"[axis], float(np.sign(R_WO[state.orientation][2, axis]))

    state = State(8, 24)
    assert up(state) == ("z", -1.0)
    for _ in range(2):
        state = only(state, Action(Kind.GRASP, 10))
        state = only(state, Action(Kind.ROTATE, 0))
        before = state.orientation
        state = only(state, Action(Kind.DROP))
        assert not state.is_grasp and state.orientation == before
        if up(state) != ("z", 1.0):
            assert up(state)[0] == "x"
    assert up(state) == ("z", 1.0)


def test_turning_a_vertical_gripper_turns_the_cube_about_the_vertical(outcomes):
    (after,) = outcomes(State(3, 8, 10), Action(Kind.ROTATE, 12))
    # Table 4.2's yaw turns about the approach axis, which points down.
    assert after == State(3, 8 + 6, 12)


def test_rotations_leave_one_orientation_or_an_exact_tie_of_two(outcomes):
    number, orientation = estimate.rotated_orientations()
    assert set(np.unique(number)) == {1, 2}
    assert orientation.shape == (18, 18, 48, 2)
    assert ((orientation[..., 1] < 0) == (number == 1)).all()
    # A level closing axis across the cube's edge stands the cube on an edge.
    tie = outcomes(State(3, 1, 10), Action(Kind.ROTATE, 0))
    assert sorted(tie.values()) == [0.5, 0.5]


def test_ties_do_not_hang_on_the_tolerance(monkeypatch):
    number = estimate.rotated_orientations()[0]
    for tolerance in (1e-8, 0.06):
        monkeypatch.setattr(estimate, "TIE", tolerance)
        other = estimate.rotated_orientations.__wrapped__()[0]
        np.testing.assert_array_equal(other, number)


def test_the_name_conceals_up_to_52_degrees_of_the_turn():
    number, outcomes = estimate.rotated_orientations()
    turned = (R_WG[None] @ np.swapaxes(R_WG, 1, 2)[:, None])[:, :, None] @ R_WO
    angle = np.degrees(geodesic_angle(turned, R_WO[outcomes[..., 0]]))
    np.testing.assert_allclose(angle[np.arange(18), np.arange(18)], 0, atol=1e-9)
    assert angle.max() == pytest.approx(52.52, abs=0.01)
    # Where two are equally near, one is as far as the other.
    tied = number > 1
    second = np.degrees(geodesic_angle(turned[tied], R_WO[outcomes[tied][:, 1]]))
    np.testing.assert_allclose(second, angle[tied], atol=0.1)


def test_the_goal_can_be_reached_from_every_free_state(transitions):
    distance = np.full(N_STATES, -1)
    distance[spaces.GOAL_STATE] = 0
    for step in range(1, 8):
        sources = transitions.state[distance[transitions.next_state] == step - 1]
        distance[sources[distance[sources] < 0]] = step
    assert set(distance[: spaces.N_FREE]) == {0, 3, 4, 5}


@pytest.mark.parametrize("table", [np.ones((N_STATES, 54), dtype=bool), np.ones((N_STATES, 55))])
def test_a_wrong_table_of_pairs_is_refused(table):
    with pytest.raises(ModelError, match=r"wanted bool \[15984, 55\]"):
        estimate.estimated_transitions(table)
