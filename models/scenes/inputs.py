"""Poses from users, looked at before Drake computes with them."""

import numpy as np
from pydrake.math import RigidTransform

from models.errors import ModelError


def finite_pose(X: RigidTransform, name: str) -> RigidTransform:
    """Give a pose back.

    Args:
        X: what a user handed in.
        name: what messages call it.

    Raises:
        ModelError: if it is no RigidTransform, or a number in it is not finite.
    """
    if not isinstance(X, RigidTransform):
        raise ModelError(f"{name}: {type(X).__name__}; valid: a pydrake.math.RigidTransform")
    if not np.isfinite(X.GetAsMatrix34()).all():
        raise ModelError(f"{name} holds a value that is not finite; wanted finite numbers only")
    return X
