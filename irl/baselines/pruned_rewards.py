"""Fewer rewards than a sparse fit finds, where they explain the labels as well.

A handful of labels is explained as well by a reward on the way as by the goal alone. Where runs are
known to have ended, rewards there say all that rewards of states can say safely: the plan leads to
where the demonstrator went. Where nobody says so, the rewards above half the largest are tried.

Whether they are enough the labels tell, and nobody else is asked: the plan for the few must make as
many demonstrated actions the best of their states as the plan for all. Who goes out of the way of
something that costs, or wants to be in two places, is not explained by fewer, and all are kept.
"""

import numpy as np

from irl.demonstrations import Demonstrations
from irl.mdp import TransitionModel
from irl.planning import value_iteration

_LARGE = 0.5  # share of the largest reward from which on rewards are kept
_EQUAL = 1e-9  # share of the largest |Q| by which equally good actions may differ


def pruned(
    model: TransitionModel, shown: Demonstrations, reward: np.ndarray, gamma: float
) -> np.ndarray:
    """Keep what is needed of a reward.

    Args:
        model: the transition model.
        shown: what was demonstrated, and where runs ended, if that is known.
        reward: R ``[n_states]``, earned on entering a state.
        gamma: discount factor in [0, 1).

    Returns:
        R ``[n_states]``: the largest reward wherever runs ended; or the large ones alone; or all
        as it was, if it pays nothing or fewer explain fewer labels.
    """
    most = reward.max(initial=0.0)
    if most <= 0:
        return reward
    few = np.where(reward > _LARGE * most, reward, 0.0)
    if shown.ends.size:
        few = np.zeros_like(reward)
        few[shown.ends[:, 2]] = most
    same = _explained(model, shown, few, gamma) >= _explained(model, shown, reward, gamma)
    return few if same else reward


def _explained(
    model: TransitionModel, shown: Demonstrations, reward: np.ndarray, gamma: float
) -> int:
    """How many labels are a best action of their state."""
    _, q = value_iteration(model, reward, gamma)
    said = shown.counted
    own = q[said.state, said.action]
    scale = np.abs(q[np.isfinite(q)]).max(initial=0.0)
    return int(said.count @ (own >= q[said.state].max(axis=1) - _EQUAL * scale))
