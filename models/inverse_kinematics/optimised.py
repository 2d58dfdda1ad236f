"""Inverse kinematics by iteration, for any arm and any constraint that Drake can express.

Newton's method follows the pose from a nearby posture; where that fails, Drake's optimiser
looks further. Both only propose: forward kinematics, joint limits and the distance query of
the `PlanningScene`, evaluated afresh, decide.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.solvers import SnoptSolver, SolverOptions

from models.arrays import finite_number
from models.inverse_kinematics.solution import (
    POSITION_TOLERANCE,
    Failure,
    IkSolution,
    collision_failure,
    reaches,
)
from models.scenes.inputs import finite_pose
from models.scenes.planning_scene import MARGIN, Clearance, PlanningScene

LIMIT_MARGIN = 0.05
"""Distance that answers keep from the joint limits, for the controller's sake [rad]."""

Constrain = Callable[[InverseKinematics], None]
"""Adds constraints of the user's own to an optimisation."""

_DIFFERENT = 0.1  # distance of two answers that count as two [rad]
_ITERATIONS, _STEP, _DAMPING = 30, 0.3, 1e-4  # of Newton's method; [rad] and [(m, rad)²]
# Points fixed in G whose coincidence with their targets fixes the whole pose; well apart, so
# that the optimiser's feasibility tolerance bounds the angle as tightly as the position.
_LANDMARKS = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.5, 0.0]])
_OPTIONS = SolverOptions()
_OPTIONS.SetOption(SnoptSolver.id(), "Major feasibility tolerance", 1e-8)
_OPTIONS.SetOption(SnoptSolver.id(), "Major iterations limit", 200)


@dataclass(frozen=True)
class Starts:
    """Where a search starts.

    Attributes:
        seed: ``[7]`` [rad]; the first start, and what answers are drawn towards.
        attempts: starts in all; those after the first need ``rng``.
        rng: source of the further ones, postures about ``seed``; None tries ``seed`` only.
    """

    seed: np.ndarray
    attempts: int = 1
    rng: np.random.Generator | None = None


def search(
    scene: PlanningScene,
    X_WG: RigidTransform,
    starts: Starts,
    *,
    candidates: int = 1,
    margin: float = MARGIN,
    constrain: Constrain | None = None,
) -> list[IkSolution]:
    """Find up to ``candidates`` different answers with every distance above ``margin``.

    Endless joints are wound to within half a turn of the seed, unless ``constrain`` is given.

    Args:
        scene: the robot and what to keep clear of.
        X_WG: wanted pose of the tool centre point.
        starts: the postures to start from.
        candidates: different answers to gather.
        margin: smallest allowed distance [m].
        constrain: adds constraints; Newton's method, which knows none, is left out then.

    Returns:
        The answers, nearest to the seed first; or one failure.

    Raises:
        ModelError: if the pose is none, the seed not so many finite angles, or the margin or a
            number not finite.
    """
    X_WG = finite_pose(X_WG, "X_WG")
    seed: np.ndarray = scene.require_posture(starts.seed, "seed")
    margin, rng = finite_number(margin, "margin", valid="metres"), starts.rng
    found: list[IkSolution] = []
    best: Clearance | None = None
    attempts = starts.attempts if rng is not None else 1
    attempt = 0
    while attempt < attempts and len(found) < candidates:
        start = None
        if attempt and rng is not None:
            start = seed + rng.normal(0.0, min(0.3 * attempt, 1.5), len(seed))
        attempt += 1
        for proposal in _proposals(scene, X_WG, seed, start, margin, constrain):
            # Another turn may break constraints that we do not know.
            q = scene.wind(proposal, seed) if constrain is None else proposal
            clearance = scene.clearance(q)
            if clearance.distance > margin:
                if all(np.linalg.norm(q - other.q) > _DIFFERENT for other in found):
                    found.append(IkSolution(q, clearance, None, attempt))
                break
            if best is None or clearance.distance > best.distance:
                best = clearance
            if scene.hand_is_blocked(q, margin):
                return [IkSolution(None, clearance, Failure.BLOCKED, attempt)]
    if not found:
        failure = Failure.NOT_FOUND if best is None else collision_failure(scene, best)
        return [IkSolution(None, best, failure, attempt)]
    return sorted(found, key=lambda answer: float(np.linalg.norm(answer.q - seed)))


