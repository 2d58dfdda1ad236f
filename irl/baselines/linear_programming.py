"""Inverse reinforcement learning by linear programming: thesis (3.7), Ng & Russell (2000).

The reward is earned on entering a state, as in ``irl.planning``. With f = R + γ V (3.15) the
policy's values satisfy V = P_π f, hence f = R + γ P_π f, and f = (I − γ P_π)⁻¹ R is the vector
that (3.7) multiplies by P_π − P_a. Each such product is therefore Q(s, π(s)) − Q(s, a) exactly.
Keeping V as a variable, tied to R by V = P_π (R + γ V), spares the inverse, which is dense even
where the model is sparse.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from irl.baselines.partial_policy import checked_policy, completed
from irl.choices import check_range
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.planning import transition_matrix

_NOTHING = 1e-7  # sum of margins, per unit of reward, that is the solver's tolerance


def lp(
    model: TransitionModel,
    policy: np.ndarray,
    gamma: float,
    *,
    l1: float = 1.0,
    r_max: float = 1.0,
    slack: float = 0.0,
    elsewhere: np.ndarray | None = None,
) -> np.ndarray:
    """Find the reward under which ``policy`` is optimal by the largest sum of margins (3.7).

    A state's margin is by how much Q(s, π(s)) exceeds the best of its *other feasible* actions;
    a state with one action has none. R = 0 always satisfies the constraints, so a solution
    exists; where l1 outweighs every margin (`largest_l1`), or no reward has any, it is R = 0
    itself.

    The sum is often largest where some margins are 0, and then other policies, good or bad, share
    ``policy``'s rank under R. A second program undoes that: among the rewards that keep all but a
    share ``slack`` of the optimum of (3.7), it takes one whose *smallest* margin is largest. It
    stays 0 only if (nearly) no reward singles ``policy`` out, as when it breaks ties of its own
    at random: of two states that share two successors, one may go to the first and the other to
    the second.

    Args:
        model: the transition model.
        policy: the optimal action of every state, integer ``[n_states]``; −1 where a run ends,
            which has the value V = 0. States without actions need it; terminal ones may have it.
        gamma: discount factor in [0, 1).
        l1: λ, the price of Σ_s |R(s)| against the sum of margins, from 0.
        r_max: largest |R(s)|, above 0, in the reward's unit.
        slack: 0…1; 0 is (3.7) alone, 0.01 mostly enough to leave no ties.
        elsewhere: as for `irl.baselines.partial_policy.completed`.

    Returns:
        R, float64 ``[n_states]``, earned on entering a state.

    Raises:
        InputError: if a number is out of range, ``policy`` has a wrong shape or type or
            names an action that is not feasible, or ``elsewhere`` has a wrong shape.
        RuntimeError: if the solver stops without an optimum.
    """
    policy = checked_policy(model, policy)
    check_range("l1", l1, 0.0, 1e9)
    check_range("slack", slack, 0.0, 1.0)
    program = _margins(model, policy, completed(model, policy, elsewhere), gamma, r_max)
    m = program.lower.size
    if m == 0:
        return np.zeros(model.n_states)
    objective = program.objective(l1, np.ones(m))
    R, margins = program.maximise(objective)
    if margins.sum() <= _NOTHING * r_max:
        return np.zeros(model.n_states)
    if slack == 0:
        return R
    value = margins.sum() - l1 * np.abs(R).sum()
    return program.untied(objective, value, margins, slack)[0]


def largest_l1(model: TransitionModel, policy: np.ndarray, gamma: float) -> float:
    """The λ of (3.7) from which R = 0 is best: the largest sum of margins for Σ_s |R(s)| = 1.

    It does not depend on ``r_max``: margins are as large as the reward is.

    Args:
        model: the transition model.
        policy: as for `lp`.
        gamma: discount factor in [0, 1).

    Returns:
        0 if no reward has a margin, as where no state offers a choice, or choices contradict one
        another.

    Raises:
        InputError: as `lp`.
        RuntimeError: if the solver stops without an optimum.
    """
    policy = checked_policy(model, policy)
    program = _margins(model, policy, policy, gamma, 1.0)
    m = program.lower.size
    if m == 0:
        return 0.0
    price = program.objective(1.0, np.zeros(m))
    _, margins = program.maximise(program.objective(0.0, np.ones(m)), (price, -1.0))
    return float(margins.sum()) if margins.sum() > _NOTHING else 0.0


def _margins(
    model: TransitionModel, policy: np.ndarray, valued: np.ndarray, gamma: float, r_max: float
) -> "RewardProgram":
    """The program (3.7), with a margin from 0 for each state where ``policy`` has a choice."""
    lead, margin = leads(model, policy)
    m, k = int(margin.max(initial=-1)) + 1, margin.size
    of_pair = sparse.csr_matrix((np.ones(k), (np.arange(k), margin)), shape=(k, m))
    P_pi = transition_matrix(model, valued)
    return RewardProgram(P_pi, gamma, r_max, lead, of_pair, lower=np.zeros(m))


def leads(model: TransitionModel, policy: np.ndarray) -> tuple[sparse.csr_matrix, np.ndarray]:
    """What a policy's choice has over each action that it passes over: P_π − P_a.

    Where a run has ended (−1), nothing is chosen and nothing passed over.

    Returns:
        The rows, ``[k, n_states]``, whose products with f are differences of Q; and int64
        ``[k]``, which of the states that pass something over each row belongs to.
    """
    chosen = policy[model.pair_state]
    passed = np.flatnonzero((chosen >= 0) & (chosen != model.pair_action))
    state = model.pair_state[passed]
    rows = model.P[model.pair_index(state, policy[state])] - model.P[passed]
    return rows.tocsr(), np.unique(state, return_inverse=True)[1]


def margins(model: TransitionModel, q: np.ndarray, policy: np.ndarray) -> np.ndarray:
    """By how much Q(s, π(s)) exceeds the best of the other actions, in each state with a choice.

    Args:
        model: the transition model.
        q: action values ``[n_states, n_actions]``.
        policy: integer ``[n_states]``, −1 for none.
    """
    states = np.flatnonzero((policy >= 0) & (model.widths > 1))
    others = np.where(model.mask[states], q[states], -np.inf)
    others[np.arange(states.size), policy[states]] = -np.inf
    return q[states, policy[states]] - others.max(axis=1, initial=-np.inf)


@dataclass
class RewardProgram:
    """Linear programs over a reward R, a policy's values, and further variables x.

    Subject to V = P_π f for f = R + γ V, lead·f ≥ extra·x + least, |R| ≤ r_max and lower ≤ x.

    Attributes:
        P_pi: the policy's transition matrix, ``[n, n]``.
        gamma: discount factor in [0, 1).
        r_max: largest |R(s)|, above 0.
        lead: ``[k, n]``, sparse.
        extra: ``[k, m]``, sparse.
        lower: ``[m]``, −∞ where x is free.
        least: ``[k]``, or one number.
    """

    P_pi: sparse.csr_matrix
    gamma: float
    r_max: float
    lead: sparse.csr_matrix
    extra: sparse.csr_matrix
    lower: np.ndarray
    least: np.ndarray | float = 0.0

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            InputError: if gamma or r_max is out of range.
        """
        check_range("gamma", self.gamma, 0, 1, open_high=True)
        check_range("r_max", self.r_max, 0.0, 1e9, open_low=True)

    def objective(self, l1: float, weight: np.ndarray) -> np.ndarray:
        """Coefficients of weight·x − l1 Σ|R|, one for each of the program's variables."""
        n = self.P_pi.shape[0]
        # Gain and loss [n] each, R = gain − loss, so that |R| ≤ gain + loss is linear and tight
        # wherever it is paid for; V [n]; x.
        return np.concatenate([np.full(2 * n, -l1), np.zeros(n), weight])

    def maximise(
        self, objective: np.ndarray, floor: tuple[np.ndarray, float] | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """R ``[n]`` and x ``[m]`` of the largest objective; ``floor``: another and its least value.

        Raises:
            InputError: if nothing satisfies the constraints.
            RuntimeError: if the solver stops without an optimum.
        """
        # All is in proportion to the reward, and the solver's tolerances are for numbers near 1.
        n, m, P, lead, unit = self.P_pi.shape[0], self.lower.size, self.P_pi, self.lead, self.r_max
        values = sparse.hstack(
            [P, -P, self.gamma * P - sparse.identity(n), sparse.csr_matrix((n, m))], format="csr"
        )
        rows = sparse.hstack([-lead, lead, -self.gamma * lead, self.extra], format="csr")
        at_most = np.broadcast_to(-np.asarray(self.least, dtype=np.float64) / unit, lead.shape[:1])
        if floor is not None:
            rows = sparse.vstack([rows, -floor[0][None]], format="csr")
            at_most = np.append(at_most, -floor[1] / unit)
        bounds = np.full((3 * n + m, 2), np.inf)
        bounds[: 2 * n] = 0.0, 1.0
        bounds[2 * n : 3 * n, 0] = -np.inf
        bounds[3 * n :, 0] = self.lower / unit
        answer = linprog(
            -objective, A_ub=rows, b_ub=at_most, A_eq=values, b_eq=np.zeros(n), bounds=bounds
        )
        if answer.status == 2:
            raise InputError(f"linear program: no reward within ±{self.r_max:g} meets all of it")
        if answer.x is None or not answer.success:
            raise RuntimeError(f"linear program: no optimum found ({answer.message})")
        return unit * (answer.x[:n] - answer.x[n : 2 * n]), unit * answer.x[3 * n :]

    def untied(
        self, objective: np.ndarray, value: float, margins: np.ndarray, slack: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Of nearly the best solutions, one whose smallest margin is largest: R ``[n]``, x ``[m]``.

        Args:
            objective: that of the best solution.
            value: its value there.
            margins: the margins there, which are the first of x.
            slack: the share of ``value`` that may be lost, 0…1.
        """
        of, m, (k, n) = margins.size, self.lower.size, self.lead.shape
        # The smallest margin is one variable more, with a row for each margin that bounds it.
        smallest = sparse.hstack([-sparse.eye(of, m), np.ones((of, 1))], format="csr")
        program = replace(
            self,
            lead=sparse.vstack([self.lead, sparse.csr_matrix((of, n))]),
            extra=sparse.vstack([sparse.hstack([self.extra, sparse.csr_matrix((k, 1))]), smallest]),
            lower=np.append(self.lower, min(0.0, margins.min())),
            least=np.append(np.broadcast_to(self.least, k), np.zeros(of)),
        )
        last = np.append(np.zeros(m), 1.0)
        floor = np.append(objective, 0.0), nearly(value, slack)
        R, x = program.maximise(program.objective(0.0, last), floor)
        return R, x[:-1]


def nearly(value: float, slack: float) -> float:
    """All but a share ``slack`` of the best value of an objective, whatever its sign."""
    return (1 - slack) * value if value > 0 else (1 + slack) * value
