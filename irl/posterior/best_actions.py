"""The best of each state's actions, for many hypotheses at once.

This is where planning for many hypotheses spends its time: half a million rows are picked, and of
each state's the largest entries kept. Where numba is there it is compiled; otherwise NumPy comes
to the same bits, some ten times as slowly.
"""

from collections.abc import Callable
from functools import cache

import numpy as np

_AT_ONCE = 64  # groups whose rows stay in the processor's cache together


def best_actions(
    ahead: np.ndarray, dear: np.ndarray, led: np.ndarray, paid: np.ndarray, first: np.ndarray
) -> np.ndarray:
    """Largest over each group's pairs i of ``ahead[led[i]] − dear[paid[i]]``, column by column.

    Args:
        ahead: what each distribution leads to, float32 ``[n_distributions, n]``, C-contiguous.
        dear: what each kind of cost comes to, float32 ``[n_kinds, n]``, C-contiguous.
        led: each pair's distribution, int32 ``[n_pairs]``.
        paid: each pair's kind of cost, int32 ``[n_pairs]``.
        first: where each group begins, and the number of pairs, int64 ``[n_groups + 1]``.

    Returns:
        float32 ``[n_groups, n]``.
    """
    compiled = _compiled()
    if compiled is None:
        return _by_numpy(ahead, dear, led, paid, first)
    best = np.empty((first.size - 1, ahead.shape[1]), dtype=np.float32)
    compiled(ahead, dear, led, paid, first, best)
    return best


def _by_numpy(
    ahead: np.ndarray, dear: np.ndarray, led: np.ndarray, paid: np.ndarray, first: np.ndarray
) -> np.ndarray:
    best = np.empty((first.size - 1, ahead.shape[1]), dtype=np.float32)
    for k in range(0, len(best), _AT_ONCE):
        begins = first[k : k + _AT_ONCE + 1]
        pairs = slice(begins[0], begins[-1])
        left = ahead[led[pairs]] - dear[paid[pairs]]
        best[k : k + _AT_ONCE] = np.maximum.reduceat(left, begins[:-1] - begins[0], axis=0)
    return best


@cache
def _compiled() -> Callable[..., None] | None:
    try:
        # What learns without it need not wait for it, nor have it.
        from numba import njit  # noqa: PLC0415
    except ImportError:
        return None
    # Without NaNs a maximum takes one instruction for many columns.
    return njit(cache=True, nogil=True, fastmath={"nnan", "nsz"})(_keep_best)


def _keep_best(
    ahead: np.ndarray,
    dear: np.ndarray,
    led: np.ndarray,
    paid: np.ndarray,
    first: np.ndarray,
    best: np.ndarray,
) -> None:
    for group in range(first.size - 1):
        kept = best[group]
        kept[:] = -np.inf
        for pair in range(first[group], first[group + 1]):
            gained, spent = ahead[led[pair]], dear[paid[pair]]
            for column in range(kept.size):
                left = gained[column] - spent[column]
                kept[column] = left if left > kept[column] else kept[column]
