"""What the linear baselines know of a state."""

from typing import TypeAlias

import numpy as np
from scipy import sparse

from irl.errors import InputError
from irl.mdp import TransitionModel

Features: TypeAlias = np.ndarray | sparse.csr_matrix


def state_features(model: TransitionModel, features: np.ndarray | None) -> Features:
    """Features Φ as float64 ``[n_states, d]``; one indicator per state, sparse, if absent.

    Raises:
        InputError: if they are not finite or have a wrong shape.
    """
    if features is None:
        return sparse.identity(model.n_states, format="csr")
    features = np.asarray(features, dtype=np.float64)
    if features.ndim != 2 or len(features) != model.n_states or not np.isfinite(features).all():
        raise InputError(
            f"features: finite values [{model.n_states}, d] wanted, got {list(features.shape)}"
        )
    return features
