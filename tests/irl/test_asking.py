"""What is asked next: what brings most for each second of the teacher, and never a toss-up."""

import numpy as np
import pytest

from irl.asking import (
    ADVICE,
    PRIORS,
    STATE,
    STEP,
    TRAJECTORY,
    Offer,
    as_good_as_best,
    choose,
    looked_at,
    measured_seconds,
    toss_up,
    visits,
)
from irl.errors import InputError
from irl.mdp import TransitionModel

SECONDS = {STEP: 2.0, STATE: 6.0, TRAJECTORY: 10.0, ADVICE: 40.0}


def test_seconds_are_the_lessons_own_medians_and_stated_ones_before_any():
    assert measured_seconds([]) == dict(PRIORS)
    times = [(STEP, 1.0), (STEP, 9.0), (STEP, 2.0), (STATE, 0.0), (ADVICE, 12.0), (STEP, np.inf)]
    seconds = measured_seconds(times)
    assert seconds == {**PRIORS, STEP: 2.0, ADVICE: 12.0}


@pytest.mark.parametrize(
    ("offers", "chosen"),
    [
        # 0.5/2 a second by going on, 1.0/6 by another state.
        ([Offer(STATE, 1.0), Offer(STEP, 0.5)], STEP),
        # 0.2/2 < 1.0/6.
        ([Offer(STATE, 1.0), Offer(STEP, 0.2)], STATE),
        # 5·0.8/(10 + 4·2) = 0.22 > 1.0/6, though each of its answers tells less.
        ([Offer(STATE, 1.0), Offer(TRAJECTORY, 0.8, 5)], TRAJECTORY),
        # 0.8/10 of one answer alone is less.
        ([Offer(STATE, 1.0), Offer(TRAJECTORY, 0.8, 1)], STATE),
        ([Offer(STATE, 1.0), Offer(ADVICE, 8.0, cluster="all")], ADVICE),
        # Of equals what goes on.
        ([Offer(STATE, 0.6), Offer(STEP, 0.2)], STEP),
    ],
)
def test_the_kind_with_most_gain_a_second_is_chosen(offers, chosen):
    for some in (offers, offers[::-1]):
        assert choose(some, SECONDS).offer.kind == chosen


def test_what_a_slow_teacher_says_of_states_is_worth_less():
    offers = [Offer(STATE, 1.0), Offer(STEP, 0.2)]
    slow = measured_seconds([(STATE, 30.0), (STEP, 2.0)])
    assert choose(offers, slow).offer.kind == STEP
    assert choose(offers, slow).rate == pytest.approx(0.1)


def test_answers_in_a_row_tell_no_more_than_is_left_to_learn():
    offers = [Offer(STATE, 1.0), Offer(TRAJECTORY, 0.8, 5)]
    chosen = choose(offers, SECONDS, left=1.2)  # 1.2/18 < 1.0/6
    assert chosen.offer.kind == STATE and chosen.gain == 1.0


def test_nothing_is_chosen_where_nothing_tells_anything():
    assert choose([], SECONDS) is None
    assert choose([Offer(STATE, 0.0), Offer(STEP, 0.0)], SECONDS) is None
    with pytest.raises(InputError, match="kind"):
        Offer("quiz", 1.0)


def test_a_toss_up_is_where_several_will_surely_do_and_no_other_is_in_doubt():
    nan = np.nan
    good = [
        [1.0, 0.99, 0.0, nan],  # either of two
        [1.0, 0.0, 0.0, nan],  # one, surely
        [1.0, 1.0, 0.5, nan],  # two, but is the third good?
        [0.5, 0.5, 0.0, nan],  # one or the other: worth asking
        [1.0, 1.0, nan, nan],  # all there is
    ]
    assert toss_up(np.array(good)).tolist() == [True, False, False, False, True]


def test_equal_values_are_a_toss_up_unless_all_are_equal_and_nothing_is_known():
    inf = -np.inf
    q = np.array([[1, 1, 0, inf], [1, 0.9, 0, inf], [0, 0, 0, inf], [1, 1 - 1e-9, -3, -3]])
    assert toss_up(as_good_as_best(q, 1e-6)).tolist() == [True, False, False, True]
    assert toss_up(as_good_as_best(q, 0.2)).tolist() == [True, True, False, True]


def test_gain_is_worked_out_where_the_policy_goes_and_where_it_is_asked_for():
    n = 900  # a line: 0 stays, 1 goes on
    state = np.arange(n).repeat(2)
    to = np.minimum(state + np.tile([0, 1], n), n - 1)
    model = TransitionModel.from_entries(n, 2, state, np.tile([0, 1], n), to, np.ones(2 * n))
    visited = visits(model, np.ones(n, dtype=np.int64), np.array([100]))
    assert np.flatnonzero(visited).tolist() == list(range(100, 120))
    some = looked_at(np.arange(n), visited, np.array([777]))
    assert some.size < n and {777, 0, n - 1, *range(100, 120)} <= set(some.tolist())
