import numpy as np
import pytest

from irl.baselines.features import state_features
from irl.errors import InputError


def test_absent_features_are_one_indicator_per_state(chain):
    phi = state_features(chain, None)
    np.testing.assert_array_equal(phi.toarray(), np.eye(4))
    weights = np.array([1.0, 2.0, 3.0, 4.0])
    np.testing.assert_array_equal(phi @ weights, weights)


def test_given_features_become_float64(chain):
    phi = state_features(chain, np.arange(8).reshape(4, 2))
    assert phi.dtype == np.float64
    np.testing.assert_array_equal(phi[3], [6, 7])


@pytest.mark.parametrize("features", [np.zeros(4), np.zeros((3, 2)), np.full((4, 1), np.nan)])
def test_bad_features_are_refused(chain, features):
    with pytest.raises(InputError, match=r"features: finite values \[4, d\] wanted"):
        state_features(chain, features)
