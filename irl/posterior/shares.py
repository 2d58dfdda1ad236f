"""How many combinations of sizes a hypothesis stands for: its own, and neighbours not planned for.

Of the sizes of one cost nearly all are planned for, and of several at once few of very many. Would
one leave out what was not planned for, few costs seemed likelier than many for no other reason. So
a combination that was not is taken to be as likely as its neighbours that were: every cost that
matters is a step larger there, a step smaller, or the same.
"""

from itertools import product

import numpy as np

_TOGETHER = 6
"""Costs that may be a step larger or smaller at once; where more matter, one at a time is."""


def stands_for(goal: np.ndarray, level: np.ndarray, most: int) -> np.ndarray:
    """The number of combinations that each hypothesis stands for.

    One that several might stand for is shared among them evenly.

    Args:
        goal: a number, int64 ``[n]``.
        level: of every cost, from 0, which is none, to ``most``; int64 ``[n, n_costs]``. No two
            hypotheses have the same goal and levels.
        most: the largest level.

    Returns:
        float64 ``[n]``, from 1.
    """
    total, matters = np.ones(len(goal)), level > 0
    # Sums of random multiples tell combinations apart, however many costs there are.
    marks = np.random.default_rng(0).integers(1, 2**62, level.shape[1] + 1)
    known = np.sort(level @ marks[:-1] + goal * marks[-1])
    for kind in np.unique(matters, axis=0):
        some = np.flatnonzero((matters == kind).all(axis=1))
        near = level[some][:, None, :] + _steps(kind)
        key = near @ marks[:-1] + (goal[some] * marks[-1])[:, None]
        place = np.minimum(np.searchsorted(known, key), known.size - 1)
        fresh = (((near >= 1) & (near <= most)) | ~kind).all(axis=2) & (known[place] != key)
        _, which, sharers = np.unique(key[fresh], return_inverse=True, return_counts=True)
        each = np.zeros(key.shape)
        each[fresh] = 1 / sharers[which]
        total[some] += each.sum(axis=1)
    return total


def _steps(kind: np.ndarray) -> np.ndarray:
    """The steps to neighbours, int64 ``[m, n_costs]``; ``kind``: which costs matter."""
    if kind.sum() > _TOGETHER:
        one = np.diag(kind.astype(np.int64))[kind]
        return np.concatenate([one, -one])
    return np.array(list(product(*((-1, 0, 1) if on else (0,) for on in kind))), dtype=np.int64)
