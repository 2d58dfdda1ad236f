import numpy as np
import pytest

from irl.errors import InputError
from irl.generalisation import Generalisation

# Rule near: {(0,0), (1,0), (2,0)} and {(3,1), (4,1)}; rule far: {(0,0), (3,1)}.
STATE, ACTION = (0, 1, 2, 3, 4, 0, 3), (0, 0, 0, 1, 1, 0, 1)
GROUP, RULE = (0, 0, 0, 1, 1, 2, 2), (0, 0, 0, 0, 0, 1, 1)
ROWS = list(zip(STATE, ACTION, GROUP, RULE, strict=True))


def build(rows=ROWS, names=("near", "far")) -> Generalisation:
    state, action, group, rule = np.array(rows).T
    return Generalisation(
        state.astype(np.int32),
        action.astype(np.int32),
        group.astype(np.int32),
        rule.astype(np.uint8),
        list(names),
    )


def pairs(following):
    return list(zip(*(column.tolist() for column in following), strict=True))


@pytest.mark.parametrize("order", [slice(None), slice(None, None, -1)])
def test_what_follows_is_the_rest_of_each_group(order):
    g = build(ROWS[order])
    assert pairs(g.following(0, 0)) == [(1, 0), (2, 0), (3, 1)]
    assert pairs(g.following(3, 1)) == [(4, 1), (0, 0)]
    assert pairs(g.following(0, 0, ["far"])) == [(3, 1)]
    assert pairs(g.following(1, 0)) == [(0, 0), (2, 0)]
    assert pairs(g.following(1, 0, ["far"])) == []


def test_pairs_without_a_group_speak_for_themselves_alone():
    assert pairs(build().following(0, 1)) == []
    assert pairs(Generalisation.none().following(0, 0)) == []


def test_unknown_rules_are_named_with_the_valid_ones():
    with pytest.raises(InputError, match="no rule 'nera'; valid: near, far"):
        build().following(0, 0, ["nera"])


@pytest.mark.parametrize(
    ("rows", "names", "words"),
    [
        ([(0, 0, 0, 0), (1, 0, 0, 1)], ("near", "far"), "'rule' differs within a group"),
        ([(0, 0, 0, 0), (0, 0, 0, 0)], ("near",), "twice"),
        ([(0, 0, 0, 2)], ("near", "far"), "'rule' holds 2"),
        ([(0, -1, 0, 0)], ("near",), "at least 0"),
        ([(0, 0, 0, 0)], ("near", "near"), "names a rule twice"),
    ],
)
def test_inconsistent_groups_are_refused(rows, names, words):
    with pytest.raises(InputError, match=words):
        build(rows, names)


def test_wrong_columns_are_named():
    good = build()
    with pytest.raises(
        InputError, match=r"field 'group' must be int32 \[7\], is int64 \[7\]|int64"
    ):
        Generalisation(good.state, good.action, good.group.astype(int), good.rule, ["a", "b"])
    with pytest.raises(InputError, match="field 'rule' must be uint8"):
        Generalisation(good.state, good.action, good.group, good.rule[:-1], ["a", "b"])
