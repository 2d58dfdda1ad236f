"""Inverse kinematics: joint angles for a gripper pose that keep clear of everything.

The Gen3 has a closed form with the third joint as redundancy parameter: sweeping it gives all
families of postures, of which the nearest free one is refined (`sweep`). The Gen3 Lite has a
polynomial that gives all its postures (`roots`). Any other arm, and constraints of the user's own,
go to Drake's optimiser (`optimised`). All of them only propose: forward kinematics, joint limits
and the distance query of the `PlanningScene` decide.
"""

import numpy as np
from pydrake.math import RigidTransform

from models.arrays import finite_number
from models.errors import ModelError
from models.inverse_kinematics.optimised import Constrain, Starts, search
from models.inverse_kinematics.roots import Roots
from models.inverse_kinematics.solution import IkSolution
from models.inverse_kinematics.sweep import Sweep
from models.scenes.inputs import finite_pose
from models.scenes.planning_scene import MARGIN, PlanningScene

ATTEMPTS = 20
"""Starting points of the optimiser, where nothing else is said."""


class IkSolver:
    """Inverse kinematics in one scene, whose arm is measured once.

    The fingers may open and the cube may move between two questions: the scene is asked as it is.

    Attributes:
        scene: the robot and what to keep clear of.
        attempts: starting points of the optimiser, where the closed form does not apply.
        closed_form: the arm's own in this scene, None if it has none here.
    """

    def __init__(self, scene: PlanningScene, attempts: int = ATTEMPTS) -> None:
        """Measure the arm of ``scene``.

        Raises:
            ModelError: if ``scene`` is none, or ``attempts`` not at least 1.
        """
        if not isinstance(scene, PlanningScene):
            raise ModelError(f"scene: {type(scene).__name__}; valid: a PlanningScene")
        if not isinstance(attempts, (int, np.integer)) or attempts < 1:
            raise ModelError(f"attempts: {attempts!r}; valid: whole numbers from 1 on")
        self.scene, self.attempts = scene, attempts
        self.closed_form: Sweep | Roots | None = Sweep.of(scene) or Roots.of(scene)

    def solve(
        self,
        X_WG: RigidTransform,
        *,
        seed: np.ndarray | None = None,
        margin: float = MARGIN,
        rng: np.random.Generator | None = None,
        constrain: Constrain | None = None,
    ) -> IkSolution:
        """Find the joint angles nearest to ``seed`` that reach ``X_WG`` clear of everything.

        Endless joints are wound to within half a turn of ``seed``. *Nearest* is by
        `models.inverse_kinematics.solution.posture_cost`: the distance in joint space, and a
        penalty near the limits.

        Args:
            X_WG: wanted pose of the tool centre point.
            seed: one angle a joint [rad]; None is the robot's home posture.
            margin: smallest allowed distance [m].
            rng: source of the optimiser's starting points; None draws the same ones every time.
            constrain: adds constraints to the optimisation, which is used then for any arm.

        Returns:
            The answer, or the reason why there is none.

        Raises:
            ModelError: if the pose is none, the seed not so many finite angles, or the margin not
                a finite number.
        """
        X_WG = finite_pose(X_WG, "X_WG")
        seed = self.scene.require_posture(self.scene.robot.home if seed is None else seed, "seed")
        margin = finite_number(margin, "margin", valid="metres")
        if self.closed_form is not None and constrain is None:
            return self.closed_form.solve(X_WG, seed, margin)
        starts = Starts(seed, self.attempts, rng or np.random.default_rng(0))
        return search(self.scene, X_WG, starts, margin=margin, constrain=constrain)[0]


def solve(
    scene: PlanningScene,
    X_WG: RigidTransform,
    *,
    seed: np.ndarray | None = None,
    margin: float = MARGIN,
    attempts: int = ATTEMPTS,
    rng: np.random.Generator | None = None,
    constrain: Constrain | None = None,
) -> IkSolution:
    """Answer one question: `IkSolver.solve` of a solver made for it.

    The arguments are those of the solver and of its method. Measuring the scene's arm takes a few
    milliseconds, so whoever asks often keeps an `IkSolver`.
    """
    solver = IkSolver(scene, attempts)
    return solver.solve(X_WG, seed=seed, margin=margin, rng=rng, constrain=constrain)
