"""Denavit–Hartenberg parameters of the two arms and their forward kinematics.

Independent of the URDF on purpose: a second opinion on where the tool is.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.arrays import finite_array
from models.errors import ModelError
from models.rotations import rotation_x

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DHChain:
    """A serial arm; one entry a joint, from base to tool.

    Attributes:
        name: what messages call the arm.
        a: link lengths ``[n]`` in metres.
        b: link offsets ``[n]`` in metres.
        alpha: link twists ``[n]`` in radians.
        theta_offset: θ − q, ``[n]`` in radians.
        lower: joint limits ``[n]`` in radians, −∞ for a joint that turns without end.
        upper: joint limits ``[n]`` in radians.
        R_B0: rotation ``[3, 3]`` of the chain's first frame 0 in the vendor's base frame B.
    """

    name: str
    a: Array
    b: Array
    alpha: Array
    theta_offset: Array
    lower: Array
    upper: Array
    R_B0: Array

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return self.a.size


GEN3_DH = DHChain(
    name="gen3",
    a=np.zeros(7),
    b=np.array([-0.2848, -0.0118, -0.4208, -0.0128, -0.3143, 0.0, -0.1674]),
    alpha=np.radians([90.0, 90, 90, 90, 90, 90, 180]),
    theta_offset=np.radians([0.0, 180, 180, 180, 180, 180, 180]),
    lower=np.radians([-np.inf, -128.9, -np.inf, -147.8, -np.inf, -120.3, -np.inf]),
    upper=np.radians([np.inf, 128.9, np.inf, 147.8, np.inf, 120.3, np.inf]),
    # Table 5.1 begins after the vendor's first row, which turns the base over.
    R_B0=rotation_x(np.pi),
)
"""Kinova Gen3, 7 joints (Tables 5.1, 5.2). The tool frame is the vendor's end effector."""

GEN3_LITE_DH = DHChain(
    name="gen3_lite",
    a=np.array([0.0, 0.28, 0.0, 0.0, 0.0, 0.0]),
    # Table A.1 prints 0.2433, the vendor's 243.25 mm rounded.
    b=np.array([0.24325, 0.03, 0.02, 0.245, 0.057, 0.235]),
    alpha=np.radians([90.0, 180, 90, 90, 90, 0]),
    theta_offset=np.radians([0.0, 90, 90, 90, 180, 90]),
    lower=np.radians([-154.0, -150, -150, -149, -145, -149]),
    upper=np.radians([154.0, 150, 150, 149, 145, 149]),
    R_B0=np.eye(3),
)
"""Kinova Gen3 Lite, 6 joints (Tables A.1, A.2).

The last offset, 0.235 m, includes a tool of 0.130 m along the vendor's end-effector z axis.
"""


def joint_frames(chain: DHChain, q: ArrayLike) -> tuple[Array, Array]:
    """Rotation and offset of every joint, thesis (5.1) and (5.2).

    Args:
        chain: the arm.
        q: joint angles ``[..., n]`` in radians.

    Returns:
        Q_i ``[..., n, 3, 3]`` and k_i ``[..., n, 3]`` in metres.

    Raises:
        ModelError: if the last dimension is not the arm's number of joints, or an angle is not a
            finite number.
    """
    q = finite_array(q, (), "joint angles")
    if q.ndim == 0 or q.shape[-1] != chain.n_joints:
        raise ModelError(
            f"joint angles have shape {list(q.shape)}; {chain.name} wants [..., {chain.n_joints}]"
        )
    theta = q + chain.theta_offset
    sin, cos = np.sin(theta), np.cos(theta)
    sin_alpha = np.broadcast_to(np.sin(chain.alpha), theta.shape)
    cos_alpha = np.broadcast_to(np.cos(chain.alpha), theta.shape)
    rows = [
        [cos, -cos_alpha * sin, sin_alpha * sin],
        [sin, cos_alpha * cos, -sin_alpha * cos],
        [np.zeros_like(sin), sin_alpha, cos_alpha],
    ]
    rotations = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    b = np.broadcast_to(chain.b, theta.shape)
    return rotations, np.stack([chain.a * cos, chain.a * sin, b], axis=-1)


def forward_kinematics(chain: DHChain, q: ArrayLike) -> tuple[Array, Array]:
    """Tool pose in the vendor's base frame B, thesis (5.3) and (5.4).

    With p = Σ_i (Π_{j<i} Q_j) k_i: (5.3) prints a sum where the product with k_i is meant.

    Args:
        chain: the arm.
        q: joint angles ``[..., n]`` in radians.

    Returns:
        R_BE ``[..., 3, 3]`` and p_BE ``[..., 3]`` in metres, E the tool frame.

    Raises:
        ModelError: if the last dimension is not the arm's number of joints, or an angle is not a
            finite number.
    """
    rotations, offsets = joint_frames(chain, q)
    R_BE = np.broadcast_to(chain.R_B0, (*rotations.shape[:-3], 3, 3))
    p_BE = np.zeros((*offsets.shape[:-2], 3))
    for i in range(chain.n_joints):
        p_BE = p_BE + np.einsum("...ij,...j->...i", R_BE, offsets[..., i, :])
        R_BE = R_BE @ rotations[..., i, :, :]
    return R_BE, p_BE
