"""Each single rule relates the pairs it names, and the thesis' kernel is made of its own three."""

import numpy as np
import pytest

from models.task import pairs, spaces
from models.task.discretise import nearest_orientation
from models.task.kernel_rules import (
    EXACT_RULES,
    THESIS_RULES,
    UPPER_LAYER,
    exact_rule,
    thesis_kernel,
)
from models.task.spaces import R_WO, Action, Kind, State
from models.task.trial_classes import trial_classes

CLASSES = trial_classes()


def rule(state, action):
    number = int(exact_rule(CLASSES, [state.index], [action.index])[0])
    return EXACT_RULES[number] if number >= 0 else None


@pytest.mark.parametrize("action", [Action(Kind.TRANSLATE, 3), Action(Kind.DROP)])
def test_the_rule_that_alone_relates_a_pair_to_the_one_that_stands_for_it(action):
    def held(position, orientation, gripper):
        return rule(State(position, orientation, gripper), action)

    assert held(0, 0, 10) == "place"
    quarter_turned = [o for o in range(48) if o % 2 == 0 and o]
    assert {held(8, o, 10) for o in quarter_turned} == {"cube"}
    # By 180° about the vertical: a hand turned alone, or hand and cube together.
    turned, _ = nearest_orientation(np.diag([-1.0, -1.0, 1.0]) @ R_WO[0])
    assert held(8, 0, 14) == "half turn"
    assert held(8, int(turned), 14) == "turn"
    assert held(8, 6, 14) is None  # a quarter turn of the cube besides


def test_a_mirror_image_is_told_from_a_turn():
    # Front left and front right, tilted: no turn takes one to the other as the table rounds it.
    before = CLASSES.tried(CLASSES.number(State(8, 0, 7).index, Action(Kind.DROP).index), 0)
    state = State.from_index(int(before.state))
    assert state.gripper == 7
    mirrored = np.diag([1, -1, 1]) @ R_WO[state.orientation] @ np.diag([1, -1, 1])
    orientation, angle = nearest_orientation(mirrored)
    assert angle < 1e-9
    assert rule(State(8, int(orientation), 9), Action(Kind.DROP)) == "mirror"


def test_rules_relate_pairs_of_one_class_only_and_every_rule_is_found():
    state, action = np.nonzero(pairs.nominal_pairs())
    found = exact_rule(CLASSES, state, action)
    kind = spaces.decode_actions(action).kind
    for k in Kind:
        assert set(found[kind == k]) == {-1, *range(len(EXACT_RULES))}
    # What stands for a class relates to itself by no more than its place.
    for number in range(CLASSES.n_classes):
        tried = CLASSES.tried(number, 0)
        assert exact_rule(CLASSES, [tried.state], [tried.action]) == [EXACT_RULES.index("place")]


def test_kernel_of_the_thesis():
    def kernel(*state_and_action, rules=THESIS_RULES):
        *parts, action = state_and_action
        return thesis_kernel(State(*parts).index, action.index, rules)

    grasp = Action(Kind.GRASP, 3)
    assert kernel(0, 0, grasp) == kernel(8, 2, grasp) == kernel(4, 10, grasp)
    assert kernel(0, 0, grasp) != kernel(0, 1, grasp)
    assert kernel(0, 0, grasp) != kernel(0, 0, Action(Kind.GRASP, 10))
    raised, level = Action(Kind.TRANSLATE, 5), Action(Kind.TRANSLATE, 4)
    assert kernel(0, 0, 3, raised) == kernel(2, 2, 11, raised)
    assert kernel(0, 0, 3, raised) != kernel(1, 0, 3, raised)
    assert kernel(0, 0, 3, level) != kernel(0, 0, 11, level)
    drop = Action(Kind.DROP)
    assert kernel(0, 0, 3, drop) == kernel(16, 40, 3, drop) != kernel(17, 40, 3, drop)
    # One rule at a time.
    assert kernel(0, 0, 3, drop, rules=["columns"]) == kernel(16, 0, 3, drop, rules=["columns"])
    assert kernel(0, 0, 3, drop, rules=["columns"]) != kernel(0, 2, 3, drop, rules=["columns"])
    alone = {"rules": [UPPER_LAYER]}
    assert kernel(0, 0, 3, raised, **alone) == kernel(0, 0, 11, raised, **alone)
    assert kernel(0, 0, 3, raised, **alone) != kernel(2, 0, 3, raised, **alone)


def test_kernel_classes_are_counted():
    state, action = np.nonzero(pairs.nominal_pairs())
    kind = spaces.decode_actions(action).kind
    number = thesis_kernel(state, action)
    assert [np.unique(number[kind == k]).size for k in Kind] == [36, 684, 1224, 72]
    assert np.unique(thesis_kernel(state, action, [])).size == state.size
