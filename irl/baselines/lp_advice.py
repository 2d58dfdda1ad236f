"""Linear programming with advice: thesis (3.9), Kunapuli et al. (2013).

Demonstrations need not be optimal: a demonstrated action's lead over the others of its state,
ξ, may be negative. Advice about actions adds constraints (3.8): in an advised state each
preferred action must be worth at least δ more than each avoided one.

    max  −‖R‖₁ + λ_d Σ ξ_i + λ_a Σ ζ_j
    Q(i, a*) − Q(i, a) ≥ ξ_i            for every other a, in every demonstrated state i
    Q(j, a) − Q(j, a') ≥ ζ_j + δ_j      for a preferred, a' avoided, in every advised state j
    ζ_j ≥ 0,  |R| ≤ R_max

``irl.baselines.linear_programming`` explains how the values are tied to R without the inverse.
A level t_j between preferred and avoided actions, Q(j, a) ≥ t_j + ζ_j + δ_j and t_j ≥ Q(j, a'),
says the same in |Pref| + |Av| rows instead of |Pref| · |Av|.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy import sparse

from irl.advice import Advice
from irl.baselines.ascent import Callback
from irl.baselines.linear_programming import RewardProgram, leads
from irl.choices import Limits, Settings
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.integers import reals
from irl.mdp import TransitionModel
from irl.planning import transition_matrix, value_iteration


@dataclass(frozen=True, eq=False)
class TrustConfig(Settings):
    """How far demonstrations and advice are trusted, and the program's limits."""

    demonstration_trust: Annotated[float, Limits(0, 1e9)] = 1.0
    """λ_d."""
    advice_trust: Annotated[float, Limits(0, 1e9)] = 1.0
    """λ_a."""
    hardness: np.ndarray | float = 0.0
    """δ, one number or ``[n_states]``, in units of Q: above 0 a margin that must be met, below 0 a
    violation that is allowed."""
    r_max: Annotated[float, Limits(0, 1e9, open_low=True)] = 1.0
    """Largest |R(s)|, in the reward's unit."""
    rounds: Annotated[int, Limits(1, 1_000_000)] = 10
    """Most policies to solve (3.9) for."""
    slack: Annotated[float, Limits(0, 1)] = 0.0
    """0 is (3.9) alone; else the share of its optimum that may be lost for the smallest margin of
    the demonstrated actions, as `irl.baselines.linear_programming.lp` has it."""


