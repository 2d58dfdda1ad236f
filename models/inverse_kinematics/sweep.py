"""The Gen3's answer nearest to a posture: its closed form, swept over the third joint.

For each value of the third joint the closed form gives every posture that meets a pose. Capsules
sort out those that collide for certain; the others are put to the `PlanningScene`, the cheapest
first, until one is free.
"""

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from models.gen3 import chain, closed_form
from models.gen3.branches import wrist_in_reach
from models.gen3.capsules import FURNITURE, SELF, Capsules, capsules_of, verdicts
from models.gen3.newton import BEYOND_LIMITS
from models.inverse_kinematics.solution import Failure, IkSolution, collision_failure, reaches
from models.scenes.parsing import ARM
from models.scenes.planning_scene import HOME, Clearance, PlanningScene

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


def posture_cost(scene: PlanningScene, q: np.ndarray, seed: np.ndarray) -> np.ndarray:
    """How far postures ``q [..., 7]`` are from ``seed``, and how near to their limits [rad]."""
    room = np.minimum(q - scene.lower, scene.upper - q)
    short = np.clip(1.0 - room / LIMIT_ZONE, 0.0, None)
    return np.linalg.norm(q - seed, axis=-1) + LIMIT_WEIGHT * (short**2).sum(axis=-1)


@dataclass(frozen=True)
class _Question:
    """A pose, as both the scene and the closed form take it, and what an answer is measured by."""

    X_WG: RigidTransform
    R_BE: np.ndarray
    p_BE: np.ndarray
    seed: np.ndarray
    margin: float

    def branches(self, q3: np.ndarray) -> np.ndarray:
        """Every posture ``[k, 7]`` that meets the pose with any of ``q3``."""
        q = closed_form.solve_batch(self.R_BE[None], self.p_BE[None], q3).reshape(-1, 7)
        return q[~np.isnan(q[:, 0])]


@dataclass(frozen=True)
class Sweep:
    """The Gen3's closed form in a scene.

    Attributes:
        scene: the robot and what to keep clear of.
        X_BW: the world in the arm's base.
        X_GE: the end effector in the gripper frame.
        capsules: what collides for certain; neither fingers nor cube matter to that.
    """

    scene: PlanningScene
    X_BW: RigidTransform
    X_GE: RigidTransform
    capsules: Capsules

    @classmethod
    def of(cls, scene: PlanningScene) -> "Sweep | None":
        """The closed form in a scene, None if its arm is not the Gen3."""
        if not np.array_equal(scene.upper, chain.LIMIT):
            return None
        if not np.array_equal(-scene.lower, scene.upper):
            return None
        # From one posture, so that roundings do not depend on what the scene was asked before.
        scene.forward(np.zeros(7))
        plant, context = scene.plant, scene.context
        arm = plant.GetModelInstanceByName(ARM)
        base, hand = (plant.GetBodyByName(name, arm) for name in ("base_link", "end_effector_link"))
        X_WB, X_WE = (body.EvalPoseInWorld(context) for body in (base, hand))
        X_GE = plant.GetFrameByName("tcp").CalcPoseInWorld(context).InvertAndCompose(X_WE)
        found = cls(scene, X_WB.inverse(), X_GE, capsules_of(scene))
        R, p = found.end_effector(scene.forward(HOME))
        R_exact, p_exact = chain.forward(HOME)
        same = np.allclose(R, R_exact, atol=1e-9) and np.allclose(p, p_exact, atol=1e-9)
        return found if same else None

    def end_effector(self, X_WG: RigidTransform) -> tuple[np.ndarray, np.ndarray]:
        """R_BE ``[3, 3]`` and p_BE ``[3]`` [m] of a pose of the tool centre point."""
        X_BE = self.X_BW @ X_WG @ self.X_GE
        return X_BE.rotation().matrix(), X_BE.translation()

    def solve(self, X_WG: RigidTransform, seed: np.ndarray, margin: float) -> IkSolution:
        """Sweep q3 from ``seed [7]`` [rad] all around, then about the best answer.

        Args:
            X_WG: wanted pose of the tool centre point.
            seed: what the answer is to be near to, by `posture_cost`.
            margin: smallest allowed distance [m].
        """
        R, p = self.end_effector(X_WG)
        if not wrist_in_reach(R, p):
            return IkSolution(None, None, Failure.OUT_OF_REACH, 0)
        question = _Question(X_WG, R, p, seed, margin)
        best: Clearance | None = None
        for width, count in _SWEEPS:
            grid = seed[2] + np.linspace(-width, width, count)
            q, best, blocked = self._first_free(question, grid, np.inf)
            if blocked:
                return IkSolution(None, best, Failure.BLOCKED, count)
            if q is not None and (width == np.pi or posture_cost(self.scene, q, seed) <= width):
                q = self._refined(question, q, 2.0 * width / (count - 1))
                clearance = self.scene.clearance(q, max(0.05, 2.0 * margin))
                return IkSolution(q, clearance, None, count)
        if best is not None:
            return IkSolution(None, best, collision_failure(best), count)
        met = closed_form.solve_first(R[None], p[None], grid)[1][0]
        failure = Failure.JOINT_LIMIT if met == BEYOND_LIMITS else Failure.NOT_FOUND
        return IkSolution(None, None, failure, count)

    def _refined(self, question: _Question, q: np.ndarray, width: float) -> np.ndarray:
        """Lower the cost of an answer by finer and finer sweeps about its q3."""
        for _ in range(_ROUNDS):
            grid = q[2] + width * np.linspace(-1.0, 1.0, 2 * _SHRINK + 1)
            cost = float(posture_cost(self.scene, q, question.seed))
            better, _, _ = self._first_free(question, grid, cost - 1e-9)
            q = q if better is None else better
            width /= _SHRINK
        return q

    def _first_free(
        self, question: _Question, q3: np.ndarray, below: float
    ) -> tuple[np.ndarray | None, Clearance | None, bool]:
        """The cheapest free answer for any of ``q3``, if it costs less than ``below``.

        Returns:
            The answer; else None, the largest clearance of those refused, and whether the hand
            itself is in the way, so that there cannot be any.
        """
        scene, margin = self.scene, question.margin
        q = scene.wind(question.branches(q3), question.seed)
        cost = posture_cost(scene, q, question.seed)
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
                if not reaches(scene, q[i], question.X_WG):
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
