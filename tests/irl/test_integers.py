import numpy as np
import pytest

from irl.errors import InputError
from irl.integers import integers, reals


@pytest.mark.parametrize(
    "values", [[1, 2], (1, 2), np.array([1, 2], np.uint8), np.array([1, 2], ">i2")]
)
def test_integers_of_any_kind_come_as_they_are(values):
    array = integers(values, "x")
    assert array.dtype == np.int64
    assert array.tolist() == [1, 2]


@pytest.mark.parametrize("values", [[], np.zeros(0), np.zeros((0, 2)), ()])
def test_nothing_is_nothing_whatever_its_type(values):
    assert integers(values, "x", columns=2).shape == (0, 2)


def test_a_result_is_the_users_own_no_more():
    given = np.array([1, 2])
    integers(given, "x")[0] = 7
    assert given.tolist() == [1, 2]


@pytest.mark.parametrize(
    ("values", "columns", "message"),
    [
        ([0.9, 1.0], None, r"x: integers \[n\] wanted, got floats .*astype\(int\)"),
        ([1.0, 2.0], None, "floats"),
        ([float("nan")], None, "floats"),
        ([True, False], None, r"booleans .*numpy\.flatnonzero\(mask\)"),
        ([1j], None, "complex"),
        (["1"], None, "other things"),
        ([None], None, "objects"),
        ([[1, 2]], None, r"integers \[n\] wanted, got int64 \[1, 2\]"),
        (3, None, r"got int64 \[\]"),
        ([1, 2, 3, 4], 2, r"integers \[n, 2\] wanted, got int64 \[4\]"),
        ([(0, 1, 1), (1, 1, 2), (0, 0, 0)], 2, r"got int64 \[3, 3\]; .*\[:, :2\]"),
        (np.zeros((2, 5), int), 2, r"got int64 \[2, 5\]; .*; if it is transposed, give its \.T"),
        ([(0, 1), (1, 1, 2)], 2, "integers wanted"),
        ([2**70], None, "x: "),
        ([-1], None, r"must lie in 0…\d+, is -1 in row 0"),
        (np.array([0, 2**63], np.uint64), None, r"is 9223372036854775808 in row 1"),
    ],
)
def test_what_is_not_such_integers_is_refused_and_said(values, columns, message):
    with pytest.raises(InputError, match=message):
        integers(values, "x", columns=columns)


def test_limits_are_the_callers_and_the_types():
    with pytest.raises(InputError, match=r"must lie in 0…4, is 5 in row 1"):
        integers([4, 5], "x", below=5)
    with pytest.raises(InputError, match=r"must lie in 0…2147483647, is 4294967296 in row 0"):
        integers([2**32], "x", dtype=np.int32)
    assert integers([-3], "x", low=None).tolist() == [-3]


def test_what_is_masked_is_never_taken_for_what_is_under_the_mask():
    hidden = np.ma.array([0, 7], mask=[False, True])
    with pytest.raises(InputError, match="states: 1 entries are masked"):
        integers(hidden, "states")
    with pytest.raises(InputError, match="reward: 1 entries are masked"):
        reals(hidden, "reward")
    np.testing.assert_array_equal(integers(np.ma.array([0, 7], mask=False), "states"), [0, 7])


@pytest.mark.parametrize("values", ["one", ["1.5"], [1j], [None], [[1], [1, 2]]])
def test_what_is_no_real_number_is_refused(values):
    with pytest.raises(InputError, match="reward: "):
        reals(values, "reward")


def test_real_numbers_are_taken_as_they_are():
    table = np.array([[0.5, np.nan]])
    assert reals(table, "reward") is table
    assert reals([1, 2], "reward").dtype == np.float64