def lp_advice(
    model: TransitionModel,
    demonstrations: Demonstrations,
    advice: Advice,
    *,
    gamma: float,
    config: TrustConfig | None = None,
    callback: Callback | None = None,
) -> np.ndarray:
    """Find a reward that explains the demonstrations and follows the advice (3.9).

    (3.9) values a policy, which needs an action in every state. Where none was demonstrated, or
    one that the expert wants avoided, the feasible actions that are not avoided are first taken
    evenly, and afterwards the best one under the reward found (a* of the thesis), until that
    changes nothing.

    Advice with one set only, preferred or avoided, sets it against the state's other feasible
    actions. Advice about infeasible actions has no effect.

    Args:
        model: the transition model.
        demonstrations: labelled pairs, of each state the most frequent is used; may be empty.
        advice: preferred and avoided actions.
        gamma: discount factor in [0, 1).
        config: how far either is trusted, and the program's limits.
        callback: told after each program how many were solved, and what the last one is worth.

    Returns:
        R, float64 ``[n_states]``, earned on entering a state.

    Raises:
        InputError: if a number is out of range, a demonstration is infeasible, a shape is wrong,
            or no reward within ±r_max meets the advice by δ.
        RuntimeError: if the solver stops without an optimum.
    """
    config = config or TrustConfig()
    shape = model.n_states, model.n_actions
    if advice.preferred.shape != shape or advice.avoided.shape != shape:
        raise InputError(f"advice: tables {list(shape)} wanted, got {list(advice.preferred.shape)}")
    hardness = reals(config.hardness, "hardness")
    if hardness.shape not in ((), (model.n_states,)) or not np.isfinite(hardness).all():
        raise InputError(f"hardness: one finite number or [{model.n_states}] of them wanted")
    demonstrations.check(model, "demonstrations")
    shown = demonstrations.counted.policy(model.n_states)

    lead, state = leads(model, shown)
    n_demonstrated = int(state.max(initial=-1)) + 1
    xi = sparse.csr_matrix(
        (np.ones(state.size), (np.arange(state.size), state)), shape=(state.size, n_demonstrated)
    )
    side, levels, least = _advice_rows(model, advice, np.broadcast_to(hardness, model.n_states))
    n_advised = levels.shape[1] // 2
    rows = sparse.vstack([lead, side], format="csr")
    extra = sparse.block_diag([xi, levels], format="csr")
    # ξ and the levels t are free, ζ are not negative.
    lower = np.concatenate([np.full(n_demonstrated + n_advised, -np.inf), np.zeros(n_advised)])
    weight = np.concatenate(
        [
            np.full(n_demonstrated, config.demonstration_trust),
            np.zeros(n_advised),
            np.full(n_advised, config.advice_trust),
        ]
    )
    least = np.concatenate([np.zeros(state.size), least])

    contradicted = (shown >= 0) & advice.avoided[np.arange(model.n_states), shown]
    kept = np.where(contradicted, -1, shown)
    left = _left(model, advice)
    policy = _even_choice(model, kept, left)
    for done in range(1, config.rounds + 1):
        program = RewardProgram(
            transition_matrix(model, policy), gamma, config.r_max, rows, extra, lower, least
        )
        objective = program.objective(1.0, weight)
        R, met = program.maximise(objective)
        if config.slack and R.any() and n_demonstrated:
            value = float(weight @ met) - float(np.abs(R).sum())
            R, met = program.untied(objective, value, met[:n_demonstrated], config.slack)
        if callback is not None:
            callback(done, float(weight @ met) - float(np.abs(R).sum()))
        _, Q = value_iteration(model, R, gamma)
        # With δ = 0 an avoided action may be as good as the best: a* is then another.
        greedy = np.where(model.widths > 0, np.where(left, Q, -np.inf).argmax(axis=1), -1)
        following = np.where(kept >= 0, kept, greedy)
        if np.array_equal(following, policy):
            break
        policy = following
    return R


def _left(model: TransitionModel, advice: Advice) -> np.ndarray:
    """Feasible actions that are not avoided ``[n_states, n_actions]``; all, where none is."""
    left = model.mask & ~advice.avoided
    return np.where(left.any(axis=1, keepdims=True), left, model.mask)


def _even_choice(model: TransitionModel, kept: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Probabilities ``[n_states, n_actions]``: as kept, else even among what is left."""
    left = np.where(kept[:, None] >= 0, np.arange(model.n_actions) == kept[:, None], left)
    return left / np.maximum(left.sum(axis=1, keepdims=True), 1)


def _advice_rows(
    model: TransitionModel, advice: Advice, hardness: np.ndarray
) -> tuple[sparse.csr_matrix, sparse.csr_matrix, np.ndarray]:
    """Rows P f ≥ t + ζ + δ for preferred pairs, −P f ≥ −t for avoided ones.

    Returns:
        P and −P ``[k, n_states]``; coefficients of t and ζ ``[k, 2 · advised]``; δ or 0 ``[k]``.
    """
    good = advice.preferred & model.mask
    bad = advice.avoided & model.mask
    one_sided = good.any(axis=1) ^ bad.any(axis=1)
    rest = model.mask & ~good & ~bad & one_sided[:, None]
    good, bad = good | (rest & bad.any(axis=1)[:, None]), bad | (rest & good.any(axis=1)[:, None])
    advised = good.any(axis=1) & bad.any(axis=1)
    place = np.cumsum(advised) - 1
    above = np.flatnonzero((good & advised[:, None])[model.pair_state, model.pair_action])
    below = np.flatnonzero((bad & advised[:, None])[model.pair_state, model.pair_action])
    above_at, below_at = place[model.pair_state[above]], place[model.pair_state[below]]
    n, k = int(advised.sum()), above.size
    column = np.concatenate([above_at, above_at + n, below_at])
    row = np.concatenate([np.arange(k), np.arange(k), k + np.arange(below.size)])
    sign = np.concatenate([np.ones(2 * k), -np.ones(below.size)])
    levels = sparse.csr_matrix((sign, (row, column)), shape=(k + below.size, 2 * n))
    delta = np.concatenate([hardness[model.pair_state[above]], np.zeros(below.size)])
    return sparse.vstack([model.P[above], -model.P[below]], format="csr"), levels, delta
