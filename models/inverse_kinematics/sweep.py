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
from models.gen3.capsules import Capsules, capsules_of
from models.gen3.nearest import Question, may_be_within, next_possible, polished, ranked, refined
from models.gen3.newton import BEYOND_LIMITS
from models.inverse_kinematics.arm_frames import ArmFrames
from models.inverse_kinematics.solution import (
    Failure,
    IkSolution,
    collision_failure,
    posture_cost,
    reaches,
)
from models.scenes.planning_scene import Clearance, PlanningScene

# Half the width of a sweep of q3 about the seed's, and its values. No answer beyond the first is
# nearer than its width; the last is for poses of which the second leaves none free.
_SWEEPS = ((0.3, 13), (np.pi, 65), (np.pi, 257))
_ROUNDS, _SHRINK = 3, 4  # of the search about the best, each in an interval so much smaller
_QUERIES = 60  # exact distance queries in one sweep of what the capsules do not find free


@dataclass(frozen=True)
class Sweep:
    """The Gen3's closed form in a scene.

    Attributes:
        scene: the robot and what to keep clear of.
        frames: what the arm's own chain has to do with the scene.
        capsules: what collides for certain; neither fingers nor cube matter to that.
    """

    scene: PlanningScene
    frames: ArmFrames
    capsules: Capsules

    @classmethod
    def of(cls, scene: PlanningScene) -> "Sweep | None":
        """The closed form in a scene, None if its arm is not the Gen3."""
        frames = ArmFrames.of(scene, chain.LIMIT, chain.forward)
        return None if frames is None else cls(scene, frames, capsules_of(scene))

    def end_effector(self, X_WG: RigidTransform) -> tuple[np.ndarray, np.ndarray]:
        """R_BE ``[3, 3]`` and p_BE ``[3]`` [m] of a pose of the tool centre point."""
        return self.frames.end_effector(X_WG)

    def may_reach(self, X_WG: RigidTransform) -> bool:
        """Whether the wrist's distance leaves any hope for a pose; False proves none."""
        return bool(wrist_in_reach(*self.end_effector(X_WG)))

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
        question = Question(R, p, seed, margin)
        best: Clearance | None = None
        for width, count in _SWEEPS:
            below = np.inf if width == np.pi else width
            if not may_be_within(question, below):
                continue
            q = ranked(question, seed[2] + np.linspace(-width, width, count), below)
            answer, best, blocked = self._nearest(X_WG, question, q, 2.0 * width / (count - 1))
            if answer is not None or blocked:
                failure = Failure.BLOCKED if blocked else None
                return IkSolution(answer, best, failure, count)
        if best is not None:
            return IkSolution(None, best, collision_failure(self.scene, best), count)
        q3 = seed[2] + np.linspace(-width, width, count)
        met = closed_form.solve_first(R[None], p[None], q3)[1][0]
        failure = Failure.JOINT_LIMIT if met == BEYOND_LIMITS else Failure.NOT_FOUND
        return IkSolution(None, None, failure, count)

    def _nearest(
        self, X_WG: RigidTransform, question: Question, q: np.ndarray, width: float
    ) -> tuple[np.ndarray | None, Clearance | None, bool]:
        """The answer nearest to the cheapest of ``q [k, 7]``, q3 up to ``width`` [rad] away.

        Returns:
            The answer and its clearance; else None, the largest clearance of those refused, and
            whether the hand itself is in the way, so that there cannot be any.
        """
        place, _ = next_possible(q, 0, self.capsules, question.margin)
        if place < len(q):
            # On trust, first: mostly there is but this one to ask the exact query about.
            found = refined(question, q[place], width, self.capsules, _ROUNDS, _SHRINK)
            found = polished(question, found)
            clearance = self._clearance(X_WG, question, found)
            if clearance is not None:
                return found, clearance, False
        answer, best, blocked = self._first_free(X_WG, question, q)
        if answer is None:
            return None, best, blocked
        for _ in range(_ROUNDS):
            grid = answer[2] + width * np.linspace(-1.0, 1.0, 2 * _SHRINK + 1)
            cost = float(posture_cost(self.scene, answer, question.seed))
            better, _, _ = self._first_free(X_WG, question, ranked(question, grid, cost - 1e-9))
            answer = answer if better is None else better
            width /= _SHRINK
        return answer, self._clearance(X_WG, question, answer), False

    def _clearance(
        self, X_WG: RigidTransform, question: Question, q: np.ndarray
    ) -> Clearance | None:
        """The clearance of an answer, None if it is none."""
        if not reaches(self.scene, q, X_WG):
            return None
        clearance = self.scene.clearance(q, max(0.05, 2.0 * question.margin))
        return clearance if clearance.distance > question.margin else None

    def _first_free(
        self, X_WG: RigidTransform, question: Question, q: np.ndarray
    ) -> tuple[np.ndarray | None, Clearance | None, bool]:
        """The first of ``q [k, 7]`` that the exact query finds free.

        Returns:
            The answer; else None, the largest clearance of those refused, and whether the hand
            itself is in the way, so that there cannot be any.
        """
        scene, margin = self.scene, question.margin
        best: Clearance | None = None
        # The first is looked at in any case, for the hand's sake and for the report's.
        place, doubts, is_doubtful = 0, 0, True
        while place < len(q):
            if doubts < _QUERIES or not is_doubtful:
                answer = polished(question, q[place])
                if reaches(scene, answer, X_WG):
                    doubts += is_doubtful
                    clearance = scene.clearance(answer, margin + 1e-3)
                    if clearance.distance > margin:
                        return answer, None, False
                    if best is None and scene.hand_is_blocked(answer, margin):
                        return None, clearance, True
                    if best is None or clearance.distance > best.distance:
                        best = clearance
            place, is_free = next_possible(q, place + 1, self.capsules, margin)
            is_doubtful = not is_free
        return None, best, False
