"""What a policy is worth under a reward that is given, and what it falls short of.

Rewards are given as to ``irl.planning.value_iteration``: a method's reward is earned on entering a
state, or by acting; `irl.rewards.pair_rewards` makes one for acting from other tables. Values are
exact, by a linear system, for policies that choose one action and for those that choose by chance.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import bicgstab, spsolve

from irl.choices import check_range
from irl.errors import InputError
from irl.integers import integers, unmasked
from irl.mdp import TransitionModel
from irl.planning import transition_matrix, value_iteration
from irl.rewards import earned_by_acting

TOLERANCE = 1e-6
"""How far probabilities may be from summing to 1; float32 holds them to about 1e-7."""

# A random policy on the grasping task, 37 successors a state: 18 s by elimination, 0.1 s without.
_ELIMINATED, _FILLS, _RESIDUAL = 2000, 8, 1e-13


def check_policy(model: TransitionModel, policy: np.ndarray, acting: np.ndarray) -> np.ndarray:
    """A policy that can be followed: what it does is feasible, and it does something.

    Args:
        model: the transition model.
        policy: actions, integer ``[n_states]``, or probabilities ``[n_states, n_actions]``.
        acting: bool ``[n_states]``, where something must be done; elsewhere anything will do.

    Returns:
        The actions as they are, or the probabilities as float64, each row divided by its sum.

    Raises:
        InputError: if the shape is another, or in a state that acts nothing is done, something that
            is not feasible, or probabilities are negative or don't sum to 1; names the state.
    """
    policy = unmasked(policy, "policy")
    states = np.flatnonzero(acting)
    if policy.ndim != 2:
        actions = integers(policy, "policy: actions", low=-1, below=model.n_actions)
        if actions.size != model.n_states:
            raise InputError(f"{model.n_states} actions wanted, got {actions.size}", place="policy")
        for s in states[model.pair_index(states, actions[states]) < 0][:1]:
            told = "none" if actions[s] < 0 else f"action {actions[s]}, which is not feasible"
            raise InputError(
                f"does {told} in state {s}", place="policy", valid=model.actions_of(s).tolist()
            )
        return actions
    if policy.shape != (model.n_states, model.n_actions) or policy.dtype.kind not in "fiub":
        raise InputError(
            f"probabilities [{model.n_states}, {model.n_actions}] wanted, got {policy.dtype} "
            f"{list(policy.shape)}",
            place="policy",
        )
    table = policy.astype(np.float64)
    rows = table[states]
    for k, a in np.argwhere(~(rows >= 0) | ((rows > 0) & ~model.mask[states]))[:1]:
        told = "is not feasible" if rows[k, a] > 0 else "is not a probability"
        raise InputError(
            f"state {states[k]}, action {a}: {rows[k, a]} {told}",
            place="policy",
            valid=[f"0 but for actions {model.actions_of(states[k]).tolist()}"],
        )
    total = rows.sum(axis=1)
    for k in np.flatnonzero(~(np.abs(total - 1) <= TOLERANCE))[:1]:
        raise InputError(
            f"the probabilities of state {states[k]} must sum to 1, sum to {total[k]:.9g}",
            place="policy",
        )
    table[states] = rows / total[:, None]
    return table


def policy_value(
    model: TransitionModel,
    policy: np.ndarray,
    state_reward: np.ndarray,
    gamma: float,
    pair_reward: np.ndarray | float = 0.0,
    terminal: np.ndarray | None = None,
) -> NDArray[np.float64]:
    """V^π: the discounted reward that a policy is expected to earn from each state.

    Args:
        model: the transition model.
        policy: actions, integer ``[n_states]``, or probabilities ``[n_states, n_actions]``.
        state_reward: R, ``[n_states]``, earned on entering a state, or ``[n_states, n_actions]``,
            earned by acting.
        gamma: discount factor in [0, 1).
        pair_reward: ``[n_pairs]`` or one number, earned by acting.
        terminal: indices of states where a run ends; a state without actions ends it too.

    Returns:
        float64 ``[n_states]``, 0 where a run ends.

    Raises:
        InputError: if the policy cannot be followed (`check_policy`), gamma is outside [0, 1), or a
            reward is not finite or has a wrong shape.
    """
    check_range("policy value: gamma", gamma, 0, 1, open_high=True)
    earned = earned_by_acting(model, state_reward, pair_reward)
    acting = _acting(model, terminal)
    policy = check_policy(model, policy, acting)
    if policy.ndim == 1:
        policy = np.where(acting, policy, -1)
        weight = (policy[model.pair_state] == model.pair_action).astype(np.float64)
    else:
        policy = np.where(acting[:, None], policy, 0.0)
        weight = policy[model.pair_state, model.pair_action]
    P = transition_matrix(model, policy)
    reward: NDArray[np.float64] = np.zeros(model.n_states)
    np.add.at(reward, model.pair_state, weight * earned)
    value = _solved(sparse.identity(model.n_states, format="csr") - gamma * P, reward)
    if not np.isfinite(value).all():
        raise InputError(f"too large for γ = {gamma}: values overflow", place="state_reward")
    return value


def regret(
    model: TransitionModel,
    policy: np.ndarray,
    state_reward: np.ndarray,
    gamma: float,
    pair_reward: np.ndarray | float = 0.0,
    terminal: np.ndarray | None = None,
) -> NDArray[np.float64]:
    """V* − V^π: what a policy is expected to earn less than an optimal one, from each state.

    Args:
        model: the transition model.
        policy: as for `policy_value`.
        state_reward: the true R, as for `policy_value`; so for the other arguments.
        gamma: discount factor in [0, 1).
        pair_reward: ``[n_pairs]`` or one number.
        terminal: indices of states where a run ends.

    Returns:
        float64 ``[n_states]``, at least 0.

    Raises:
        InputError: as `policy_value`.
    """
    rewards = (state_reward, gamma, pair_reward, terminal)
    value = policy_value(model, policy, *rewards)
    _, Q = value_iteration(model, *rewards)
    best = policy_value(model, np.where(_acting(model, terminal), Q.argmax(axis=1), -1), *rewards)
    # No policy is worth more than the optimum: what is more than the best one's is rounding.
    return np.maximum(best - value, 0.0)


def expected_value_difference(
    model: TransitionModel,
    policy: np.ndarray,
    state_reward: np.ndarray,
    gamma: float,
    start: np.ndarray,
    pair_reward: np.ndarray | float = 0.0,
    terminal: np.ndarray | None = None,
) -> float:
    """EVD: the mean of `regret` over the states that runs start in, under the true reward.

    Source: Levine, Popović and Koltun, "Nonlinear inverse reinforcement learning with Gaussian
    processes", 2011, section 7.

    Args:
        model: the transition model.
        policy: what was learnt, as for `policy_value`.
        state_reward: the true R, as for `policy_value`; so for the other arguments.
        gamma: discount factor in [0, 1).
        start: indices ``[k]``, equally likely, or probabilities, float ``[n_states]``.
        pair_reward: ``[n_pairs]`` or one number.
        terminal: indices of states where a run ends.

    Raises:
        InputError: as `policy_value`, or if ``start`` is neither.
    """
    share = _start_share(start, model.n_states)
    return float(share @ regret(model, policy, state_reward, gamma, pair_reward, terminal))


def _acting(model: TransitionModel, terminal: np.ndarray | None) -> NDArray[np.bool_]:
    """Where something is to be done, bool ``[n_states]``."""
    acting = model.widths > 0
    if terminal is not None:
        acting[integers(terminal, "terminal", below=model.n_states)] = False
    return acting


def _solved(A: sparse.csr_matrix, b: NDArray[np.float64]) -> NDArray[np.float64]:
    """The x of A x = b: by elimination, or, where that would fill a large matrix, by iteration."""
    n = b.size
    if n > _ELIMINATED and A.nnz > _FILLS * n:
        x, failed = bicgstab(A, b, rtol=1e-13, atol=0.0, maxiter=1000)
        size = max(np.abs(x).max(), np.abs(b).max())
        if not failed and np.abs(A @ x - b).max() <= _RESIDUAL * size:
            return x
    return np.atleast_1d(spsolve(A.tocsc(), b))


def _finite(place: str, values: np.ndarray | float, n: int) -> NDArray[np.float64]:
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (n,) or not np.isfinite(array).all():
        raise InputError(f"finite numbers [{n}] wanted, got {list(array.shape)}", place=place)
    return array


def _start_share(start: np.ndarray, n_states: int) -> NDArray[np.float64]:
    """The probability that a run starts in each state, float64 ``[n_states]``."""
    given = np.asarray(start)
    if given.dtype.kind == "f" and given.size:
        share = _finite("start", given, n_states)
        if (share < 0).any() or not abs(share.sum() - 1) <= TOLERANCE:
            raise InputError(
                f"probabilities that sum to 1 wanted, or indices; sum to {share.sum():.9g}",
                place="start",
            )
        return share / share.sum()
    states = integers(given, "start", below=n_states)
    if not states.size:
        raise InputError("at least one start state wanted", place="start")
    return np.bincount(states, minlength=n_states) / states.size
