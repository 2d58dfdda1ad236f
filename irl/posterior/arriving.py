"""Values that lead to the goal: what states are worth, and what actions cost besides.

A mean over hypotheses, as a network's fit, belongs to no one plan, and who acts by it may go round
in circles between states each of which prefers the other. What states are worth rises with every
action of a plan. So where acting by some values would not arrive, that is leant on, by as little as
does.
"""

from collections.abc import Callable, Sequence

import numpy as np

from irl.mdp import TransitionModel
from irl.planning import policy_success
from irl.policy import Policy
from irl.posterior.predictions import HORIZON

LEANINGS = (0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 3.0)
"""How much more what states are worth may count, tried in this order."""
SHORT = 0.005
"""Share of the starts that need not arrive."""
HELPS = 0.05
"""By how much likelier a state must lead to the goal for other values to be taken there."""


def arrives(model: TransitionModel, q: np.ndarray, goals: np.ndarray) -> np.ndarray:
    """Probability of reaching a goal within `HORIZON` by the best actions, float64 ``[n_states]``.

    Args:
        model: the transition model.
        q: action values ``[n_states, n_actions]``; −∞ where infeasible.
        goals: indices of states.
    """
    return policy_success(model, Policy.from_q(q, model.mask).action, goals, HORIZON)


def arriving(
    values: Callable[[float], np.ndarray],
    model: TransitionModel,
    goals: np.ndarray,
    starts: np.ndarray,
    leanings: Sequence[float] = LEANINGS,
) -> np.ndarray:
    """Values without any leaning, but in the states from which it helps to arrive.

    There they are those of the first leaning by which all starts but `SHORT` arrive; if none does,
    of that by which most do.

    Args:
        values: action values ``[n_states, n_actions]`` of a leaning.
        model: the transition model.
        goals: indices of states.
        starts: indices of states.
        leanings: at least one, the first of which is none.
    """
    alone, *others = leanings
    q = own = values(alone)
    reached = arrives(model, own, goals)
    most = reached[starts].mean()
    for leaning in others:
        if most >= 1.0 - SHORT:
            break
        leant = values(leaning)
        helps = arrives(model, leant, goals) >= reached + HELPS
        mixed = np.where(helps[:, np.newaxis], leant, own)
        share = arrives(model, mixed, goals)[starts].mean()
        if share > most:
            q, most = mixed, share
    return q
