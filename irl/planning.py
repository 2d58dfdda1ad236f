"""Planning for a reward that is known: optimal values, and what a policy achieves.

The *method* ``planning`` learns a reward instead: see ``irl.baselines.sparse_planning``.
"""

import numpy as np
from scipy import sparse

from irl.choices import check_range
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.onward import Onward
from irl.rewards import earned_by_acting

TIE = 1e-14
"""Share of the largest |V| within which actions count as equally good: a few roundings."""
_ROUNDING = TIE / 4  # of the largest |V|: what a policy must gain to be another
_SETTLED = 1e-16  # of the largest |V|: what sweeps alone may leave
_LARGEST = 1e300  # |V| that leaves sums of a few within what a float holds
_SWEEPS = 10  # between two policies, at least


def backup(
    model: TransitionModel,
    V: np.ndarray,
    state_reward: np.ndarray,
    gamma: float,
    pair_reward: np.ndarray | float = 0.0,
) -> np.ndarray:
    """One application of (3.2): Q(s, a) = r(s, a) + Σ_s' P_sa(s') (R(s') + γ V(s')).

    Args:
        model: the transition model.
        V: ``[n_states]``.
        state_reward: R, ``[n_states]``, earned on entering a state.
        gamma: discount factor.
        pair_reward: r, ``[n_pairs]`` or one number, earned by acting (minus its cost).

    Returns:
        float64 ``[n_pairs]``.
    """
    return model.P @ (state_reward + gamma * V) + pair_reward


def best(model: TransitionModel, per_pair: np.ndarray, fill: float) -> np.ndarray:
    """Largest of each state's values ``[n_pairs]``; ``[n_states]``, ``fill`` without actions."""
    result = np.full(model.n_states, fill, dtype=np.float64)
    result[model.acting] = model.groups.maximum(per_pair)
    return result


def value_iteration(
    model: TransitionModel,
    state_reward: np.ndarray,
    gamma: float,
    pair_reward: np.ndarray | float = 0.0,
    terminal: np.ndarray | None = None,
    tolerance: float = 1e-9,
) -> tuple[np.ndarray, np.ndarray]:
    """Optimal values under (3.1)–(3.3).

    Args:
        model: the transition model.
        state_reward: R, ``[n_states]``, earned on entering a state; or as methods learn a reward of
            pairs, ``[n_states, n_actions]``, earned by acting.
        gamma: discount factor in [0, 1).
        pair_reward: ``[n_pairs]`` or one number, earned by acting.
        terminal: indices of states where a run ends; a state without actions ends it too.
        tolerance: largest error of V and Q where the model is too large to be solved to rounding
            (`irl.onward`).

    Returns:
        V ``[n_states]``, 0 where a run ends, and Q ``[n_states, n_actions]``, −∞ for infeasible
        pairs and in terminal states, where nothing is done. Actions that are equally good, to
        ``TIE`` of the largest |V|, have exactly the value of the best.

    Raises:
        InputError: if gamma is outside [0, 1), or a reward is not finite, has a wrong shape, or is
            so large that values may overflow.
    """
    # Folded once, so that a sweep is one matrix product: r + P R.
    earned = earned_by_acting(model, state_reward, pair_reward)
    check_range("value iteration: gamma", gamma, 0, 1, open_high=True)
    if not np.abs(earned).max(initial=0.0) <= _LARGEST * (1 - gamma):
        raise InputError(f"too large for γ = {gamma}: values overflow", place="state_reward")
    ended = np.zeros(model.n_states, dtype=bool)
    if terminal is not None:
        ended[terminal] = True
    V = _optimal_values(model, earned, gamma, ended, tolerance)
    q = earned + gamma * (model.P @ V)
    V = np.where(ended, 0.0, best(model, q, fill=0.0))
    # Whoever takes the first of the best gets it whatever rounding did to the others.
    peak = V[model.pair_state]
    q = np.where(peak - q <= TIE * np.abs(V).max(initial=0.0), peak, q)
    Q = model.table(q)
    Q[ended] = -np.inf
    return V, Q


