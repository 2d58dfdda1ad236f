"""Joint limits: what may be planned to, and what may be left.

A posture at a limit is within it: what is computed there misses it by a rounding. A robot that
stands beyond a limit, pushed there or badly measured, may come back: no waypoint of its path may
be further beyond than the one before, and the last is within.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from pydrake.multibody.plant import MultibodyPlant

from models.arrays import Array
from models.errors import ModelError
from models.scenes.parsing import add_models

ROUNDING = 1e-9
"""Distance beyond a limit that counts as none [rad]."""
LARGEST = 1e6
"""Largest angle of an endless joint [rad]: floats fix it to 1e-10."""

_ARMS = {6: "gen3_lite.urdf", 7: "gen3.urdf"}


@dataclass(frozen=True)
class JointLimits:
    """Where the joints of an arm may be.

    Attributes:
        names: of the joints ``[n]``.
        lower: ``[n]`` [rad], −∞ for an endless joint.
        upper: ``[n]`` [rad].
    """

    names: tuple[str, ...]
    lower: Array
    upper: Array

    def beyond(self, q: Array) -> Array:
        """By how much ``q [..., n]`` is beyond the limits, 0 within them ``[..., n]`` [rad]."""
        lower, upper = np.maximum(self.lower, -LARGEST), np.minimum(self.upper, LARGEST)
        excess = np.maximum(np.maximum(lower - q, q - upper), 0.0)
        return np.where(excess > ROUNDING, excess, 0.0)

    def require(self, q: Array, name: str, since: Array | None = None) -> None:
        """Refuse a posture beyond the limits.

        Args:
            q: ``[n]`` [rad].
            name: what messages call it.
            since: the posture before ``[n]`` [rad]: one no further beyond than that is on its way
                back. None allows nothing beyond.

        Raises:
            ModelError: that names the joint, its angle and its limits.
        """
        excess = self.beyond(q)
        if since is not None and excess.any():
            excess = np.where(excess > self.beyond(since) + ROUNDING, excess, 0.0)
        if excess.any():
            i = int(excess.argmax())
            lower, upper = max(self.lower[i], -LARGEST), min(self.upper[i], LARGEST)
            raise ModelError(
                f"{name}: {self.names[i]} at {q[i]:.6g} rad; valid: {lower:.6g} to {upper:.6g} rad"
            )

    def require_path(self, waypoints: Array) -> None:
        """Refuse a path that goes beyond the limits; one that begins there may come back.

        Args:
            waypoints: ``[m, n]`` [rad].

        Raises:
            ModelError: that names the waypoint, the joint, its angle and its limits.
        """
        last = len(waypoints) - 1
        for i in np.flatnonzero(self.beyond(waypoints).any(axis=1)).tolist():
            before = waypoints[max(i - 1, 0)] if i < last else None
            self.require(waypoints[i], f"waypoints[{i}]", since=before)


@cache
def arm_limits(n_joints: int) -> JointLimits | None:
    """Limits of the arm here with so many joints, 6 or 7; None if there is none."""
    if n_joints not in _ARMS:
        return None
    plant = MultibodyPlant(time_step=0.0)
    add_models(plant, _ARMS[n_joints])
    plant.Finalize()
    names = tuple(f"joint_{i}" for i in range(1, n_joints + 1))
    joints = [plant.GetJointByName(name) for name in names]
    lower = np.array([joint.position_lower_limits()[0] for joint in joints])
    upper = np.array([joint.position_upper_limits()[0] for joint in joints])
    return JointLimits(names, lower, upper)
