"""Postures of other families for one pose of the hand, where the first leads nowhere."""

from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

import numpy as np
from pydrake.math import RigidTransform

from models.inverse_kinematics.solver import IkSolver
from models.motion.failures import Infeasible

APART = 0.1
"""Postures that differ by more in a joint are two [rad]."""
_TURNED, _SWUNG = np.array([0, 0, 0, 0, np.pi, 0, np.pi]), np.array([0, 0, 1, 0, 0, 0, 0])

Plan = TypeVar("Plan")


def families(X_WG: RigidTransform, q: np.ndarray, solver: IkSolver) -> list[np.ndarray]:
    """Other postures ``[7]`` [rad] of the Gen3 for a pose, besides ``q [7]``, at most four.

    They are looked for about ``q`` itself, with the wrist turned over, and with the elbow swung to
    either side.
    """
    over = q * np.array([1, 1, 1, 1, 1, -1, 1]) + _TURNED
    known = [q]
    for seed in (q, over, q + _SWUNG, q - _SWUNG):
        found = solver.solve(X_WG, seed=seed).q
        if found is not None and all(np.abs(found - each).max() > APART for each in known):
            known.append(found)
    return known[1:]


def first_that_works(
    plan: Callable[[np.ndarray], Plan], q: np.ndarray, others: Callable[[], list[np.ndarray]]
) -> Plan:
    """What is planned with the first posture that leads anywhere, from ``q [7]`` on.

    Raises:
        Infeasible: what is the matter with ``q`` itself, if no posture does.
    """
    try:
        return plan(q)
    except Infeasible as reason:
        for other in others():
            with suppress(Infeasible):
                return plan(other)
        raise reason from None
