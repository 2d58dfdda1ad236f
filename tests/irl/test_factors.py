import numpy as np
import pytest

from irl.errors import InputError
from irl.factors import one_hot

STATES = [
    {"x": "0", "y": "1", "grip": ""},
    {"x": "0", "y": "2", "grip": "3"},
    {"x": "0", "y": "1", "grip": "3"},
]


def test_each_value_of_each_factor_has_a_column():
    columns = one_hot(STATES, [("x", "y"), ("grip",)])
    assert columns.dtype == np.float32
    assert columns.tolist() == [[1, 0, 1, 0], [0, 1, 0, 1], [1, 0, 0, 1]]


def test_an_unknown_column_is_named():
    with pytest.raises(InputError, match=r"'z'.*x, y, grip"):
        one_hot(STATES, [("z",)])
