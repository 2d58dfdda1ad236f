"""Inverse kinematics: joint angles for a gripper pose that keep clear of everything.

Newton's method follows the pose from a nearby posture; where that fails, Drake's optimiser
looks further. Both only propose: forward kinematics, joint limits and the distance query of
the `PlanningScene`, evaluated afresh, decide.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.solvers import SnoptSolver, SolverOptions

from models.kinematics import HOME, MARGIN, Clearance, PlanningScene

POSITION_TOLERANCE = 1e-5
"""Largest position error of an answer [m]."""
ANGLE_TOLERANCE = 1e-5
"""Largest rotation error of an answer [rad]."""
LIMIT_MARGIN = 0.05
"""Distance that answers keep from the joint limits, for the controller's sake [rad]."""

_DIFFERENT = 0.1  # distance of two answers that count as two [rad]
_ITERATIONS, _STEP, _DAMPING = 30, 0.3, 1e-4  # of Newton's method; [rad] and [(m, rad)²]
# Points fixed in G whose coincidence with their targets fixes the whole pose; well apart, so
# that the optimiser's feasibility tolerance bounds the angle as tightly as the position.
_LANDMARKS = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.5, 0.0]])
_OPTIONS = SolverOptions()
_OPTIONS.SetOption(SnoptSolver.id(), "Major feasibility tolerance", 1e-8)
_OPTIONS.SetOption(SnoptSolver.id(), "Major iterations limit", 200)


class Failure(StrEnum):
    """Why no configuration is returned; only `BLOCKED` proves that none exists."""

    NOT_FOUND = "not found"
    COLLISION = "collision"
    BLOCKED = "hand blocked"
    """The hand itself, placed at the pose, is too near to the furniture or the cube."""


@dataclass(frozen=True)
class IkSolution:
    """The answer to one inverse-kinematics question.

    Attributes:
        q: joint angles ``[7]`` [rad], None if there is no answer.
        clearance: clearance of ``q``, or of the best rejected candidate.
        failure: None on success.
        attempts: starting points tried.
    """

    q: np.ndarray | None
    clearance: Clearance | None
    failure: Failure | None
    attempts: int


def solve(
    scene: PlanningScene,
    X_WG: RigidTransform,
    *,
    seed: np.ndarray = HOME,
    margin: float = MARGIN,
    attempts: int = 20,
    candidates: int = 1,
    rng: np.random.Generator | None = None,
) -> IkSolution:
    """Find joint angles that reach ``X_WG`` with every distance above ``margin``.

    Endless joints are wound to within half a turn of ``seed``.

    Args:
        scene: the robot and what to keep clear of.
        X_WG: wanted pose of the tool centre point.
        seed: ``[7]`` [rad]; the answer is drawn towards it.
        margin: smallest allowed distance [m].
        attempts: starting points; the first is ``seed``, the others need ``rng``.
        candidates: different answers to gather, of which the nearest to ``seed`` counts.
        rng: source of the further starting points; None tries ``seed`` only.
    """
    return solve_all(
        scene,
        X_WG,
        seed=seed,
        margin=margin,
        attempts=attempts,
        candidates=candidates,
        rng=rng,
    )[0]


def solve_all(
    scene: PlanningScene,
    X_WG: RigidTransform,
    *,
    seed: np.ndarray,
    attempts: int,
    candidates: int,
    rng: np.random.Generator | None,
    margin: float = MARGIN,
) -> list[IkSolution]:
    """Find up to ``candidates`` different answers, as `solve` does.

    Returns:
        The answers, nearest to ``seed`` first; or one failure.
    """
    found: list[IkSolution] = []
    best: Clearance | None = None
    starts = attempts if rng is not None else 1
    attempt = 0
    while attempt < starts and len(found) < candidates:
        start = None
        if attempt and rng is not None:
            start = seed + rng.normal(0.0, min(0.3 * attempt, 1.5), 7)
        attempt += 1
        for q in _proposals(scene, X_WG, seed, start, margin):
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
        failure = Failure.NOT_FOUND if best is None else Failure.COLLISION
        return [IkSolution(None, best, failure, attempt)]
    return sorted(found, key=lambda answer: float(np.linalg.norm(answer.q - seed)))


def _proposals(
    scene: PlanningScene,
    X_WG: RigidTransform,
    seed: np.ndarray,
    start: np.ndarray | None,
    margin: float,
) -> Iterator[np.ndarray]:
    """Joint angles that reach the pose within the limits, the cheapest to find first.

    Newton's method starts at ``seed`` alone, for it lacks the optimiser's pull towards it.
    """
    if start is None:
        start = seed
        q = follow(scene, X_WG, seed)
        if q is not None:
            yield scene.wind(q, seed)
    q = _optimise(scene, X_WG, start, seed, None)
    if q is not None:
        yield scene.wind(q, seed)
        # The distance constraint costs ten times the rest.
        q = _optimise(scene, X_WG, q, seed, margin)
        if q is not None:
            yield scene.wind(q, seed)


def follow(scene: PlanningScene, X_WG: RigidTransform, start: np.ndarray) -> np.ndarray | None:
    """Newton's method with damped least steps from ``start [7]`` [rad].

    Returns:
        Joint angles ``[7]`` [rad] near ``start``, or None if it does not converge within the
        limits. Distances are not looked at.
    """
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
) -> np.ndarray | None:
    """Run SNOPT from ``start`` for the answer nearest to ``seed``; None if it misses the pose."""
    ik = InverseKinematics(scene.plant, scene.context)
    world, tcp = scene.plant.world_frame(), scene.plant.GetFrameByName("tcp")
    for p_GL in _LANDMARKS:
        p_WL = X_WG @ p_GL
        ik.AddPositionConstraint(tcp, p_GL, world, p_WL, p_WL)
    if margin is not None:
        ik.AddMinimumDistanceLowerBoundConstraint(margin + 1e-4, 0.03)
    program, variables = ik.prog(), ik.q()[scene.arm_index]
    lower, upper = scene.lower + LIMIT_MARGIN, scene.upper - LIMIT_MARGIN
    program.AddBoundingBoxConstraint(lower, upper, variables)
    program.AddQuadraticErrorCost(np.eye(7), seed, variables)
    guess = scene.plant.GetPositions(scene.context).copy()
    guess[scene.arm_index] = np.clip(start, lower, upper)
    q = SnoptSolver().Solve(program, guess, _OPTIONS).GetSolution(variables)
    return q if reaches(scene, q, X_WG) else None


def reaches(scene: PlanningScene, q: np.ndarray, X_WG: RigidTransform) -> bool:
    """Whether ``q [7]`` meets ``X_WG`` within the tolerances, and the joint limits."""
    position, angle = scene.error(q, X_WG)
    exact = position <= POSITION_TOLERANCE and angle <= ANGLE_TOLERANCE
    return exact and scene.within_limits(q)
