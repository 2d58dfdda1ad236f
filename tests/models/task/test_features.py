"""State features: the values of a known state, and what sets states apart."""

import numpy as np

from models.rotations import rotation_z
from models.task import features, spaces
from models.task.spaces import LOST, State


def test_shapes_and_ranges():
    thesis, rotation = features.thesis_features(), features.rotation_features()
    assert thesis.shape == (15_985, 10) == (15_985, len(features.THESIS_NAMES))
    assert rotation.shape == (15_985, 31) == (15_985, len(features.ROTATION_NAMES))
    assert thesis.dtype == rotation.dtype == np.float32
    assert thesis.min() == 0 and thesis.max() == 1
    assert np.abs(rotation).max() <= 1 + 1e-6
    assert not thesis[LOST].any() and not rotation[LOST].any()


def test_no_two_states_look_alike():
    for table in (features.thesis_features(), features.rotation_features()):
        assert np.unique(table[: spaces.N_STATES], axis=0).shape[0] == spaces.N_STATES


def test_thesis_features_of_known_states():
    thesis = features.thesis_features()
    free = thesis[State(10, 19).index]
    np.testing.assert_allclose(free, [0.5, 1, 0, 0, 0.75, 0.375, 0, 0, 0, 0], atol=1e-6)
    held = thesis[State(17, 19, 7).index]
    np.testing.assert_allclose(
        held, [1, 1, 1, 0, 0.75, 0.375, 1, 225 / 360, 45 / 360, 125 / 360], atol=1e-6
    )


def test_rotation_features_of_known_states():
    table = features.rotation_features()
    names = np.array(features.ROTATION_NAMES)

    def block(row, prefix):
        return row[np.char.startswith(names, prefix)].reshape(3, 3)

    held = table[State(17, 2, 0).index]
    np.testing.assert_allclose(block(held, "R_WO"), rotation_z(np.pi / 2), atol=1e-6)
    np.testing.assert_allclose(block(held, "R_WG"), spaces.R_WG[0], atol=1e-6)
    R_GO = spaces.R_WG[0].T @ spaces.R_WO[2]
    np.testing.assert_allclose(block(held, "R_GO"), R_GO, atol=1e-6)
    free = table[State(16, 2).index]
    np.testing.assert_allclose(block(free, "R_WO"), rotation_z(np.pi / 2), atol=1e-6)
    assert not block(free, "R_WG").any() and not block(free, "R_GO").any()
