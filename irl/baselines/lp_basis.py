"""Linear programming over basis functions: thesis (3.12), Ng & Russell (2000), section 4.

The reward is R = Φ ω (3.10), so a policy's values are linear in ω as well (3.11). Constraints are
imposed in a sample S₀ of the states alone, and a violation is not forbidden but counts twice:

    max  Σ_{s ∈ S₀} min_a p(Σ_s' (P_sπ(s) − P_sa)(s') f(s')),   |ω_k| ≤ 1
    p(x) = x for x ≥ 0, 2x below

(3.12) writes V^π for a reward earned *in* a state. Here it is earned on entering one, and what a
state is worth when it is entered, its own reward included, is f = R + γ V (3.15).
"""

import numpy as np
from scipy import sparse
from scipy.optimize import linprog
from scipy.sparse.linalg import splu

from irl.baselines.features import Features, state_features
from irl.baselines.linear_programming import leads, nearly
from irl.baselines.partial_policy import checked_policy, completed
from irl.choices import check_range
from irl.integers import integers
from irl.mdp import TransitionModel
from irl.planning import transition_matrix


def lp_basis(
    model: TransitionModel,
    policy: np.ndarray,
    features: np.ndarray | None = None,
    *,
    gamma: float,
    states: np.ndarray | None = None,
    elsewhere: np.ndarray | None = None,
    slack: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Find the weights under which ``policy`` leads most in the sampled states (3.12).

    ω = 0 leads nowhere and violates nothing. It is what is found where no ω does better, or where
    no sampled state offers a choice.

    Args:
        model: the transition model.
        policy: the action of every state, integer ``[n_states]``; −1 where a run ends, which has
            the value V = 0.
        features: Φ, ``[n_states, d]``; one indicator per state if absent.
        gamma: discount factor in [0, 1).
        states: S₀, indices of the sampled states; all if absent.
        elsewhere: as for `irl.baselines.partial_policy.completed`.
        slack: 0…1; 0 is (3.12) alone; else the share of its optimum that may be lost for the
            smallest margin, as `irl.baselines.linear_programming.lp` has it.

    Returns:
        R ``[n_states]``, earned on entering a state, and ω ``[d]``.

    Raises:
        InputError: if gamma or slack is out of range, ``policy`` has a wrong shape or type or names
            an action that is not feasible, or the features are not finite or have a wrong shape.
        RuntimeError: if the solver stops without an optimum.
    """
    phi = state_features(model, features)
    policy = checked_policy(model, policy)
    check_range("gamma", gamma, 0, 1, open_high=True)
    check_range("slack", slack, 0, 1)
    valued = completed(model, policy, elsewhere)
    f = entry_values(transition_matrix(model, valued), phi, gamma)
    sampled = policy
    if states is not None:
        inside = integers(states, "states", below=model.n_states)
        sampled = np.full(model.n_states, -1, dtype=np.int64)
        sampled[inside] = policy[inside]
    lead, state = leads(model, sampled)
    lead = lead @ f
    if state.size == 0:
        return np.zeros(model.n_states), np.zeros(phi.shape[1])
    m, k, d = int(state.max(initial=-1)) + 1, state.size, phi.shape[1]
    of_pair = sparse.csr_matrix((np.ones(k), (np.arange(k), state)), shape=(k, m))
    # p grows with x, so the least p(x) is p of the least x. That is gain − loss, both from 0, and
    # p of it is gain − 2 loss.
    loss = np.concatenate([np.zeros(d), -np.ones(m), np.full(m, 2.0)])
    rows = sparse.hstack([sparse.csr_matrix(-lead), of_pair, -of_pair], format="csr")
    bounds = np.array([[-1.0, 1.0]] * d + [[0.0, np.inf]] * (2 * m))
    x, least = _solved(loss, rows, np.zeros(k), bounds)
    if -least <= 1e-9 * np.abs(lead).max():
        return np.zeros(model.n_states), np.zeros(d)
    if slack:
        # The smallest margin is one variable more, with a row for each margin that bounds it.
        each = sparse.identity(m)
        smallest = sparse.hstack([sparse.csr_matrix((m, d)), -each, each])
        one = np.r_[np.zeros(k + 1), np.ones(m)][:, None]
        rows = sparse.hstack([sparse.vstack([rows, loss[None], smallest]), one], format="csr")
        at_most = np.r_[np.zeros(k), -nearly(-least, slack), np.zeros(m)]
        last = np.append(np.zeros(loss.size), -1.0)
        x, _ = _solved(last, rows, at_most, np.vstack([bounds, [-np.inf, np.inf]]))
    weights = x[:d]
    return phi @ weights, weights


def _solved(
    c: np.ndarray, rows: sparse.csr_matrix, at_most: np.ndarray, bounds: np.ndarray
) -> tuple[np.ndarray, float]:
    """The x of least c·x that has rows·x ≤ at_most within bounds, and c·x."""
    program = {"c": c, "A_ub": rows, "b_ub": at_most, "bounds": bounds}
    answer = linprog(**program)
    if answer.x is None or not answer.success:  # features that nearly depend on one another
        answer = linprog(**program, method="highs-ipm")
    if answer.x is None or not answer.success:
        raise RuntimeError(f"linear program: no optimum found ({answer.message})")
    return answer.x, float(answer.fun)


def entry_values(P_pi: sparse.csr_matrix, features: Features, gamma: float) -> np.ndarray:
    """What entering each state is worth under R = φ_k: (I − γ P_π)⁻¹ Φ, (3.11) ``[n, d]``."""
    system = sparse.identity(P_pi.shape[0], format="csc") - gamma * P_pi.tocsc()
    dense = features if isinstance(features, np.ndarray) else features.toarray()
    return splu(system).solve(dense)
