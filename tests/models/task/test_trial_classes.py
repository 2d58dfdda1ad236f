"""Trial classes: every sensible pair is in exactly one, and each has a pair to stand for it."""

import numpy as np
import pytest

from models.task.pairs import nominal_pairs
from models.task.spaces import Action, Kind, State, decode_actions
from models.task.trial_classes import trial_classes

CLASSES = trial_classes()


def number(state, action):
    return int(CLASSES.number(state.index, action.index))


def test_classes_share_out_the_pairs():
    state, action = np.nonzero(nominal_pairs())
    numbers = CLASSES.number(state, action)
    assert np.array_equal(np.unique(numbers), np.arange(CLASSES.n_classes))
    kinds = np.array([CLASSES.kind(n) for n in range(CLASSES.n_classes)])
    assert np.array_equal(kinds[numbers], decode_actions(action).kind)
    sizes = [CLASSES.members(n)[-1].state.size for n in range(CLASSES.n_classes)]
    assert np.array_equal(np.bincount(numbers), sizes)


@pytest.mark.parametrize("kind", Kind)
def test_members_and_the_tried_pairs_are_of_the_class(kind):
    for n in range(CLASSES.n_classes):
        if CLASSES.kind(n) == kind:
            *_, pairs = CLASSES.members(n)
            assert (CLASSES.number(*pairs) == n).all()
            assert all(CLASSES.number(*CLASSES.tried(n, r)) == n for r in range(5))


def test_translations_are_tried_once_along_each_way():
    n = number(State(0, 0, 10), Action(Kind.TRANSLATE, 1))
    ways = {tuple(map(int, CLASSES.tried(n, r))) for r in range(18 * 17)}
    assert len(ways) == 18 * 17


def test_what_makes_a_difference_makes_a_class():
    hold = State(8, 0, 10)
    drop = Action(Kind.DROP)
    assert number(hold, drop) == number(State(0, 8, 12), drop)  # elsewhere, all turned by 90°
    assert number(hold, drop) != number(State(9, 0, 10), drop)  # from higher
    assert number(hold, drop) != number(State(8, 1, 10), drop)  # askew
    level, down = Action(Kind.ROTATE, 0), Action(Kind.ROTATE, 12)
    assert number(hold, level) != number(hold, down)
    assert number(hold, level) == number(State(17, 16, 10), level)
    assert number(hold, Action(Kind.TRANSLATE, 3)) == number(
        State(5, 16, 12), Action(Kind.TRANSLATE, 9)
    )
