"""Where an audit asks: in parts of the states that are as unlike one another as can be.

Up to a third of its states are just beside where runs ended, each different in another respect:
whoever takes too little for the goal, because it knows no name for what its states have in common,
is wrong there. Of the rest, half are where runs start: what is done first depends on all that is to
follow, so whoever is wrong about goal or costs is wrong there most of all. And it is often wrong
about one kind of action: so each state is drawn from a part of its own, of states in the order of
what it would do there.
"""

from collections.abc import Mapping

import numpy as np

from irl.problem import LearningProblem

_BESIDE = 3  # one of so many states is beside where a run ended, at most


def audit_parts(
    problem: LearningProblem,
    states: np.ndarray,
    action: np.ndarray,
    ends: np.ndarray,
    number: int,
    turn: int = 0,
) -> np.ndarray:
    """Parts that an audit draws one state each from.

    Args:
        problem: its start states, factors and features.
        states: the states that an audit may ask about, int64 ``[n]``.
        action: what would be done in each of them, int64 ``[n]``.
        ends: states where runs ended, int64.
        number: how many parts.
        turn: how many audits there were; if there are many factors, each turns to others.

    Returns:
        The part of each state, from 0; int64 ``[n]``.
    """
    features = problem.features if problem.pair_features is None else None
    near = beside(ends, problem.factors, features, states)
    most = min(len(near), number // _BESIDE)
    near = [near[(turn * most + k) % len(near)] for k in range(most)]
    part = parts(action, np.isin(states, problem.start_states), number - most)
    for k, some in enumerate(near, number - most):
        part[np.isin(states, some)] = k
    return part


def parts(action: np.ndarray, first: np.ndarray, number: int) -> np.ndarray:
    """Parts of states that an audit draws one each from.

    Half of the parts are of states where runs start, half of all others, in either case alike in
    size and in the order of what would be done.

    Args:
        action: of each state, int64 ``[n]``.
        first: whether runs start there, bool ``[n]``.
        number: how many parts.

    Returns:
        The part of each state, from 0; int64 ``[n]``.
    """
    part = np.empty(action.size, dtype=np.int64)
    half = number if first.all() else -(-number // 2) if first.any() else 0
    for some, begin, count in ((first, 0, half), (~first, half, number - half)):
        order = np.flatnonzero(some)[np.argsort(action[some], kind="stable")]
        part[order] = begin + np.arange(order.size) * count // max(order.size, 1)
    return part


def beside(
    ends: np.ndarray,
    factors: Mapping[str, np.ndarray],
    features: np.ndarray | None,
    among: np.ndarray,
) -> list[np.ndarray]:
    """For each factor the states that differ in it from where a run ended, and else least.

    How much states differ is in how many factors, and of equals the distance of their features:
    what they have in common may have no name.

    Args:
        ends: states where runs ended, int64.
        factors: name → int64 ``[n_states]``.
        features: ``[n_states, d]``; None for none.
        among: the states to choose from, int64.

    Returns:
        Distinct sets of states, each with one for every end; none where no state differs.
    """
    if not factors:
        return []
    near: dict[str, set[int]] = {name: set() for name in factors}
    for end in ends.tolist():
        unlike = {name: values[among] != values[end] for name, values in factors.items()}
        far = np.zeros(among.size)
        if features is not None:
            far = np.linalg.norm(features[among] - features[end], axis=1)
        ranked = np.lexsort((far, np.sum(list(unlike.values()), axis=0)))
        for name, other in unlike.items():
            near[name].update(among[ranked[other[ranked]][:1]].tolist())
    distinct = dict.fromkeys(tuple(sorted(states)) for states in near.values() if states)
    return [np.array(states) for states in distinct]
