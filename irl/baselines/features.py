"""What the linear baselines know of a state, or of a state and what is done there."""

from typing import TypeAlias

import numpy as np
from scipy import sparse

from irl.errors import InputError
from irl.integers import reals
from irl.mdp import TransitionModel

Features: TypeAlias = np.ndarray | sparse.csr_matrix


def state_features(model: TransitionModel, features: np.ndarray | None) -> Features:
    """Features Φ as float64 ``[n_states, d]``; one indicator per state, sparse, if absent.

    Raises:
        InputError: if they are not finite or have a wrong shape.
    """
    if features is None:
        return sparse.identity(model.n_states, format="csr")
    features = reals(features, "features")
    if (
        features.ndim != 2
        or len(features) != model.n_states
        or features.shape[1] == 0
        or not np.isfinite(features).all()
    ):
        raise InputError(
            f"features: finite values [{model.n_states}, d] wanted, got {list(features.shape)}"
        )
    return features


def reward_features(model: TransitionModel, features: np.ndarray | None) -> tuple[Features, bool]:
    """Φ of R = Φ ω (3.10), and whether its rows are pairs.

    A reward is earned on entering a state, or, if features are those of pairs, by acting.

    Args:
        model: the transition model.
        features: ``[n_states, d]``; ``[n_states, n_actions, d]``, of pairs, where what is
            infeasible is ignored; or None, one indicator per state.

    Returns:
        ``[n_states, d]`` or ``[n_pairs, d]``, and whether it is the latter.

    Raises:
        InputError: if they are not finite or have a wrong shape.
    """
    if features is None or np.ndim(features) != 3:
        return state_features(model, features), False
    table = reals(features, "features")
    if table.shape[:2] != (model.n_states, model.n_actions):
        raise InputError(
            f"finite values [{model.n_states}, {model.n_actions}, d] of pairs wanted, got "
            f"{list(table.shape)}",
            place="features",
        )
    each = table[model.pair_state, model.pair_action]
    for pair in np.flatnonzero(~np.isfinite(each).all(axis=1))[:1]:
        raise InputError(
            f"must be finite, are not in state {model.pair_state[pair]} for action "
            f"{model.pair_action[pair]}",
            place="features",
        )
    return each, True
