"""Where the cube is, for plans: flat on the table, or in the hand."""

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from models.motion.failures import ActionFailure, Infeasible
from models.rotations import rotation_vector_to_matrix
from models.task.spaces import REST_HEIGHT

HELD_WITHIN = 0.05
"""A cube that is measured further from the tool centre point is not in the hand [m]."""


def lying(X_WO: RigidTransform) -> RigidTransform:
    """Pose of a cube on the table, of which height and tilt were not measured well.

    It lies on the face that was nearest to being down, at the height of one at rest.
    """
    R = X_WO.rotation().matrix()
    face = int(np.abs(R[2]).argmax())
    up = np.copysign(1.0, R[2, face]) * R[:, face]
    axis = np.cross(up, [0.0, 0.0, 1.0])
    sine = float(np.linalg.norm(axis))
    turn = rotation_vector_to_matrix(np.arctan2(sine, up[2]) / max(sine, 1e-12) * axis)
    x, y, _ = X_WO.translation()
    return RigidTransform(RotationMatrix(turn @ R), [x, y, REST_HEIGHT])


def in_hand(X_WG: RigidTransform, X_WO: RigidTransform) -> RigidTransform:
    """X_GO of a cube at X_WO in the hand at X_WG.

    Raises:
        Infeasible: if it is `HELD_WITHIN` from there or further.
    """
    X_GO = X_WG.InvertAndCompose(X_WO)
    distance = float(np.linalg.norm(X_GO.translation()))
    if distance >= HELD_WITHIN:
        raise Infeasible(
            ActionFailure.GRIP_LOST, f"the cube is {1e3 * distance:.0f} mm from the hand"
        )
    return X_GO
