"""Policies that are known in some states only, as demonstrations tell them."""

import numpy as np

from irl.errors import InputError
from irl.integers import reals
from irl.mdp import TransitionModel


def checked_policy(model: TransitionModel, policy: np.ndarray) -> np.ndarray:
    """A policy as an array, integer ``[n_states]``, −1 where a run ends.

    Raises:
        InputError: if it has a wrong shape or type or names an action that is not feasible.
    """
    policy = np.asarray(policy)
    if policy.shape != (model.n_states,) or not np.issubdtype(policy.dtype, np.integer):
        raise InputError(
            f"policy: integer [{model.n_states}] wanted, got {policy.dtype} {list(policy.shape)}"
        )
    states = np.arange(model.n_states)
    for s in np.flatnonzero((policy != -1) & (model.pair_index(states, policy) < 0))[:1]:
        raise InputError(
            f"state {s}, action {policy[s]} is not feasible",
            place="policy",
            valid=(*model.actions_of(s), "-1 where a run ends"),
        )
    return policy


def completed(
    model: TransitionModel, policy: np.ndarray, elsewhere: np.ndarray | None
) -> np.ndarray:
    """What is valued: a policy, and where it is −1 and something can be done, what is done there.

    Args:
        model: the transition model.
        policy: integer ``[n_states]``, −1 for none.
        elsewhere: probabilities ``[n_states, n_actions]``; None where a run ends there.

    Returns:
        ``policy``, or probabilities ``[n_states, n_actions]``.

    Raises:
        InputError: if ``elsewhere`` has a wrong shape, or holds what is no probability.
    """
    if elsewhere is None:
        return policy
    table = reals(elsewhere, "elsewhere")
    if table.shape != model.mask.shape or not ((table >= 0) & (table <= 1)).all():
        raise InputError(
            f"probabilities {list(model.mask.shape)} wanted, got {list(table.shape)}",
            place="elsewhere",
        )
    return np.where(policy[:, None] >= 0, np.arange(model.n_actions) == policy[:, None], table)
