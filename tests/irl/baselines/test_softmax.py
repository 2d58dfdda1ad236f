import numpy as np

from irl.baselines.softmax import acting_states, log_sum_exp


def test_groups_are_the_states_that_act(chain):
    states, first, segment = acting_states(chain)
    assert states.tolist() == [0, 1, 2]
    assert first.tolist() == [0, 2, 4]
    assert segment.tolist() == [0, 0, 1, 1, 2, 2]


def test_log_sum_exp_neither_overflows_nor_underflows():
    z = np.array([1e4, 1e4, -1e4, -1e4 + np.log(2), 0.5])
    first, segment = np.array([0, 2, 4]), np.array([0, 0, 1, 1, 2])
    expected = [1e4 + np.log(2), -1e4 + np.log(3), 0.5]
    np.testing.assert_allclose(log_sum_exp(z, first, segment), expected)


def test_nothing_to_choose_from_is_no_group():
    empty = np.zeros(0, dtype=int)
    assert log_sum_exp(np.zeros(0), empty, empty).size == 0
