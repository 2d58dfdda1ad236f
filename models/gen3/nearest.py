"""The Gen3's postures for a pose, the nearest to a seed first, as compiled code.

For each value of the third joint the closed form gives every posture that meets a pose; capsules
tell which of these collide for certain. What is left is for the exact query.
"""

from typing import NamedTuple

import numpy as np

from models.compiled import FAST, compiled
from models.gen3.branches import BRANCHES, solve_into
from models.gen3.capsules import FREE, FURNITURE, SELF, Capsules, arrays, check
from models.gen3.chain import LIMIT, Array, chain
from models.gen3.newton import MET, refine, work_arrays

LIMIT_ZONE = 0.2
"""Distance from a joint limit within which a posture counts as worse [rad]."""
LIMIT_WEIGHT = 1.0
"""By how much worse at the limit itself [rad]; it falls off quadratically through the zone."""

_COARSE, _FINE = 1e-6, 1e-11  # of the pose, while postures are compared; of an answer [m, rad]


class Question(NamedTuple):
    """A pose, and what answers are measured by.

    Attributes:
        R: rotation of the end effector in the base ``[3, 3]``.
        p: its position ``[3]`` [m].
        seed: what an answer is to be near to ``[7]`` [rad].
        margin: smallest allowed distance [m].
    """

    R: Array
    p: Array
    seed: Array
    margin: float


@compiled(**FAST)
def cost_of(q: Array, seed: Array) -> float:
    """How far a posture ``[7]`` is from ``seed``, and how near to its limits [rad]."""
    squared = penalty = 0.0
    for i in range(7):
        squared += (q[i] - seed[i]) ** 2
        short = 1.0 - (LIMIT[i] - abs(q[i])) / LIMIT_ZONE
        if short > 0.0:
            penalty += short * short
    return np.sqrt(squared) + LIMIT_WEIGHT * penalty


@compiled(**FAST)
def may_be_within(question: Question, cost: float) -> bool:
    """Whether an answer can cost so little [rad]; False proves that none does.

    The hand turns by no more than the joints together, at most √7 times their distance.
    """
    X = np.empty((3, 4))
    chain(question.seed, np.empty((6, 7)), X)
    trace = 0.0
    for i in range(3):
        for k in range(3):
            trace += X[i, k] * question.R[i, k]
    angle = np.arccos(min(max(0.5 * (trace - 1.0), -1.0), 1.0))
    return angle <= np.sqrt(7.0) * cost + 1e-6


@compiled(**FAST)
def _wind(q: Array, seed: Array) -> None:
    """Turn the endless joints to within half a turn of ``seed``."""
    for i in range(0, 7, 2):
        q[i] -= 2.0 * np.pi * np.round((q[i] - seed[i]) / (2.0 * np.pi))


@compiled(**FAST)
def _met(question: Question, q3: Array) -> tuple[Array, Array]:
    """Postures ``[k, 7]`` that meet the pose, to `_COARSE`, with any of ``q3``; their costs."""
    q, cost = np.empty((BRANCHES * len(q3), 7)), np.empty(BRANCHES * len(q3))
    answers, work = np.empty((BRANCHES, 7)), work_arrays()
    count = 0
    for value in q3:
        answers[:] = np.nan
        solve_into(question.R, question.p, value, answers, BRANCHES, _COARSE, work)
        for branch in range(BRANCHES):
            if not np.isnan(answers[branch, 0]):
                q[count] = answers[branch]
                _wind(q[count], question.seed)
                cost[count] = cost_of(q[count], question.seed)
                count += 1
    return q[:count], cost[:count]


@compiled(**FAST)
def ranked(question: Question, q3: Array, below: float) -> Array:
    """Postures ``[k, 7]`` [rad] that meet the pose, to `_COARSE`, the cheapest first.

    Args:
        question: the pose.
        q3: the third joint's angles to try ``[m]`` [rad].
        below: cost that they are to be below [rad].
    """
    q, cost = _met(question, q3)
    order = np.argsort(cost, kind="mergesort")
    return q[order[: (cost < below).sum()]]


@compiled(error_model="numpy")
def next_possible(q: Array, first: int, capsules: Capsules, margin: float) -> tuple[int, bool]:
    """The first of ``q [k, 7]`` from place ``first`` on that does not collide for certain.

    Returns:
        Its place, k if there is none; and whether its capsules say that it is free.
    """
    frames, start, end = arrays(capsules)
    for i in range(first, len(q)):
        verdict = check(capsules, q[i], margin, frames, start, end, True)
        if verdict not in (SELF, FURNITURE):
            return i, verdict == FREE
    return len(q), False


@compiled(error_model="numpy")
def refined(
    question: Question, q: Array, width: float, capsules: Capsules, rounds: int, shrink: int
) -> Array:
    """Lower the cost of an answer ``q [7]`` by finer and finer sweeps about its q3.

    No posture that it goes to collides for certain.

    Args:
        question: the pose.
        q: where to start [rad].
        width: half the width of the first sweep [rad].
        capsules: what collides for certain.
        rounds: how many sweeps.
        shrink: how much narrower each is than the one before.
    """
    frames, start, end = arrays(capsules)
    best, least = q.copy(), cost_of(q, question.seed)
    for _ in range(rounds):
        found, cost = _met(question, best[2] + width * np.linspace(-1.0, 1.0, 2 * shrink + 1))
        for i in np.argsort(cost, kind="mergesort"):
            if not cost[i] < least - 1e-9:
                break
            verdict = check(capsules, found[i], question.margin, frames, start, end, True)
            if verdict not in (SELF, FURNITURE):
                best, least = found[i].copy(), cost[i]
                break
        width /= shrink
    return best


@compiled(**FAST)
def polished(question: Question, q: Array) -> Array:
    """A posture that meets the pose to `_FINE`, next to one that meets it nearly; else as it is."""
    answer = q.copy()
    if refine(answer, question.R, question.p, _FINE, work_arrays()) != MET:
        return q
    _wind(answer, question.seed)
    return answer
