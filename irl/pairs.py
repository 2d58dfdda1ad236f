"""A state–action pair as one integer, its *key*: ``state · n_actions + action``.

Keys sort as pairs do, by state and then by action. `models.task.pairs` has the same for the
grasping task's own number of actions: neither package may import the other.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def pair_key(state: ArrayLike, action: ArrayLike, n_actions: int) -> NDArray[np.int64]:
    """Key of each pair, int64; shapes broadcast."""
    return np.asarray(state, dtype=np.int64) * n_actions + np.asarray(action, dtype=np.int64)


def split_key(key: ArrayLike, n_actions: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """State and action of each key, int64."""
    state, action = np.divmod(np.asarray(key, dtype=np.int64), n_actions)
    return state, action
