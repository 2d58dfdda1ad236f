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


def arrival(model: TransitionModel, q: np.ndarray, goals: np.ndarray, starts: np.ndarray) -> float:
    """Probability of reaching a goal within `HORIZON` by the best actions, mean over the starts.

    Args:
        model: the transition model.
        q: action values ``[n_states, n_actions]``; −∞ where infeasible.
        goals: indices of states.
        starts: indices of states.
    """
    action = Policy.from_q(q, model.mask).action
    return float(policy_success(model, action, goals, HORIZON)[starts].mean())


def arriving(
    values: Callable[[float], np.ndarray],
    model: TransitionModel,
    goals: np.ndarray,
    starts: np.ndarray,
    leanings: Sequence[float] = LEANINGS,
) -> tuple[float, np.ndarray]:
    """The first of some leanings that arrives from all starts but `SHORT`, and its values.

    If none does, that which arrives from most, of those within `SHORT` of it the first.

    Args:
        values: action values ``[n_states, n_actions]`` of a leaning.
        model: the transition model.
        goals: indices of states.
        starts: indices of states.
        leanings: at least one.
    """
    found = []
    for leaning in leanings:
        q = values(leaning)
        found.append((arrival(model, q, goals, starts), leaning, q))
        if found[-1][0] >= 1.0 - SHORT:
            break
    most = max(reached for reached, _, _ in found)
    return next((leaning, q) for reached, leaning, q in found if reached >= most - SHORT)
