"""Where a run ended is recorded, kept through every operation, and checked."""

from itertools import islice

import numpy as np
import pytest

from irl.collection import demonstrate_to_the_end, mislabel, runs_from
from irl.demonstrations import Demonstrations
from irl.demonstrators import OracleDemonstrator
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.method_inputs import walks


@pytest.fixture
def corridor():
    """Six rooms; action 0 goes left, 1 right."""
    room = np.arange(6)
    state, after = np.r_[room[1:], room[:-1]], np.r_[room[:-1], room[1:]]
    action = np.repeat([0, 1], 5)
    return TransitionModel.from_entries(6, 2, state, action, after, np.ones(10))


def ended() -> Demonstrations:
    return Demonstrations.from_trajectories([[(0, 1), (1, 1)], [], [(5, 0)]], ends=[2, 3, None])


def test_a_run_says_where_it_ended_and_one_without_pairs_that_nothing_is_to_do():
    assert ended().ends.tolist() == [[0, 2, 2], [1, 0, 3]]
    assert len(ended()) == 3
    assert not Demonstrations.from_pairs([(0, 1)]).ends.size


def test_ends_survive_a_file_and_files_without_them_are_as_before(tmp_path):
    path = tmp_path / "d.csv"
    ended().save(path)
    lines = path.read_text().splitlines()
    assert lines[1:4] == ["0,0,0,1,demonstrator", "0,1,1,1,demonstrator", "0,2,2,,demonstrator"]
    back = Demonstrations.load(path)
    assert back.ends.tolist() == ended().ends.tolist()
    assert back.pairs == ended().pairs
    path.write_text("trajectory,step,state,action,source\n0,0,,1,demonstrator\n")
    with pytest.raises(InputError, match="row 0, field 'state'"):
        Demonstrations.load(path)


def test_an_end_is_lost_with_its_run_only():
    assert ended().select(np.array([1])).ends.tolist() == [[0, 2, 2], [1, 0, 3]]
    assert ended().select(np.array([2])).ends.tolist() == [[1, 0, 3]]


def test_an_answer_given_again_replaces_the_end_too():
    again = Demonstrations.from_pairs([(3, 0)], 1)
    assert ended().corrected(again).ends.tolist() == [[0, 2, 2]]


@pytest.mark.parametrize(
    ("ends", "told"),
    [
        ([[0, 1, 2]], "trajectory 0 has step 1"),
        ([[0, 2, 2], [0, 3, 2]], "trajectory 0 ends more than once"),
        ([[0, 2]], "ends"),
    ],
)
def test_impossible_ends_are_refused(ends, told):
    run = ended()
    with pytest.raises(InputError, match=told):
        Demonstrations(
            run.trajectory, run.step, run.state, run.action, run.source, ends=np.array(ends)
        )


def test_an_end_must_be_where_the_last_move_leads(corridor):
    ended().check(corridor)
    with pytest.raises(InputError, match="step 1 never leads to state 4"):
        Demonstrations.from_pairs([(0, 1), (1, 1)], end=4).check(corridor)
    with pytest.raises(InputError, match="ends in state 9"):
        Demonstrations.from_pairs([], end=9).check(corridor)


def test_a_parted_run_ends_where_its_last_part_does(corridor):
    joined = Demonstrations.from_pairs([(0, 1), (4, 0), (3, 0)], end=2)
    parted, places = joined.parted(corridor)
    assert places == 1
    assert parted.ends.tolist() == [[1, 3, 2]]
    assert walks(joined).ends.tolist() == [[0, 3, 2]]


def test_whoever_demonstrates_to_the_end_records_it(corridor):
    oracle = OracleDemonstrator(corridor, np.array([4]))
    shown = demonstrate_to_the_end(oracle, [1, 4], np.random.default_rng(0))
    assert shown.pairs == [(1, 1), (2, 1), (3, 1)]
    assert shown.ends.tolist() == [[0, 3, 4], [1, 0, 4]]
    cut = demonstrate_to_the_end(oracle, [0], np.random.default_rng(0), max_steps=2)
    assert not cut.ends.size


def test_runs_from_random_starts_record_where_they_ended(corridor):
    oracle = OracleDemonstrator(corridor, np.array([4]))
    rng = np.random.default_rng(0)
    runs = list(islice(runs_from(oracle, np.array([2, 4]), rng), 9))
    for number, run in enumerate(runs):
        assert run.ends[:, [0, 2]].tolist() == [[number, 4]]
        run.check(corridor)
    assert {len(run) for run in runs} == {0, 2}
    assert len(Demonstrations.concatenate(runs).ends) == 9


def test_a_label_that_only_follows_from_others_makes_no_end_doubtful(corridor):
    """Nobody said where the run ended, and a rule has a label for that state."""
    run = Demonstrations.from_pairs([(2, 1), (3, 1)])
    derived = Demonstrations.from_pairs([(4, 0)], 1, source="generalised")
    shown = Demonstrations.from_pairs([(4, 0)], 1)
    assert Demonstrations.concatenate([run, derived]).ended_in(corridor).tolist() == [4]
    assert Demonstrations.concatenate([run, shown]).ended_in(corridor).tolist() == []


def test_wrong_labels_leave_the_ends_of_runs_alone(corridor):
    oracle = OracleDemonstrator(corridor, np.array([4]))
    shown = demonstrate_to_the_end(oracle, [1], np.random.default_rng(0))
    wrong = corridor.mask & ~oracle.optimal_actions
    noisy = mislabel(shown, wrong, 0.34, np.random.default_rng(0))
    assert (noisy.action != shown.action).sum() == 1
    noisy.check(corridor)
    assert noisy.ends[:, 2].tolist() == [4]
