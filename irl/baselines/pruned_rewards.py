"""Fewer rewards than a sparse fit finds: those that lead to where demonstrations ended.

A handful of labels is explained as well by a reward on the way as by the goal alone, and a wrong
label by a reward of its own. Where runs are known to have ended, rewards there say all that rewards
of states can say safely: the plan leads to where the demonstrator went. Where nobody says so, the
rewards above half the largest are kept, if that tells the demonstrations in fewer words: to name a
state with a reward takes log n_states, to name the action of a label that the plan does not explain
log n_actions.
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
        as it was, if it pays nothing or fewer rewards take more words.
    """
    most = reward.max(initial=0.0)
    if most <= 0:
        return reward
    if shown.ends.size:
        few = np.zeros_like(reward)
        few[shown.ends[:, 2]] = most
        return few
    few = np.where(reward > _LARGE * most, reward, 0.0)
    words = (_words(model, shown, each, gamma) for each in (few, reward))
    return few if next(words) <= next(words) else reward


def _words(
    model: TransitionModel, shown: Demonstrations, reward: np.ndarray, gamma: float
) -> float:
    """Length of the shortest account of labels by a reward, in nats."""
    _, q = value_iteration(model, reward, gamma)
    said = shown.counted
    own = q[said.state, said.action]
    scale = np.abs(q[np.isfinite(q)]).max(initial=0.0)
    unexplained = said.count @ (own < q[said.state].max(axis=1) - _EQUAL * scale)
    return float(
        np.count_nonzero(reward) * np.log(model.n_states) + unexplained * np.log(model.n_actions)
    )
