import numpy as np
import pytest

from irl.errors import InputError
from irl.preferences import StatePreferences


def test_hand_numbers():
    f = np.array([0.5, -0.5, 0.5, -0.5, 0.0, 0.3])
    preferences = StatePreferences(preferred=[1, 0, 4], avoided=[2, 3])
    np.testing.assert_allclose(preferences.apply(f), [0.6, -0.4, 0.4, -0.6, 0.0, 0.3])
    assert f[0] == 0.5


def test_none_changes_nothing():
    np.testing.assert_array_equal(StatePreferences().apply(np.ones(2)), np.ones(2))


def test_contradictions_and_strangers_are_named():
    with pytest.raises(InputError, match="state 4 is both"):
        StatePreferences([3, 4], [4])
    with pytest.raises(InputError, match="must lie in 0…2"):
        StatePreferences([3]).apply(np.zeros(3))
