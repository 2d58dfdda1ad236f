"""Basis functions for (3.12) that the demonstrations choose: number, width and place of bumps.

Ng & Russell (2000, section 6) cover their state space with Gaussian bumps of one width. Too few or
too wide, they cannot peak where a run was going; too many or too narrow, they explain every step
by a reward for the step itself, and nothing elsewhere. So sets of bumps are tried, the smallest
first: on the states where runs ended, then on states as far from those and from one another as can
be. What counts is whether *planning* for the reward found would act as was demonstrated. The
first set for which it (nearly) would is taken, or else the best.

(3.12) values a policy, which needs an action in every state. Where none was demonstrated, all are
first taken evenly, and afterwards the best one under the reward found.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from irl.baselines.ascent import Callback
from irl.baselines.lp_basis import lp_basis
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.planning import uniform_policy, value_iteration

ENOUGH = 0.95
"""`explained` from which a set of bumps is taken at once. It need not be 1: rewards that differ a
little prefer one of two ways that were equally good to the demonstrator."""
_GAIN = 0.01  # of `explained`, below which a larger set has not helped
_PATIENCE = 2  # so many larger sets in a row may fail to help
_NUMBERS = (1, 4, 16, 64, 256)
_WIDTHS = (0.25, 0.5, 1.0)  # of the distance between bumps
_ROUNDS = 3  # programs for one set, each with the policy of the last one's reward


@dataclass(frozen=True, eq=False)
class Bumps:
    """What was found.

    Attributes:
        reward: R, float64 ``[n_states]``, earned on entering a state.
        q: its optimal action values, ``[n_states, n_actions]``, −∞ where infeasible.
        number: how many bumps.
        width: their standard deviation, of features brought to unit variance; 0 without bumps.
        explained: how far the demonstrations follow the reward, see `explained`.
    """

    reward: np.ndarray
    q: np.ndarray
    number: int = 0
    width: float = 0.0
    explained: float = 0.0


def lp_bumps(
    model: TransitionModel,
    demonstrations: Demonstrations,
    policy: np.ndarray,
    ends: np.ndarray,
    features: np.ndarray,
    *,
    gamma: float,
    most: int = 256,
    callback: Callback | None = None,
) -> Bumps:
    """Find the bumps, and the weights under which ``policy`` leads most (3.12).

    Args:
        model: the transition model.
        demonstrations: labelled pairs, by which sets of bumps are compared.
        policy: the action demonstrated in every state, integer ``[n_states]``; −1 for none.
        ends: indices of the states where runs ended, the most frequent first; may be empty.
        features: ``[n_states, d]``, in which bumps are round and distances measured.
        gamma: discount factor in [0, 1).
        most: largest number of bumps, at least 1.
        callback: told after each program how many were solved, and `explained` of the best.

    Raises:
        InputError: if an input is invalid, as ``lp_basis``.
        RuntimeError: if no program was solved.
    """
    if most < 1:
        raise InputError(f"must be ≥ 1, is {most}", place="bumps")
    shown = np.flatnonzero(policy >= 0)
    found: Bumps | None = None
    unhelpful, size, before, done = 0, 0, 0.0, 0
    can_end = (model.widths == 0).any()
    for bumps, number, width in _candidates(features, ends if ends.size else shown, most):
        if number != size:
            best = found.explained if found else 0.0
            unhelpful = unhelpful + 1 if size and best < before + _GAIN else 0
            size, before = number, best
            if unhelpful > _PATIENCE:
                break
        # Where runs can end, what each further step costs or earns is a question of its own.
        basis = np.hstack([np.ones((model.n_states, 1)), bumps]) if can_end else bumps
        elsewhere = uniform_policy(model.mask)
        for _ in range(_ROUNDS):
            try:
                R, _ = lp_basis(model, policy, basis, gamma=gamma, elsewhere=elsewhere)
            except RuntimeError:  # a basis that the solver finds too nearly dependent
                break
            _, q = value_iteration(model, R, gamma)
            now = Bumps(R, q, number, width, explained(model, q, demonstrations))
            if found is None or now.explained > found.explained:
                found = now
            done += 1
            if callback is not None:
                callback(done, found.explained)
            if now.explained >= ENOUGH:
                return now
            elsewhere = np.eye(model.n_actions)[q.argmax(axis=1)]
    if found is None:
        raise RuntimeError("linear program: no optimum found for any set of bumps")
    return found


def explained(model: TransitionModel, q: np.ndarray, demonstrations: Demonstrations) -> float:
    """How far, in the mean, demonstrated actions come from the average to the best one by ``q``.

    1 where every one is among the best, 0 where they are no better than chance, or where ``q``
    does not tell actions apart; it has no unit. States with one action do not count.

    Args:
        model: the transition model.
        q: action values ``[n_states, n_actions]``, finite where feasible.
        demonstrations: labelled pairs.
    """
    labels = demonstrations.counted
    choice = model.widths[labels.state] > 1
    state, action, count = labels.state[choice], labels.action[choice], labels.count[choice]
    if not state.size:
        return 0.0
    of_state, feasible = q[state], model.mask[state]
    average = np.where(feasible, of_state, 0.0).sum(axis=1) / feasible.sum(axis=1)
    most = np.where(feasible, of_state, -np.inf).max(axis=1)
    apart = most - average
    tells = apart > 1e-9 * np.abs(most).max()
    gained = of_state[np.arange(state.size), action] - average
    share = np.where(tells, gained / np.where(tells, apart, 1.0), 0.0)
    return float((count * share).sum() / count.sum())


def _candidates(
    features: np.ndarray, ends: np.ndarray, most: int
) -> Iterator[tuple[np.ndarray, int, float]]:
    """Bumps ``[n_states, number]``, their number and width, from few to many."""
    spread = features.std(axis=0)
    x = features / np.where(spread > 0, spread, 1.0)
    centres, n_ends = _spread_out(x, ends, most)
    for number in sorted({min(k, len(centres)) for k in (*_NUMBERS, n_ends)}):
        at = x[centres[:number]]
        distance = cdist(x, at, "sqeuclidean")
        between = np.sqrt(distance[centres[:number]])
        np.fill_diagonal(between, np.inf)
        apart = np.median(between.min(axis=1)) if number > 1 else np.sqrt(distance.max())
        for share in _WIDTHS:
            width = share * (float(apart) or 1.0)
            yield np.exp(-distance / (2 * width**2)), number, width


def _spread_out(x: np.ndarray, ends: np.ndarray, most: int) -> tuple[np.ndarray, int]:
    """States, each as far as can be from those before it: of the ends first, then of all.

    Returns:
        At most ``most`` indices, no two at the same place; and how many of them are ends.
    """
    chosen = [int(ends[0])]
    near = cdist(x[chosen], x)[0]
    n_ends = 0
    for pool in (ends, np.arange(len(x))):
        while len(chosen) < most:
            farthest = int(pool[near[pool].argmax()])
            if near[farthest] <= 0:
                break
            chosen.append(farthest)
            near = np.minimum(near, cdist(x[[farthest]], x)[0])
        n_ends = n_ends or len(chosen)
    return np.array(chosen), n_ends
