"""Inverse kinematics: joint angles for a gripper pose that keep clear of everything.

The Gen3 has a closed form (`gen3_ik`) with the third joint as redundancy parameter: sweeping it
gives all families of postures, of which the nearest free one is refined. Any other arm, and
constraints of the user's own, go to Drake's optimiser (`optimised_ik`). Both only propose:
forward kinematics, joint limits and the distance query of the `PlanningScene` decide.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from pydrake.math import RigidTransform

from models.gen3 import chain as gen3_chain
from models.gen3 import closed_form as gen3_ik
from models.gen3.branches import wrist_in_reach
from models.gen3.capsules import FURNITURE, SELF, Capsules, capsules_of, verdicts
from models.gen3.newton import BEYOND_LIMITS
from models.inverse_kinematics.optimised import LIMIT_MARGIN, Constrain, follow, search
from models.inverse_kinematics.solution import (
    ANGLE_TOLERANCE,
    POSITION_TOLERANCE,
    Failure,
    IkSolution,
    collision_failure,
    reaches,
)
from models.scenes.description_files import ARM
from models.scenes.planning_scene import HOME, MARGIN, Clearance, PlanningScene

__all__ = [
    "ANGLE_TOLERANCE",
    "LIMIT_MARGIN",
    "POSITION_TOLERANCE",
    "Failure",
    "IkSolution",
    "follow",
    "reaches",
    "search",
    "solve",
    "solve_batch",
]

LIMIT_ZONE = 0.2
"""Distance from a joint limit within which a posture counts as worse [rad]."""
LIMIT_WEIGHT = 1.0
"""By how much worse at the limit itself [rad]; it falls off quadratically through the zone."""

# Half the width of a sweep of q3 about the seed's, and its values. No answer beyond the first is
# nearer than its width; the last is for poses of which the second leaves none free.
_SWEEPS = ((0.3, 13), (np.pi, 65), (np.pi, 257))
_ROUNDS, _SHRINK = 3, 4  # of the search about the best, each in an interval so much smaller
_BLOCK = 16  # postures that the capsules sort out at a time
_QUERIES = 60  # exact distance queries in one sweep before it is given up


def solve(
    scene: PlanningScene,
    X_WG: RigidTransform,
    *,
    seed: np.ndarray = HOME,
    margin: float = MARGIN,
    attempts: int = 20,
    rng: np.random.Generator | None = None,
    constrain: Constrain | None = None,
) -> IkSolution:
    """Find the joint angles nearest to ``seed`` that reach ``X_WG`` clear of everything.

    Endless joints are wound to within half a turn of ``seed``. *Nearest* is by `posture_cost`:
    the distance in joint space, and a penalty near the limits.

    Args:
        scene: the robot and what to keep clear of.
        X_WG: wanted pose of the tool centre point.
        seed: ``[7]`` [rad].
        margin: smallest allowed distance [m].
        attempts: starting points of the optimiser, where the closed form does not apply.
        rng: source of the optimiser's starting points; None draws the same ones every time.
        constrain: adds constraints to the optimisation, which is used then for any arm.

    Returns:
        The answer, or the reason why there is none.
    """
    arm = closed_form(scene) if constrain is None else None
    if arm is not None:
        return arm.solve(scene, X_WG, np.asarray(seed, dtype=float), margin)
    return search(
        scene,
        X_WG,
        seed=seed,
        margin=margin,
        attempts=attempts,
        candidates=1,
        rng=rng or np.random.default_rng(0),
        constrain=constrain,
    )[0]


def solve_batch(
    scene: PlanningScene,
    poses: Iterable[RigidTransform],
    *,
    seed: np.ndarray = HOME,
    margin: float = MARGIN,
) -> list[IkSolution]:
    """`solve` for many poses, each from the same ``seed``."""
    return [solve(scene, X_WG, seed=seed, margin=margin) for X_WG in poses]


def posture_cost(scene: PlanningScene, q: np.ndarray, seed: np.ndarray) -> np.ndarray:
    """How far postures ``q [..., 7]`` are from ``seed``, and how near to their limits [rad]."""
    room = np.minimum(q - scene.lower, scene.upper - q)
    short = np.clip(1.0 - room / LIMIT_ZONE, 0.0, None)
    return np.linalg.norm(q - seed, axis=-1) + LIMIT_WEIGHT * (short**2).sum(axis=-1)


@dataclass(frozen=True)
class ClosedForm:
    """The Gen3's closed form in a scene.

    Attributes:
        X_BW: the world in the arm's base.
        X_GE: the end effector in the gripper frame.
        capsules: what collides for certain; neither fingers nor cube matter to that.
    """

    X_BW: RigidTransform
    X_GE: RigidTransform
    capsules: Capsules

    def end_effector(self, X_WG: RigidTransform) -> tuple[np.ndarray, np.ndarray]:
        """R_BE ``[3, 3]`` and p_BE ``[3]`` [m] of a pose of the tool centre point."""
        X_BE = self.X_BW @ X_WG @ self.X_GE
        return X_BE.rotation().matrix(), X_BE.translation()

    def solve(
        self, scene: PlanningScene, X_WG: RigidTransform, seed: np.ndarray, margin: float
    ) -> IkSolution:
        """`solve` by sweeping q3 from ``seed`` all around, then about the best answer."""
        R, p = self.end_effector(X_WG)
        if not wrist_in_reach(R, p):
            return IkSolution(None, None, Failure.OUT_OF_REACH, 0)
        best: Clearance | None = None
        for width, count in _SWEEPS:
            grid = seed[2] + np.linspace(-width, width, count)
            q, best, blocked = self._first_free(scene, R, p, X_WG, grid, seed, margin, np.inf)
            if blocked:
                return IkSolution(None, best, Failure.BLOCKED, count)
            if q is not None and (width == np.pi or posture_cost(scene, q, seed) <= width):
                step = 2.0 * width / (count - 1)
                q = self._refined(scene, R, p, X_WG, q, step, seed, margin)
                return IkSolution(q, scene.clearance(q, max(0.05, 2.0 * margin)), None, count)
        if best is not None:
            return IkSolution(None, best, collision_failure(best), count)
        met = gen3_ik.solve_first(R[None], p[None], grid)[1][0]
        failure = Failure.JOINT_LIMIT if met == BEYOND_LIMITS else Failure.NOT_FOUND
        return IkSolution(None, None, failure, count)

    def _refined(
        self,
        scene: PlanningScene,
        R: np.ndarray,
        p: np.ndarray,
        X_WG: RigidTransform,
        q: np.ndarray,
        width: float,
        seed: np.ndarray,
        margin: float,
    ) -> np.ndarray:
        """Lower the cost of an answer by finer and finer sweeps about its q3."""
        for _ in range(_ROUNDS):
            grid = q[2] + width * np.linspace(-1.0, 1.0, 2 * _SHRINK + 1)
            cost = float(posture_cost(scene, q, seed))
            better, _, _ = self._first_free(scene, R, p, X_WG, grid, seed, margin, cost - 1e-9)
            q = q if better is None else better
            width /= _SHRINK
        return q

    def _first_free(
        self,
        scene: PlanningScene,
        R: np.ndarray,
        p: np.ndarray,
        X_WG: RigidTransform,
        q3: np.ndarray,
        seed: np.ndarray,
        margin: float,
        below: float,
    ) -> tuple[np.ndarray | None, Clearance | None, bool]:
        """The cheapest free answer for any of ``q3``, if it costs less than ``below``.

        Returns:
            The answer; else None, the largest clearance of those refused, and whether the hand
            itself is in the way, so that there cannot be any.
        """
        q = gen3_ik.solve_batch(R[None], p[None], q3).reshape(-1, 7)
        q = scene.wind(q[~np.isnan(q[:, 0])], seed)
        cost = posture_cost(scene, q, seed)
        order = np.argsort(cost, kind="stable")
        order = order[cost[order] < below]
        best: Clearance | None = None
        queries = 0
        for block in (order[i : i + _BLOCK] for i in range(0, len(order), _BLOCK)):
            judged = verdicts(self.capsules, q[block], margin)
            for i, verdict in zip(block, judged, strict=True):
                # The first is looked at in any case, for the hand's sake and for the report's.
                if (verdict in (SELF, FURNITURE) and queries) or queries == _QUERIES:
                    continue
                if not reaches(scene, q[i], X_WG):
                    continue
                queries += 1
                clearance = scene.clearance(q[i], margin + 1e-3)
                if clearance.distance > margin:
                    return q[i], None, False
                if best is None and scene.hand_is_blocked(q[i], margin):
                    return None, clearance, True
                if best is None or clearance.distance > best.distance:
                    best = clearance
        return None, best, False


_KNOWN: "WeakKeyDictionary[PlanningScene, ClosedForm | None]" = WeakKeyDictionary()


def closed_form(scene: PlanningScene) -> ClosedForm | None:
    """The closed form in a scene, None if its arm is not the Gen3."""
    if scene not in _KNOWN:
        _KNOWN[scene] = _recognise(scene)
    return _KNOWN[scene]


def _recognise(scene: PlanningScene) -> ClosedForm | None:
    if not (
        np.array_equal(scene.upper, gen3_chain.LIMIT) and np.array_equal(-scene.lower, scene.upper)
    ):
        return None
    plant, context = scene.plant, scene.context
    arm = plant.GetModelInstanceByName(ARM)
    base, hand = (plant.GetBodyByName(name, arm) for name in ("base_link", "end_effector_link"))
    X_WB, X_WE = (body.EvalPoseInWorld(context) for body in (base, hand))
    X_GE = plant.GetFrameByName("tcp").CalcPoseInWorld(context).InvertAndCompose(X_WE)
    known = ClosedForm(X_WB.inverse(), X_GE, capsules_of(scene))
    R, p = known.end_effector(scene.forward(HOME))
    R_closed, p_closed = gen3_chain.forward(HOME)
    same = np.allclose(R, R_closed, atol=1e-9) and np.allclose(p, p_closed, atol=1e-9)
    return known if same else None
