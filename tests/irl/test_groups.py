import numpy as np
import pytest

from irl.groups import Groups
from irl.mdp import TransitionModel


@pytest.fixture(params=range(3))
def uneven(request):
    """Groups of 1 to 5 entries, and values for each entry."""
    rng = np.random.default_rng(request.param)
    widths = rng.integers(1, 6, size=rng.integers(1, 20))
    return Groups.of_widths(widths), widths, rng.normal(size=widths.sum())


def pieces(widths, values):
    """The groups' values, one array each: what a loop would go over."""
    return np.split(values, np.cumsum(widths)[:-1])


def test_groups_agree_with_a_loop(uneven):
    groups, widths, values = uneven
    for found, each in ((groups.maximum, np.max), (groups.sum, np.sum)):
        np.testing.assert_allclose(found(values), [each(v) for v in pieces(widths, values)])
    shares = np.concatenate([np.exp(v) / np.exp(v).sum() for v in pieces(widths, values)])
    np.testing.assert_allclose(np.exp(groups.log_softmax(values)), shares)


def test_groups_cover_every_entry_once_and_in_order(uneven):
    groups, widths, values = uneven
    assert groups.widths.tolist() == widths.tolist()
    assert groups.size == values.size and len(groups) == widths.size
    assert groups.segment[groups.first].tolist() == list(range(len(groups)))
    assert (np.bincount(groups.segment) == widths).all()
    again = Groups.of_sorted(10 * groups.segment)
    assert again.first.tolist() == groups.first.tolist() and again.size == groups.size


def test_what_is_spread_is_what_a_group_has_in_each_entry(uneven):
    groups, widths, values = uneven
    of_group = groups.maximum(values)
    np.testing.assert_array_equal(groups.maximum(groups.spread(of_group)), of_group)
    np.testing.assert_allclose(groups.sum(groups.spread(of_group)), widths * of_group)


def test_a_constant_leaves_the_softmax_alone_and_shares_sum_to_one(uneven):
    groups, _, values = uneven
    constant = np.arange(len(groups), dtype=float)
    np.testing.assert_allclose(
        groups.log_softmax(values + groups.spread(constant)), groups.log_softmax(values)
    )
    np.testing.assert_allclose(
        groups.log_sum_exp(values + groups.spread(constant)), groups.log_sum_exp(values) + constant
    )
    np.testing.assert_allclose(groups.sum(np.exp(groups.log_softmax(values))), 1.0)


def test_log_sum_exp_neither_overflows_nor_underflows():
    z = np.array([1e4, 1e4, -1e4, -1e4 + np.log(2), 0.5, -np.inf, 2.0])
    expected = [1e4 + np.log(2), -1e4 + np.log(3), 0.5, 2.0]
    np.testing.assert_allclose(Groups.of_widths(np.array([2, 2, 1, 2])).log_sum_exp(z), expected)


def test_of_equal_entries_the_first_is_named():
    groups, values = Groups.of_widths(np.array([3, 1, 2])), np.array([1.0, 4, 4, 7, 2, 2])
    assert groups.first_equal(values, groups.maximum(values)).tolist() == [1, 3, 4]


@pytest.mark.parametrize("key", [np.zeros(0, dtype=int), np.zeros(4, dtype=int)])
def test_no_entry_is_no_group_and_equal_entries_are_one(key):
    groups = Groups.of_sorted(key)
    assert len(groups) == min(1, key.size)
    for found in (groups.maximum, groups.sum, groups.log_sum_exp):
        assert found(np.ones(key.size)).shape == (len(groups),)
    assert groups.log_softmax(np.ones(key.size)).shape == key.shape


def test_a_models_groups_pass_over_states_without_pairs():
    # State 1, in the middle, and state 3, at the end, have nothing to do.
    model = TransitionModel.from_entries(
        4, 2, np.array([2, 0, 2]), np.array([1, 1, 0]), np.array([0, 3, 1]), np.ones(3)
    )
    assert model.widths.tolist() == [1, 0, 2, 0]
    assert model.acting.tolist() == [0, 2]
    assert model.groups.maximum(np.array([5.0, 1.0, 3.0])).tolist() == [5.0, 3.0]
    assert model.acting[model.groups.segment].tolist() == model.pair_state.tolist()


def test_a_model_without_pairs_has_no_groups():
    nothing = np.zeros(0, dtype=int)
    model = TransitionModel.from_entries(2, 1, nothing, nothing, nothing, np.zeros(0))
    assert len(model.groups) == 0 and model.acting.size == 0 and model.widths.tolist() == [0, 0]
    assert model.groups.maximum(np.zeros(0)).size == 0
