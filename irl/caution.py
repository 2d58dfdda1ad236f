"""How much a demonstrator minds uncertain outcomes: a number u, which no reward of states can say.

Labels of one run tell next to nothing of it: what is certain is mostly as good without it. So u has
a posterior, with the prior that `irl.posterior` has for every cost; and who plans with the mean of
what is paid can expect to lose least (Ramachandran & Amir 2007, Theorem 3).
"""

from dataclasses import replace

import numpy as np
from scipy.special import logsumexp, softmax

from irl.baselines.differentiable_planning import Planner
from irl.demonstrations import Demonstrations
from irl.mdp import TransitionModel
from irl.posterior.belief import LOG_PRIOR, SIZES
from irl.posterior.evidence import Evidence

_TOLERANCE = 1e-7
"""Largest error of a plan's values, as a share of the largest |f|."""


def learn_caution(
    model: TransitionModel, shown: Demonstrations, reward: np.ndarray, gamma: float
) -> float:
    """Learn u of Q = P f − u (1 − max P), the reward being given: the mean of its posterior.

    Args:
        model: the transition model.
        shown: labelled pairs.
        reward: R ``[n_states]``, earned on entering a state.
        gamma: discount factor in [0, 1).

    Returns:
        u, from 0, in the reward's unit; 0 where outcomes are alike uncertain whatever is done, and
        where nothing pays or costs.

    Raises:
        InputError: if a pair is infeasible, or the reward is not finite or has a wrong shape.
    """
    doubt, earned = model.surprise, model.P @ reward
    if not np.ptp(doubt) > 0:
        return 0.0
    most = float(np.abs(Planner(model, gamma).solve(reward)).max(initial=0.0))
    if most == 0:
        return 0.0
    planner = Planner(model, gamma, of_pairs=True, tolerance=_TOLERANCE)
    # In the unit of `irl.posterior`, where a goal is worth 1.
    said = Evidence.of(model, replace(shown, ends=np.zeros((0, 3), dtype=np.int64)))
    nowhere = np.zeros((model.n_states, 1), dtype=bool)
    likely = [
        said.log_likelihood(planner.solve(earned / most - size * doubt)[said.pairs, None], nowhere)
        for size in SIZES
    ]
    weight = softmax(logsumexp(np.concatenate(likely), axis=(1, 2)) + LOG_PRIOR)
    return most * float(weight @ SIZES)
