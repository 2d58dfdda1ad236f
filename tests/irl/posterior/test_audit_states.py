"""Where an audit asks: beside where runs ended, and everywhere else in equal parts."""

from itertools import pairwise

import numpy as np
import pytest

from irl.domains.gridworld import GridWorld
from irl.posterior.audit_states import audit_parts, beside, parts
from irl.problem import LearningProblem

N = 9
STATES = np.arange(N * N)
ROW, COLUMN = np.divmod(STATES, N)
FEATURES = np.column_stack([ROW, COLUMN]) / N
END = np.array([40])


@pytest.mark.parametrize("starts", ["all", "none", "some"])
def test_parts_are_alike_in_size_and_in_the_order_of_what_is_done(starts):
    rng = np.random.default_rng(0)
    action = rng.integers(-1, 4, 150)
    first = {"all": action > -2, "none": action < -2, "some": rng.random(150) < 0.2}[starts]
    part = parts(action, first, 13)
    assert np.unique(part).tolist() == list(range(13))
    for some in (first, ~first):
        within = [action[some & (part == k)] for k in np.unique(part[some])]
        sizes = [each.size for each in within]
        assert not sizes or max(sizes) - min(sizes) <= 1
        assert all(a.max() <= b.min() for a, b in pairwise(within))
    if starts == "some":
        assert (part[first].max(), part[~first].min()) == (6, 7)
    few = np.zeros(150, dtype=bool)
    few[:2] = True
    assert np.unique(parts(action, few, 12)[few]).size == 2


def test_beside_an_end_one_thing_at_a_time_is_different():
    near = beside(END, {"row": ROW, "column": COLUMN}, FEATURES, np.setdiff1d(STATES, END))
    assert [each.tolist() for each in near] == [[31], [39]]
    assert (ROW[39], COLUMN[31]) == (ROW[40], COLUMN[40])


def test_what_has_no_name_stays_as_it_is_if_features_tell_of_it():
    among = np.setdiff1d(STATES, END)
    (named,) = beside(END, {"row": ROW}, FEATURES, among)
    assert COLUMN[named] == COLUMN[40]
    assert ROW[named] != ROW[40]
    (blind,) = beside(END, {"row": ROW}, None, among)
    assert ROW[blind] != ROW[40]


def test_every_end_has_a_state_beside_it_and_equal_sets_are_one():
    ends = np.array([0, 80])
    factors = {"row": ROW, "again": ROW + 5, "same": np.zeros(N * N, dtype=np.int64)}
    (near,) = beside(ends, factors, FEATURES, np.setdiff1d(STATES, ends))
    assert near.tolist() == [9, 71]
    assert beside(ends, {}, FEATURES, STATES) == []
    assert beside(np.zeros(0, dtype=np.int64), factors, FEATURES, STATES) == []


@pytest.mark.parametrize("number", [6, 13, 18])
def test_up_to_a_third_of_the_parts_are_beside_ends(number):
    factors = {f"{k}": (STATES * 7) // (k + 2) % 5 for k in range(8)}
    problem = LearningProblem(GridWorld(N, (0, 0)).model, FEATURES, gamma=0.9, factors=factors)
    states = np.setdiff1d(STATES, END)
    action = states % 4
    every = beside(END, factors, FEATURES, states)
    tried, most = set(), min(number // 3, len(every))
    for turn in range(8):
        part = audit_parts(problem, states, action, END, number, turn)
        assert np.unique(part).tolist() == list(range(number))
        size = np.bincount(part)
        assert (size[-most:] == 1).all()
        assert (size[:-most] > 1).all()
        tried |= set(states[part >= number - most].tolist())
    assert tried == set(np.concatenate(every).tolist())


def test_without_factors_or_ends_all_parts_are_alike():
    model = GridWorld(N, (0, 0)).model
    plain = LearningProblem(model, FEATURES, gamma=0.9)
    named = LearningProblem(model, FEATURES, gamma=0.9, factors={"row": ROW})
    nowhere = np.zeros(0, dtype=np.int64)
    alike = parts(STATES % 4, np.ones(N * N, dtype=bool), 13)
    for problem, ends in ((plain, END), (named, nowhere)):
        np.testing.assert_array_equal(audit_parts(problem, STATES, STATES % 4, ends, 13), alike)
