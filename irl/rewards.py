"""What acting is expected to earn, from rewards of states, of pairs and of moves."""

import numpy as np

from irl.errors import InputError
from irl.integers import reals
from irl.mdp import TransitionModel


def pair_rewards(model: TransitionModel, reward: np.ndarray) -> np.ndarray:
    """What acting is expected to earn, float64 ``[n_pairs]``: ``pair_reward`` of `irl.planning`.

    Args:
        model: the transition model.
        reward: ``[n_states]``, earned in the state acted in; ``[n_states, n_actions]``, by acting;
            or ``[n_states, n_actions, n_states]``, by coming from one state to another.

    Raises:
        InputError: if the shape is another, or a reward of a feasible pair is not finite.
    """
    table = reals(reward, "reward")
    n, m = model.n_states, model.n_actions
    state, action = model.pair_state, model.pair_action
    if table.shape == (n,):
        earned = table[state]
    elif table.shape == (n, m):
        earned = table[state, action]
    elif table.shape == (n, m, n):
        P = model.P.tocoo()
        each = P.data * table[state[P.row], action[P.row], P.col]
        earned = np.bincount(P.row, each, minlength=model.n_pairs)
    else:
        raise InputError(
            f"[{n}], [{n}, {m}] or [{n}, {m}, {n}] wanted, got {list(table.shape)}", place="reward"
        )
    for pair in np.flatnonzero(~np.isfinite(earned))[:1]:
        raise InputError(
            f"must be finite, is {earned[pair]} in state {state[pair]} for action {action[pair]}",
            place="reward",
        )
    return earned


def earned_by_acting(
    model: TransitionModel,
    reward: np.ndarray,
    pair_reward: np.ndarray | float = 0.0,
) -> np.ndarray:
    """What acting is expected to earn under a reward such as methods learn, float64 ``[n_pairs]``.

    Args:
        model: the transition model.
        reward: R ``[n_states]``, earned on entering a state, or ``[n_states, n_actions]``, by
            acting.
        pair_reward: ``[n_pairs]`` or one number, earned by acting as well.

    Raises:
        InputError: if a reward is not finite or has a wrong shape.
    """
    table, each = reals(reward, "state_reward"), reals(pair_reward, "pair_reward")
    if each.shape not in ((), (model.n_pairs,)) or not np.isfinite(each).all():
        raise InputError(
            f"one finite number wanted, or [{model.n_pairs}], got {list(each.shape)}",
            place="pair_reward",
        )
    if table.shape == (model.n_states, model.n_actions):
        return pair_rewards(model, table) + each
    if table.shape != (model.n_states,) or not np.isfinite(table).all():
        raise InputError(
            f"finite numbers [{model.n_states}] wanted, or of pairs "
            f"[{model.n_states}, {model.n_actions}], got {list(table.shape)}",
            place="state_reward",
        )
    with np.errstate(over="ignore"):  # infinite, which whoever plans for it refuses
        return model.P @ table + each
