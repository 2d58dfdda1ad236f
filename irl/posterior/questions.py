"""Where to ask: the state whose answer is expected to tell most about goal and costs.

The gain of a question is the mutual information between its answer and the hypothesis, at the
likeliest β and ε: H(Σ_h w_h p_h) − Σ_h w_h H(p_h). An answer is an action, or that there is nothing
to do.
"""

import numpy as np

from irl.posterior.belief import Belief
from irl.posterior.evidence import BETAS, EPSILONS

_CANDIDATES = 1500  # states looked at before a question


def information_gain(belief: Belief, states: np.ndarray) -> np.ndarray:
    """Expected information of an answer in each state, in nats; float64 ``[len(states)]``."""
    model = belief.plans.model
    chosen, weight = belief.likely()
    widths = model.widths[states]
    first = np.cumsum(widths) - widths
    segment = np.repeat(np.arange(states.size), widths)
    pairs = np.arange(widths.sum()) - first[segment] + model.first_pair[states][segment]
    b, e = np.unravel_index(belief.care.argmax(), belief.care.shape)
    q = belief.values_of(chosen, pairs)
    p = np.exp(np.float32(BETAS[b]) * (q - np.maximum.reduceat(q, first)[segment]))
    p /= np.add.reduceat(p, first)[segment]
    epsilon = EPSILONS[e]
    p = (1 - epsilon) * p + epsilon / widths[segment, None]
    stops = belief.members(belief.goal[chosen])[states]
    p *= ~stops[segment]
    stopping = stops @ weight
    mixed = p @ weight
    of_mixture = np.add.reduceat(_information(mixed), first) + _information(stopping)
    of_each = np.add.reduceat(_information(p) @ weight, first)
    return of_mixture - of_each


def most_telling(belief: Belief, states: np.ndarray, rng: np.random.Generator) -> int:
    """The one of some states to ask about, or of as many of them as can be looked at."""
    some = rng.choice(states, min(_CANDIDATES, states.size), replace=False)
    return int(some[information_gain(belief, some).argmax()])


def _information(p: np.ndarray) -> np.ndarray:
    return -p * np.log(np.maximum(p, 1e-12))
