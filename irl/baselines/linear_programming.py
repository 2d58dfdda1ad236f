"""Inverse reinforcement learning by linear programming: thesis (3.7), Ng & Russell (2000).

The reward is earned on entering a state, as in ``irl.planning``. With f = R + γ V (3.15) the
policy's values satisfy V = P_π f, hence f = R + γ P_π f, and f = (I − γ P_π)⁻¹ R is the vector
that (3.7) multiplies by P_π − P_a. Each such product is therefore Q(s, π(s)) − Q(s, a) exactly.
Keeping V as a variable, tied to R by V = P_π (R + γ V), spares the inverse, which is dense even
where the model is sparse.
"""

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from irl.choices import check_range
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.planning import transition_matrix


def lp(
    model: TransitionModel,
    policy: np.ndarray,
    gamma: float,
    *,
    l1: float = 1.0,
    r_max: float = 1.0,
) -> np.ndarray:
    """Find the reward under which ``policy`` is optimal by the largest sum of margins (3.7).

    A state's margin is by how much Q(s, π(s)) exceeds the best of its *other feasible* actions;
    a state with one action has none. R = 0 always satisfies the constraints, so a solution
    exists; where l1 outweighs every margin, it is R = 0 itself. A margin may be 0, so the policy
    can share its rank with others under R, and a small l1 buys many margins at the price of
    such ties elsewhere.

    Args:
        model: the transition model.
        policy: the optimal action of every state, integer ``[n_states]``; −1 where a run ends,
            which has the value V = 0. States without actions need it; terminal ones may have it.
        gamma: discount factor in [0, 1).
        l1: λ, the price of Σ_s |R(s)| against the sum of margins, from 0.
        r_max: largest |R(s)|, above 0, in the reward's unit.

    Returns:
        R, float64 ``[n_states]``, earned on entering a state.

    Raises:
        InputError: if a number is out of range, or ``policy`` has a wrong shape or type or
            names an action that is not feasible.
        RuntimeError: if the solver stops without an optimum.
    """
    policy = _checked(model, policy)
    check_range("gamma", gamma, 0.0)
    if gamma >= 1:
        raise InputError(f"gamma: must be < 1, is {gamma}")
    check_range("l1", l1, 0.0)
    check_range("r_max", r_max, 0.0, open_low=True)

    n = model.n_states
    P_pi = transition_matrix(model, policy)
    chosen = policy[model.pair_state]
    # Pairs that the policy passes over; where a run has ended, nothing is chosen or passed over.
    passed = np.flatnonzero((chosen >= 0) & (chosen != model.pair_action))
    contested, margin = np.unique(model.pair_state[passed], return_inverse=True)
    m, n_passed = contested.size, passed.size
    lead = P_pi[model.pair_state[passed]] - model.P[passed]  # P_π − P_a, [n_passed, n]
    of_pair = sparse.csr_matrix(
        (np.ones(n_passed), (np.arange(n_passed), margin)), shape=(n_passed, m)
    )

    # Variables: gain and loss [n] each, R = gain − loss, so that |R| ≤ gain + loss is linear and
    # tight wherever it is paid for; V [n]; margins [m], which are the minima in (3.7).
    cost = np.concatenate([np.full(2 * n, l1), np.zeros(n), -np.ones(m)])
    values = sparse.hstack(
        [P_pi, -P_pi, gamma * P_pi - sparse.identity(n), sparse.csr_matrix((n, m))], format="csr"
    )
    margins = sparse.hstack([-lead, lead, -gamma * lead, of_pair], format="csr")
    bounds = [(0.0, r_max)] * (2 * n) + [(None, None)] * n + [(0.0, None)] * m
    answer = linprog(
        cost, A_ub=margins, b_ub=np.zeros(n_passed), A_eq=values, b_eq=np.zeros(n), bounds=bounds
    )
    if answer.x is None or not answer.success:
        raise RuntimeError(f"linear program: no optimum found ({answer.message})")
    return answer.x[:n] - answer.x[n : 2 * n]


def _checked(model: TransitionModel, policy: np.ndarray) -> np.ndarray:
    policy = np.asarray(policy)
    if policy.shape != (model.n_states,) or not np.issubdtype(policy.dtype, np.integer):
        raise InputError(
            f"policy: integer [{model.n_states}] wanted, got {policy.dtype} {list(policy.shape)}"
        )
    states = np.arange(model.n_states)
    for s in np.flatnonzero((policy != -1) & (model.pair_index(states, policy) < 0))[:1]:
        raise InputError(
            f"policy: state {s}, action {policy[s]} is not feasible; "
            f"feasible: {model.actions_of(s).tolist()}, or -1 where a run ends"
        )
    return policy