def _proposals(
    scene: PlanningScene,
    X_WG: RigidTransform,
    seed: np.ndarray,
    start: np.ndarray | None,
    margin: float,
    constrain: Constrain | None,
) -> Iterator[np.ndarray]:
    """Joint angles that reach the pose within the limits, the cheapest to find first.

    Newton's method starts at ``seed`` alone, for it lacks the optimiser's pull towards it.
    """
    if start is None:
        start = seed
        q = follow(scene, X_WG, seed) if constrain is None else None
        if q is not None:
            yield q
    q = _optimise(scene, X_WG, start, seed, None, constrain)
    if q is not None:
        yield q
        # The distance constraint costs ten times the rest.
        q = _optimise(scene, X_WG, q, seed, margin, constrain)
        if q is not None:
            yield q


def follow(scene: PlanningScene, X_WG: RigidTransform, start: np.ndarray) -> np.ndarray | None:
    """Newton's method with damped least steps from ``start [7]`` [rad].

    Returns:
        Joint angles ``[7]`` [rad] near ``start``, or None if it does not converge within the
        limits. Distances are not looked at.

    Raises:
        ModelError: if the pose is none, or ``start`` not so many finite angles.
    """
    X_WG, start = finite_pose(X_WG, "X_WG"), scene.require_posture(start, "start")
    lower, upper = scene.lower + LIMIT_MARGIN, scene.upper - LIMIT_MARGIN
    R_WG, p_WG = X_WG.rotation().matrix(), X_WG.translation()
    q = np.clip(start, lower, upper)
    for _ in range(_ITERATIONS):
        X = scene.forward(q)
        # Half the sum of the axes' cross products: the rotation vector, to first order.
        turn = 0.5 * np.cross(X.rotation().matrix().T, R_WG.T).sum(axis=0)
        twist = np.concatenate([turn, p_WG - X.translation()])
        if np.abs(twist).max() < 0.1 * POSITION_TOLERANCE:
            break
        J = scene.jacobian(q)
        damping = _DAMPING * float(twist @ twist) + 1e-12
        step = J.T @ np.linalg.solve(J @ J.T + damping * np.eye(6), twist)
        q = np.clip(q + step * min(1.0, _STEP / np.abs(step).max()), lower, upper)
    return q if reaches(scene, q, X_WG) else None


def _optimise(
    scene: PlanningScene,
    X_WG: RigidTransform,
    start: np.ndarray,
    seed: np.ndarray,
    margin: float | None,
    constrain: Constrain | None = None,
) -> np.ndarray | None:
    """Run SNOPT from ``start`` for the answer nearest to ``seed``; None if it misses the pose."""
    ik = InverseKinematics(scene.plant, scene.context)
    world, tcp = scene.plant.world_frame(), scene.plant.GetFrameByName("tcp")
    for p_GL in _LANDMARKS:
        p_WL = X_WG @ p_GL
        ik.AddPositionConstraint(tcp, p_GL, world, p_WL, p_WL)
    if margin is not None:
        ik.AddMinimumDistanceLowerBoundConstraint(margin + 1e-4, 0.03)
    if constrain is not None:
        constrain(ik)
    program, variables = ik.prog(), ik.q()[scene.arm_index]
    lower, upper = scene.lower + LIMIT_MARGIN, scene.upper - LIMIT_MARGIN
    program.AddBoundingBoxConstraint(lower, upper, variables)
    program.AddQuadraticErrorCost(np.eye(len(seed)), seed, variables)
    guess = scene.plant.GetPositions(scene.context).copy()
    guess[scene.arm_index] = np.clip(start, lower, upper)
    q = SnoptSolver().Solve(program, guess, _OPTIONS).GetSolution(variables)
    return q if reaches(scene, q, X_WG) else None