def _optimal_values(
    model: TransitionModel, earned: np.ndarray, gamma: float, ended: np.ndarray, tolerance: float
) -> np.ndarray:
    """V* ``[n_states]`` where acting earns ``earned`` ``[n_pairs]``, by modified policy iteration.

    Sweeps find out how to act, and what acting so is worth is then solved for (`irl.onward`). Both
    only ever raise V. They take about as much work as one another, so that it costs at most twice
    what the better of the two alone would: sweeps where γ or the way to go is short, policies
    where the future is long.
    """
    V, value = np.zeros(model.n_states), np.full(model.n_states, -np.inf)
    exact, krylov, rounds, work = True, True, 0, 0

    def backed_up(V: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        q = earned + gamma * (model.P @ V)
        return q, np.where(ended, 0.0, best(model, q, fill=0.0))

    while True:
        rounds += 1
        # More with every round: where what pays is far away, each policy is right a little further.
        for _ in range(rounds * max(_SWEEPS, work // max(1, model.P.nnz))):
            last = V
            q, V = backed_up(last)
            # The contraction bounds what is left: |V − V*| ≤ γ / (1 − γ) · last change.
            left = gamma * np.abs(V - last).max(initial=0.0) / (1 - gamma)
            scale = np.abs(V).max(initial=0.0)
            if left <= _SETTLED * scale:
                return V
            # Below a few units in the last place V cannot settle further.
            if not exact and left <= max(tolerance, 1e-15 * scale / (1 - gamma)):
                return V
        if not exact:
            continue
        onward, reward = _acting_first_best(model, q, ended, earned)
        system = Onward(onward, gamma, krylov)
        found = system.solve(reward)
        krylov, work = system.krylov, system.work
        if found is None:
            exact = False
            continue
        rise = (backed_up(found)[1] - found).max(initial=0.0)
        limit = _ROUNDING * np.abs(found).max(initial=0.0)
        if rise <= limit or (found - value).max(initial=0.0) <= limit:
            return found
        V = value = found


def _acting_first_best(
    model: TransitionModel, q: np.ndarray, ended: np.ndarray, earned: np.ndarray
) -> tuple[sparse.csr_matrix, np.ndarray]:
    """P_π ``[n_states, n_states]`` and what π earns ``[n_states]``: the first best pair each."""
    pairs = model.groups.first_equal(q, model.groups.maximum(q))
    pairs = pairs[~ended[model.acting]]
    state = model.pair_state[pairs]
    policy, reward = np.full(model.n_states, -1), np.zeros(model.n_states)
    policy[state] = model.pair_action[pairs]
    reward[state] = earned[pairs]
    return transition_matrix(model, policy), reward


def uniform_policy(actions: np.ndarray) -> np.ndarray:
    """Choose evenly among marked actions.

    Args:
        actions: bool ``[n_states, n_actions]``, such as the co-optimal pairs.

    Returns:
        Probabilities ``[n_states, n_actions]``; a row without marks is 0.
    """
    return actions / np.maximum(actions.sum(axis=1, keepdims=True), 1)


def transition_matrix(model: TransitionModel, policy: np.ndarray) -> sparse.csr_matrix:
    """P_π(s' | s) of a policy, ``[n_states, n_states]``.

    Args:
        model: the transition model.
        policy: actions, integer ``[n_states]`` (−1: none), or probabilities, float
            ``[n_states, n_actions]``.

    Returns:
        A matrix whose row s sums to the probability that the policy picks a feasible action in
        s: an infeasible one leads nowhere.

    Raises:
        InputError: if ``policy`` has neither shape.
    """
    policy = np.asarray(policy)
    if policy.shape == (model.n_states,) and np.issubdtype(policy.dtype, np.integer):
        weight = (policy[model.pair_state] == model.pair_action).astype(np.float64)
    elif policy.shape == (model.n_states, model.n_actions):
        weight = policy[model.pair_state, model.pair_action].astype(np.float64)
    else:
        raise InputError(
            f"policy: integer [{model.n_states}] or probabilities "
            f"[{model.n_states}, {model.n_actions}] wanted, got {policy.dtype} "
            f"{list(policy.shape)}"
        )
    used = np.flatnonzero(weight)
    choice = sparse.csr_matrix(
        (weight[used], (model.pair_state[used], used)), shape=(model.n_states, model.n_pairs)
    )
    return choice @ model.P


def policy_success(
    model: TransitionModel, policy: np.ndarray, goal_states: np.ndarray, horizon: int
) -> np.ndarray:
    """Probability of reaching the goal within ``horizon`` actions, from every state.

    Exact, by backward recursion; a goal state counts as reached from the outset. A run that
    meets −1 or an infeasible action ends there without success.

    Args:
        model: the transition model.
        policy: as for ``transition_matrix``.
        goal_states: indices.
        horizon: largest number of actions.

    Returns:
        float64 ``[n_states]``.

    Raises:
        InputError: if ``policy`` has a wrong shape.
    """
    P = transition_matrix(model, policy)
    success = np.zeros(model.n_states)
    success[goal_states] = 1.0
    for _ in range(horizon):
        success = P @ success
        success[goal_states] = 1.0
    return success
