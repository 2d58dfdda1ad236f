"""DH chains against the vendor's joint origins, chained independently."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from models.dh import GEN3_DH, GEN3_LITE_DH, forward_kinematics, joint_frames
from models.errors import ModelError

# Origins (metres) and turns (degrees, fixed axes) of each joint in its parent, from the
# vendor's descriptions, and the fixed end effector last.
GEN3_ORIGINS = [
    ((0.0, 0.0, 0.15643), (180, 0, 0)),
    ((0.0, 0.005375, -0.12838), (90, 0, 0)),
    ((0.0, -0.21038, -0.006375), (-90, 0, 0)),
    ((0.0, 0.006375, -0.21038), (90, 0, 0)),
    ((0.0, -0.20843, -0.006375), (-90, 0, 0)),
    ((0.0, 0.00017505, -0.10593), (90, 0, 0)),
    ((0.0, -0.10593, -0.00017505), (-90, 0, 0)),
    ((0.0, 0.0, -0.061525), (180, 0, 0)),
]
GEN3_LITE_ORIGINS = [
    ((0.0, 0.0, 0.12825), (0, 0, 0)),
    ((0.0, -0.03, 0.115), (90, 0, 0)),
    ((0.0, 0.28, 0.0), (180, 0, 0)),
    ((0.0, -0.14, 0.02), (90, 0, 0)),
    ((0.0285, 0.0, 0.105), (0, 90, 0)),
    ((-0.105, 0.0, 0.0285), (0, -90, 0)),
    ((0.0, 0.0, 0.130), (0, 0, 0)),  # the tool that Table A.1 includes
]


def vendor_forward_kinematics(origins, q):
    R, p = Rotation.identity(len(q)), np.zeros((len(q), 3))
    for i, (xyz, rpy) in enumerate(origins):
        p = p + R.apply(xyz)
        R = R * Rotation.from_euler("xyz", rpy, degrees=True)
        if i < q.shape[1]:
            R = R * Rotation.from_rotvec(q[:, i : i + 1] * [0, 0, 1])
    return R, p


@pytest.mark.parametrize(
    ("chain", "origins", "within"),
    [(GEN3_DH, GEN3_ORIGINS, 0.5e-3), (GEN3_LITE_DH, GEN3_LITE_ORIGINS, 0.01e-3)],
)
def test_agrees_with_the_vendors_joint_origins(chain, origins, within):
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (2000, chain.n_joints))
    R, p = vendor_forward_kinematics(origins, q)
    R_BE, p_BE = forward_kinematics(chain, q)
    assert np.linalg.norm(p_BE - p, axis=1).max() < within
    assert (R.inv() * Rotation.from_matrix(R_BE)).magnitude().max() < 1e-9


def test_gen3_stands_straight_up_at_zero():
    R_BE, p_BE = forward_kinematics(GEN3_DH, np.zeros(7))
    np.testing.assert_allclose(R_BE, np.eye(3), atol=1e-12)
    # Height: the offsets along the straight arm; sideways: shoulder and elbow.
    np.testing.assert_allclose(
        p_BE, [0, -0.0118 - 0.0128, 0.2848 + 0.4208 + 0.3143 + 0.1674], atol=1e-12
    )


def test_limits_are_those_of_the_tables():
    assert np.isinf(GEN3_DH.upper[[0, 2, 4, 6]]).all()
    np.testing.assert_allclose(np.degrees(GEN3_DH.upper[[1, 3, 5]]), [128.9, 147.8, 120.3])
    np.testing.assert_allclose(np.degrees(GEN3_LITE_DH.upper), [154, 150, 150, 149, 145, 149])
    for chain in (GEN3_DH, GEN3_LITE_DH):
        np.testing.assert_array_equal(chain.lower, -chain.upper)


def test_batches_are_elementwise():
    q = np.random.default_rng(1).uniform(-1, 1, (2, 3, 7))
    R_BE, p_BE = forward_kinematics(GEN3_DH, q)
    R_one, p_one = forward_kinematics(GEN3_DH, q[1, 2])
    assert R_BE.shape == (2, 3, 3, 3) and p_BE.shape == (2, 3, 3)
    np.testing.assert_allclose(R_BE[1, 2], R_one, atol=1e-15)
    np.testing.assert_allclose(p_BE[1, 2], p_one, atol=1e-15)
    Q, k = joint_frames(GEN3_LITE_DH, q[..., :6])
    assert Q.shape == (2, 3, 6, 3, 3) and k.shape == (2, 3, 6, 3)


@pytest.mark.parametrize("q", [np.zeros(6), 0.0, np.zeros((7, 1))])
def test_a_wrong_number_of_joints_is_refused(q):
    with pytest.raises(ModelError, match=r"gen3 wants \[\.\.\., 7\]"):
        forward_kinematics(GEN3_DH, q)
