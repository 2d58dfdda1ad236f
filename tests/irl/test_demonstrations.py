from dataclasses import replace

import numpy as np
import pytest

from irl.demonstrations import SOURCES, Demonstrations
from irl.errors import InputError
from irl.generalisation import Generalisation, generalise

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


def test_states_are_counted_once_however_often_they_are_labelled():
    shown = Demonstrations.from_labels([(5, 0), (5, 1), (1, 0), (5, 0)])
    more = Demonstrations.concatenate(
        [Demonstrations.from_pairs([(2, 0), (1, 1)], source="generalised"), shown]
    )
    assert more.n_states_demonstrated == 3
    assert more.demonstrated_fraction(12) == 0.25
    assert more.states_by_rank.tolist() == [5, 1, 2]


def test_an_answer_that_was_changed_replaces_the_old_one_with_all_that_followed():
    runs = [[(0, 0)], [(1, 1), (3, 0)], [(3, 1)]]
    lesson = generalise(Demonstrations.from_trajectories(runs), GROUPS)
    assert lesson.counted.policy(4).tolist() == [0, 1, 1, 0]
    changed = lesson.corrected(generalise(Demonstrations.from_pairs([(1, 0)], 1), GROUPS))
    assert sorted(changed.pairs) == [(0, 0), (1, 0), (3, 1)]
    assert changed.counted.policy(4).tolist() == [0, 0, -1, 1]
    # The same answer to another question is one more, and both count.
    another = lesson.corrected(Demonstrations.from_pairs([(1, 0)], 3))
    assert len(another) == len(lesson) + 1
    assert another.counted.policy(4)[1] == 1


def test_generalise_adds_what_follows_with_its_origin():
    shown = Demonstrations.from_pairs([(3, 0), (1, 1)], trajectory=7)
    more = generalise(shown, GROUPS)
    assert more.pairs == [(3, 0), (1, 1), (0, 1), (2, 1)]
    assert sources(more) == ["demonstrator"] * 2 + ["generalised"] * 2
    assert more.trajectory.tolist() == [7] * 4
    assert more.step.tolist() == [0, 1, 1, 1]
    assert generalise(shown, GROUPS, rules=[]).pairs == shown.pairs


def test_what_follows_from_others_never_outranks_a_demonstration():
    shown = generalise(Demonstrations.from_pairs([(1, 1), (2, 0)]), GROUPS)
    assert shown.pairs == [(1, 1), (2, 0), (0, 1), (2, 1)]
    assert shown.resolved().pairs == [(1, 1), (2, 0), (0, 1)]


def test_a_demonstrated_pair_speaks_once_for_each_other():
    twice = Generalisation(
        np.array([0, 1, 0, 1], dtype=np.int32),
        np.array([1, 1, 1, 1], dtype=np.int32),
        np.array([0, 0, 1, 1], dtype=np.int32),
        np.array([0, 0, 1, 1], dtype=np.uint8),
        ["one", "two"],
    )
    shown = Demonstrations.from_labels([(1, 1), (1, 1)])
    more = generalise(shown, twice)
    assert more.pairs == [(1, 1), (1, 1), (0, 1), (0, 1)]
    assert generalise(more, twice).pairs == more.pairs


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


@pytest.mark.parametrize(
    ("pairs", "message"),
    [
        ([(0, 1, 1), (1, 1, 2)], r"integers \[n, 2\] wanted, got int64 \[2, 3\]; if the first 2"),
        (np.zeros((2, 7), int), r"got int64 \[2, 7\]; .* transposed, give its \.T"),
        ([(0.0, 0.9)], r"got floats .*astype\(int\)"),
        ([0, 1, 1, 0], r"got int64 \[4\]"),
        ([(0, 1), (1,)], "integers wanted"),
        ([(0, -1)], r"must lie in 0…\d+, is -1 in row 0"),
    ],
)
def test_what_is_not_pairs_is_refused_rather_than_rearranged(pairs, message):
    with pytest.raises(InputError, match=message):
        Demonstrations.from_pairs(pairs)


@pytest.mark.parametrize("pairs", [[(0, 1), (1, 1)], np.array([[0, 1], [1, 1]], np.int16)])
def test_pairs_come_from_any_integers(pairs):
    assert Demonstrations.from_pairs(pairs).pairs == [(0, 1), (1, 1)]
    assert Demonstrations.from_pairs(iter(pairs)).pairs == [(0, 1), (1, 1)]


def test_one_moment_of_a_run_is_demonstrated_once_by_every_door(tmp_path):
    run = Demonstrations.from_pairs([(0, 1), (1, 1)])
    words = "trajectory 0 has step 0 more than once"
    with pytest.raises(InputError, match=words):
        Demonstrations.concatenate([run, Demonstrations.from_pairs([(2, 1)])])
    with pytest.raises(InputError, match=words):
        run.select(np.array([0, 1, 0]))
    path = tmp_path / "d.csv"
    path.write_text("trajectory,step,state,action,source\n0,0,0,1,human\n0,0,1,1,human\n")
    with pytest.raises(InputError, match=rf"d\.csv: {words}"):
        Demonstrations.load(path)
    # What follows from a moment bears its number, and is no second moment.
    assert len(generalise(Demonstrations.from_pairs([(1, 1)]), GROUPS)) == 3


def test_columns_are_of_one_length_and_of_integers():
    one, two = np.zeros(1, int), np.zeros(2, int)
    with pytest.raises(InputError, match="of one length wanted"):
        Demonstrations(two, np.arange(2), two, one, two)
    with pytest.raises(InputError, match=r"field 'state': .* floats"):
        Demonstrations(one, one, np.array([0.5]), one, one)
    with pytest.raises(InputError, match="field 'source': must lie in 0…2"):
        Demonstrations(one, one, one, one, np.array([3]))


def test_a_run_with_an_impossible_move_is_refused_with_its_place(chain):
    # 0 → 1 → 2 by moves to the right; from 2 one comes to 3, never to 0.
    glued = Demonstrations.from_pairs([(1, 1), (2, 1), (0, 1)], trajectory=5)
    with pytest.raises(
        InputError, match="trajectory 5, step 1: action 1 in state 2 never leads to state 0"
    ):
        glued.check(chain)
    Demonstrations.from_pairs([(1, 1), (2, 1)]).check(chain)
    Demonstrations.from_labels([(1, 1), (2, 1), (0, 1)]).check(chain)
    gap = replace(glued, step=np.array([0, 1, 3]))
    gap.check(chain)  # what lies between was not recorded


def test_runs_are_parted_where_a_move_is_impossible_and_the_places_are_counted(chain):
    shown = Demonstrations.from_trajectories(
        [[(1, 1), (2, 1), (0, 1), (1, 1), (0, 1)], [(0, 1), (1, 0)]]
    )
    parted, places = shown.parted(chain)
    assert places == 2
    assert parted.pairs == shown.pairs
    assert parted.trajectory.tolist() == [0, 0, 2, 2, 3, 1, 1]
    parted.check(chain)
    again, none = parted.parted(chain)
    assert none == 0
    assert again.trajectory.tolist() == parted.trajectory.tolist()


@pytest.mark.parametrize("pairs", [5, None, 0.5])
def test_what_is_no_sequence_is_refused_in_a_line(pairs):
    for door in (Demonstrations.from_pairs, Demonstrations.from_labels):
        with pytest.raises(InputError, match=r"pairs: integers \[n, 2\] wanted"):
            door(pairs)


def test_the_number_of_a_run_is_never_cut_off():
    with pytest.raises(InputError, match="trajectory: integers"):
        Demonstrations.from_pairs([(0, 1)], trajectory=0.5)
