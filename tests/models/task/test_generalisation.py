"""Generalisation groups: who follows from whom, rule by rule."""

import numpy as np
import pytest

from models.errors import ModelError
from models.task import generalisation as gen
from models.task import pairs, spaces
from models.task.clusters import uncomfortable_states
from models.task.spaces import Action, Kind, State


@pytest.fixture(scope="module")
def groups():
    return gen.generalisation_groups(pairs.nominal_pairs())


@pytest.fixture(scope="module")
def following(groups):
    def look_up(rule: str, state: State, action: Action) -> set[tuple[State, Action]]:
        of_rule = groups.rule == gen.RULES.index(rule)
        here = of_rule & (groups.state == state.index) & (groups.action == action.index)
        assert here.sum() <= 1
        rows = np.isin(groups.group, groups.group[here]) & ~here
        return {
            (State.from_index(int(s)), Action.from_index(int(a)))
            for s, a in zip(groups.state[rows], groups.action[rows], strict=True)
        }

    return look_up


def test_layout(groups):
    assert [column.dtype.name for column in groups] == ["int32", "int32", "int32", "uint8"]
    assert set(np.unique(groups.rule)) == set(range(len(gen.RULES)))
    assert (np.diff(groups.group) >= 0).all()
    assert (np.bincount(groups.group) >= 2).all()
    # One rule to a group, one group of each rule to a pair.
    assert np.unique(np.stack([groups.group, groups.rule]), axis=1).shape[1] == groups.group[-1] + 1
    key = np.stack([groups.state, groups.action, groups.rule])
    assert np.unique(key, axis=1).shape[1] == groups.state.size


def test_grasps_follow_in_every_column(following):
    grasp = Action(Kind.GRASP, 10)
    found = following("grasp_any_position", State(4, 7), grasp)
    assert found == {(State(2 * xy, 7), grasp) for xy in range(9) if xy != 2}


def test_uncomfortable_grasps_neither_give_nor_receive(following):
    grasp = Action(Kind.GRASP, 1)  # points left
    columns = {state.position for state, _ in following("grasp_any_position", State(2, 7), grasp)}
    assert columns == {4, 8, 10, 14, 16}
    assert following("grasp_any_position", State(0, 7), grasp) == set()


def test_translations_follow_to_the_goal_column_only(following):
    to_goal = Action(Kind.TRANSLATE, 3)
    found = following("translate_to_goal", State(8, 7, 10), to_goal)
    assert found == {(State(2 * xy, 7, 10), to_goal) for xy in range(9) if xy != 4}
    assert following("translate_to_goal", State(8, 7, 10), Action(Kind.TRANSLATE, 5)) == set()
    # Each height is its own group.
    other = following("translate_to_goal", State(8, 7, 10), Action(Kind.TRANSLATE, 2))
    assert {action.target for _, action in other} == {2}
    assert len(other) == 7  # it is not an action where the cube is already there


def test_translations_from_elsewhere_leave_the_goal_column_out(following):
    to_goal = Action(Kind.TRANSLATE, 3)
    found = following("translate_from_elsewhere", State(8, 7, 10), to_goal)
    assert found == {(State(2 * xy, 7, 10), to_goal) for xy in range(9) if xy not in (1, 4)}
    assert following("translate_from_elsewhere", State(2, 7, 10), to_goal) == set()


def test_drops_follow_literally_or_by_height(following):
    drop = Action(Kind.DROP)
    found = following("drop_anywhere", State(3, 0, 10), drop)
    assert found == {(State(2 * xy + 1, 0, 10), drop) for xy in range(9) if xy != 1}
    assert following("drop_any_height", State(3, 0, 10), drop) == {(State(2, 0, 10), drop)}


def test_rotations_are_comfortable_before_and_after(following):
    found = following("rotate_any_position", State(2, 7, 3), Action(Kind.ROTATE, 1))
    assert {state.position for state, _ in found} == {8, 14}
    found = following("rotate_any_position", State(2, 7, 10), Action(Kind.ROTATE, 0))
    assert len(found) == 8


def test_rules_of_the_thesis_leave_uncomfortable_states_alone(groups):
    by_thesis = groups.rule < len(gen.THESIS_RULES)
    assert not np.isin(groups.state[by_thesis], uncomfortable_states()).any()


def test_only_feasible_pairs_are_in_groups():
    feasible = np.zeros((spaces.N_STATES + 1, spaces.N_ACTIONS), dtype=bool)
    assert gen.generalisation_groups(feasible).state.size == 0
    feasible[[State(0, 3).index, State(2, 3).index, State(4, 5).index], 12] = True
    found = gen.generalisation_groups(feasible)
    assert found.state.tolist() == [State(0, 3).index, State(2, 3).index]


def test_a_wrong_table_of_pairs_is_refused():
    with pytest.raises(ModelError, match="wanted bool"):
        gen.generalisation_groups(np.ones((3, 3), dtype=bool))
