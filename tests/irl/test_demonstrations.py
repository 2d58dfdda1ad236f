import numpy as np
import pytest

from irl.demonstrations import SOURCES, Demonstrations, generalise
from irl.errors import InputError
from irl.generalisation import Generalisation

# One group: the action 1 carries over between the states 0, 1 and 2.
GROUPS = Generalisation(
    np.array([0, 1, 2], dtype=np.int32),
    np.array([1, 1, 1], dtype=np.int32),
    np.zeros(3, dtype=np.int32),
    np.zeros(3, dtype=np.uint8),
    ["same"],
)


def sources(demonstrations):
    return [SOURCES[k] for k in demonstrations.source]


def test_from_pairs_counts_steps():
    shown = Demonstrations.from_pairs([(4, 1), (2, 0)], trajectory=3, source="human")
    assert shown.step.tolist() == [0, 1]
    assert shown.trajectory.tolist() == [3, 3]
    assert shown.pairs == [(4, 1), (2, 0)]
    assert len(Demonstrations.empty()) == 0
    with pytest.raises(
        InputError, match="no source 'dog'; valid: demonstrator, generalised, human"
    ):
        Demonstrations.from_pairs([], source="dog")


def test_merging_keeps_the_first_label_and_demonstrated_ones_above_generalised():
    first = Demonstrations.from_pairs([(0, 0), (0, 1)])
    derived = Demonstrations.from_pairs([(0, 2), (1, 0), (2, 0)], source="generalised")
    later = Demonstrations.from_pairs([(1, 1)], source="human")
    merged = first.merge(derived).merge(later)
    assert sorted(merged.pairs) == [(0, 0), (1, 1), (2, 0)]
    assert merged.n_states_demonstrated == 3
    assert merged.demonstrated_fraction(12) == 0.25
    again = merged.merge(Demonstrations.from_pairs([(2, 3)], source="generalised"))
    assert (2, 0) in again.pairs


def test_merging_keeps_the_order_given():
    merged = Demonstrations.from_pairs([(5, 0), (1, 0)]).merge(Demonstrations.from_pairs([(3, 0)]))
    assert merged.pairs == [(5, 0), (1, 0), (3, 0)]


def test_generalise_adds_what_follows_with_its_origin():
    shown = Demonstrations.from_pairs([(3, 0), (1, 1)], trajectory=7)
    more = generalise(shown, GROUPS)
    assert more.pairs == [(3, 0), (1, 1), (0, 1), (2, 1)]
    assert sources(more) == ["demonstrator"] * 2 + ["generalised"] * 2
    assert more.trajectory.tolist() == [7] * 4
    assert more.step.tolist() == [0, 1, 1, 1]
    assert generalise(shown, GROUPS, rules=[]).pairs == shown.pairs


def test_generalise_never_overrides_a_demonstration():
    assert generalise(Demonstrations.from_pairs([(1, 1), (2, 0)]), GROUPS).pairs == [
        (1, 1),
        (2, 0),
        (0, 1),
    ]


def test_what_followed_before_does_not_breed():
    derived = Demonstrations.from_pairs([(1, 1)], source="generalised")
    assert generalise(derived, GROUPS).pairs == [(1, 1)]


def test_csv_round_trip(tmp_path):
    shown = generalise(Demonstrations.from_pairs([(3, 0), (1, 1)]), GROUPS)
    shown.save(tmp_path / "d.csv")
    assert (tmp_path / "d.csv").read_text().splitlines()[:2] == [
        "trajectory,step,state,action,source",
        "0,0,3,0,demonstrator",
    ]
    read = Demonstrations.load(tmp_path / "d.csv")
    for column in ("trajectory", "step", "state", "action", "source"):
        np.testing.assert_array_equal(getattr(read, column), getattr(shown, column))
        assert getattr(read, column).dtype == getattr(shown, column).dtype
    Demonstrations.empty().save(tmp_path / "none.csv")
    assert len(Demonstrations.load(tmp_path / "none.csv")) == 0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("state,action\n", "columns must be"),
        ("trajectory,step,state,action,source\n0,0,-1,0,human\n", "row 0, field 'state'"),
        ("trajectory,step,state,action,source\n0,0,1,x,human\n", "row 0, field 'action'"),
        (
            "trajectory,step,state,action,source\n0,0,1,0,dog\n",
            "'source' is 'dog'; valid: demonstr",
        ),
    ],
)
def test_bad_csv_is_refused(tmp_path, text, words):
    (tmp_path / "d.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        Demonstrations.load(tmp_path / "d.csv")


@pytest.mark.parametrize(
    ("pair", "words"),
    [
        ((9, 0), r"row 1, field 'state' is 9, must lie in 0…3"),
        ((0, 2), r"row 1, field 'action' is 2, must lie in 0…1"),
        ((3, 1), r"row 1, field 'action' is 1, not feasible in state 3; valid: none"),
    ],
)
def test_check_names_the_first_pair_that_cannot_be_done(chain, pair, words):
    with pytest.raises(InputError, match=words):
        Demonstrations.from_pairs([(0, 1), pair]).check(chain)
    Demonstrations.from_pairs([(0, 1)]).check(chain)
