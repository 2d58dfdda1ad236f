"""Boltzmann choice among each state's own feasible actions."""

import numpy as np

from irl.mdp import TransitionModel


def acting_states(model: TransitionModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The states that have actions, and how the pairs are grouped by them.

    Returns:
        states int64 ``[m]``; first int64 ``[m]``, where each one's pairs begin; and segment
        int64 ``[n_pairs]``, the position in states that each pair belongs to.
    """
    width = np.diff(model.first_pair)
    states = np.flatnonzero(width)
    return states, model.first_pair[states], np.repeat(np.arange(states.size), width[states])


def log_sum_exp(z: np.ndarray, first: np.ndarray, segment: np.ndarray) -> np.ndarray:
    """Logarithm of Σ exp z over each group of neighbours in ``z``, without overflow.

    Args:
        z: ``[n]``.
        first: ``[m]``, where each group begins; none is empty.
        segment: ``[n]``, the group that each entry belongs to.

    Returns:
        float64 ``[m]``; ``z - result[segment]`` are log-probabilities.
    """
    if not first.size:
        return np.zeros(0)
    peak = np.maximum.reduceat(z, first)
    return np.log(np.add.reduceat(np.exp(z - peak[segment]), first)) + peak
