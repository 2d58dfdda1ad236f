"""Joint angles for one gripper pose, judged as the task demands.

A pose in the cells' layers or above is judged with the cube in the hand; a lower one with
open fingers, and again with the fingers closed on a cube.
"""

from dataclasses import dataclass

import numpy as np

from models.inverse_kinematics.optimised import Starts, search
from models.inverse_kinematics.solution import Failure, IkSolution, reaches
from models.inverse_kinematics.sweep import Sweep
from models.maps.gripper_poses import Layer, gripper_pose, pose_key
from models.scenes.gripper import MAX_OPENING
from models.scenes.planning_scene import HOME, MARGIN, Clearance, PlanningScene
from models.task.spaces import CUBE_EDGE, GRID_Z, R_WG

CLOSED_MARGIN = 0.001
"""Smallest distance allowed with the fingers closed on a cube on the table [m].

A vertical hand at the cube's centre leaves 1.2 mm between the ends of its pads and the table.
"""
CANDIDATES = 12
"""Answers to choose from where a neighbour's posture does not serve."""
ATTEMPTS = 30
"""Starting points for them."""


@dataclass(frozen=True)
class Entry:
    """One pose and what is known of it.

    Attributes:
        layer: what the pose is for.
        p_WG: position ``[3]`` of the tool centre point in the world [m].
        gripper: gripper orientation 0…17.
        q: joint angles ``[7]`` [rad], None if none were found.
        clearance: smallest distance at ``q``, or of the best rejected candidate; None if the
            pose itself was never met.
        failure: why there is no ``q``; None if there is.
        attempts: starting points tried; 0 if only joint 7 of another answer was turned.
    """

    layer: Layer
    p_WG: np.ndarray
    gripper: int
    q: np.ndarray | None
    clearance: Clearance | None
    failure: Failure | None
    attempts: int

    @property
    def value(self) -> int:
        """1 if the pose is reachable, else 0, as in the thesis' table."""
        return int(self.q is not None)


class PoseSolver:
    """Inverse kinematics of single poses; every pose has its own stream of random numbers."""

    def __init__(self, seed: int = 0) -> None:
        """Build both scenes.

        Args:
            seed: of the random starting points.
        """
        self.seed = seed
        self._empty, self._carrying = PlanningScene(), PlanningScene(carrying=True)
        self._arm = Sweep.of(self._empty)

    def near(self, layer: Layer, p_WG: np.ndarray, gripper: int, q: np.ndarray) -> Entry:
        """Solve a pose from the posture ``q [7]`` alone; the fast way where it is close."""
        answers = search(self._scene(p_WG), gripper_pose(p_WG, gripper), Starts(q))
        return self._judge(layer, p_WG, gripper, answers[0])

    def alone(
        self, layer: Layer, p_WG: np.ndarray, gripper: int, q: np.ndarray = HOME
    ) -> list[Entry]:
        """Solve a pose from random postures about ``q [7]``: the nearest answer first.

        Returns:
            Up to `CANDIDATES` different answers, or one entry that says why there is none.
        """
        if self._arm is not None and not self._arm.may_reach(gripper_pose(p_WG, gripper)):
            return [Entry(layer, p_WG, gripper, None, None, Failure.OUT_OF_REACH, 0)]
        stream = np.random.default_rng([self.seed, *np.abs(pose_key(p_WG, gripper))])
        answers = search(
            self._scene(p_WG),
            gripper_pose(p_WG, gripper),
            Starts(q, ATTEMPTS, stream),
            candidates=CANDIDATES,
        )
        return [self._judge(layer, p_WG, gripper, answer) for answer in answers]

    def turned(self, known: Entry, gripper: int) -> Entry | None:
        """Reach another orientation with the same approach by joint 7 alone (thesis 5.5).

        Returns:
            The entry, or None if the approach differs or a distance falls short.
        """
        R = R_WG[known.gripper].T @ R_WG[gripper]
        if known.q is None or R[2, 2] < 1.0 - 1e-9:
            return None
        # Joint 7 turns about -G_z.
        q = known.q - np.eye(7)[6] * np.arctan2(R[1, 0], R[0, 0])
        scene = self._scene(known.p_WG)
        if not reaches(scene, q, gripper_pose(known.p_WG, gripper)):
            return None
        answer = IkSolution(q, scene.clearance(q), None, 0)
        entry = self._judge(known.layer, known.p_WG, gripper, answer)
        return entry if entry.value else None

    def _judge(self, layer: Layer, p_WG: np.ndarray, gripper: int, answer: IkSolution) -> Entry:
        """Wind an answer towards `HOME` and compare it with the margins."""
        q, clearance, failure = answer.q, answer.clearance, answer.failure
        if q is not None and clearance is not None:
            q = self._scene(p_WG).wind(q, HOME)
            enough = clearance.distance > MARGIN
            if not _is_carried(p_WG):
                self._empty.open_to(CUBE_EDGE)
                closed = self._empty.clearance(q)
                self._empty.open_to(MAX_OPENING)
                enough = enough and closed.distance > CLOSED_MARGIN
                clearance = min(clearance, closed, key=lambda c: c.distance)
            if not enough:
                q, failure = None, Failure.COLLISION
        return Entry(layer, p_WG, gripper, q, clearance, failure, answer.attempts)

    def _scene(self, p_WG: np.ndarray) -> PlanningScene:
        return self._carrying if _is_carried(p_WG) else self._empty


def _is_carried(p_WG: np.ndarray) -> bool:
    """Whether a hand at ``p_WG`` would hold a cube up: from the lower layer of cells upwards."""
    return bool(p_WG[2] > GRID_Z[0] - 1e-4)
