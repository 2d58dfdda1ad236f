"""Kinova's tool frame T of a Gen3 with a 2F-85, and our gripper frame G: there and back.

Both are fixed in the vendor's end-effector frame E, at the flange, z along the approach:

* T, what the arm reports as its tool pose: 120 mm along E's z, not turned (``tool_frame_joint`` in
  ``robotiq_arg2f_85_model_macro.xacro`` of Kinova's ros2_kortex);
* G, the thesis' gripper frame and our ``tcp``: 142.5 mm along E's z, turned by Rz(−90°), so that
  its y is the closing axis (`description/gen3_2f85.dmd.yaml`).

So T lies 22.5 mm behind G; T's x is the closing axis, G's y.
"""

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from models.scenes.gripper import TCP_FROM_FLANGE

TOOL_FROM_FLANGE = 0.120
"""Origin of frame T before the end-effector frame E, along the approach [m]."""

# Rz(−90°), in whole numbers: cosines of π/2 would leave 6e-17.
_R_EG = RotationMatrix(np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
X_EG = RigidTransform(_R_EG, [0.0, 0.0, TCP_FROM_FLANGE])
"""Gripper frame G in the end-effector frame E."""
X_ET = RigidTransform([0.0, 0.0, TOOL_FROM_FLANGE])
"""Tool frame T in the end-effector frame E."""


def gripper_to_tool(X_WG: RigidTransform) -> RigidTransform:
    """Pose X_WT of Kinova's tool frame at a pose X_WG of the gripper; W may be any frame."""
    return X_WG @ X_EG.InvertAndCompose(X_ET)


def tool_to_gripper(X_WT: RigidTransform) -> RigidTransform:
    """Pose X_WG of the gripper at a pose X_WT of Kinova's tool frame; W may be any frame."""
    return X_WT @ X_ET.InvertAndCompose(X_EG)
