"""What to ask next: what brings most for each second of the teacher.

A question's gain is what the learner expects to learn from the answer, by its own score; what it
costs is the time that the teacher takes, the median of this lesson's answers of its kind. The
further step of a trajectory that is under way is cheap, for the teacher has the scene before them;
to take in another is taken for 4 s more until the lesson's own times are known.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from irl.choices import check_choice
from irl.mdp import TransitionModel
from irl.planning import transition_matrix

HORIZON = 20
"""Actions that visits are counted over."""
_OFTEN, _APART = 300, 200  # states looked at: where the policy goes, and spread over all
STEP, STATE, TRAJECTORY, ADVICE = "step", "state", "trajectory", "advice"
KINDS = (STEP, STATE, TRAJECTORY, ADVICE)
"""A further step of the trajectory under way, a state by itself, the whole of a new trajectory, and
advice about a cluster. Of equals the first is chosen."""
PRIORS: Mapping[str, float] = {
    STEP: 4.0,
    STATE: 8.0,
    TRAJECTORY: 8.0,
    ADVICE: 30.0,
}
"""Seconds of each kind before any was measured; of a trajectory those of its first answer."""
DOUBT = 0.05
"""An action is surely good, or surely not, up to this probability of the contrary."""


@dataclass(frozen=True)
class Offer:
    """Something that may be asked.

    Attributes:
        kind: a name in `KINDS`.
        gain: what is expected to be learnt from each answer, in the learner's score, 0 or more.
        answers: how many it takes; all but the first are steps.
        state: what it is about: a state,
        cluster: or a cluster.
    """

    kind: str
    gain: float
    answers: int = 1
    state: int | None = None
    cluster: str = ""

    def __post_init__(self) -> None:
        """Refuse a kind that there is none of."""
        check_choice("kind", self.kind, KINDS)


@dataclass(frozen=True)
class Worth:
    """An offer with its price: all that it brings, and the seconds that it takes."""

    offer: Offer
    gain: float
    seconds: float

    @property
    def rate(self) -> float:
        """Gain per second."""
        return self.gain / self.seconds


def measured_seconds(times: Iterable[tuple[str, float]]) -> dict[str, float]:
    """Seconds that a question of each kind takes this teacher.

    Args:
        times: kind and seconds of each answer so far; those without a time, 0, tell nothing.

    Returns:
        For each of `KINDS` the median, or what `PRIORS` says if there is none.
    """
    of_kind: dict[str, list[float]] = {kind: [] for kind in KINDS}
    for kind, seconds in times:
        if 0 < seconds < np.inf:
            of_kind[kind].append(seconds)
    return {kind: float(np.median(s)) if s else PRIORS[kind] for kind, s in of_kind.items()}


def choose(
    offers: Iterable[Offer], seconds: Mapping[str, float], left: float = np.inf
) -> Worth | None:
    """The offer that brings most for each second of the teacher; None if none brings anything.

    Args:
        offers: what may be asked.
        seconds: of each kind, see `measured_seconds`.
        left: all that is left to learn. Answers in a row tell in part the same, and what several
            bring, taken together here, is never more than this.
    """
    priced = [
        Worth(each, min(each.gain * each.answers, left), _price(each, seconds))
        for each in sorted(offers, key=lambda offer: KINDS.index(offer.kind))
        if each.gain > 0
    ]
    return max(priced, key=lambda worth: worth.rate, default=None)


def _price(offer: Offer, seconds: Mapping[str, float]) -> float:
    return seconds[offer.kind] + (offer.answers - 1) * seconds[STEP]


def toss_up(good: np.ndarray) -> np.ndarray:
    """Whether all that is in question is which of several actions, any of which will do.

    A teacher can only toss a coin there, and what they say tells little of what they want.

    Args:
        good: probability that an action is as good as the best, ``[..., n_actions]``; NaN where it
            cannot be done.

    Returns:
        Bool ``[...]``.
    """
    surely = good >= 1 - DOUBT
    settled = (surely | (good <= DOUBT) | np.isnan(good)).all(axis=-1)
    return settled & (surely.sum(axis=-1) > 1)


def as_good_as_best(q: np.ndarray, tolerance: float) -> np.ndarray:
    """`toss_up`'s ``good`` where only one set of values is believed: 1 or 0.

    Values that tell no action from another are not known yet: ½.

    Args:
        q: action values ``[..., n_actions]``; −∞ where infeasible.
        tolerance: up to this share of a state's range of values the best are equally good.
    """
    feasible = np.isfinite(q)
    best = q.max(axis=-1, keepdims=True)
    worst = np.where(feasible, q, best).min(axis=-1, keepdims=True)
    with np.errstate(invalid="ignore"):
        good = (best - q <= tolerance * (best - worst)).astype(np.float64)
    return np.where(feasible, np.where(best > worst, good, 0.5), np.nan)


def visits(model: TransitionModel, action: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Expected visits of a policy in `HORIZON` actions, from starts alike; ``[n_states]``.

    Args:
        model: the transition model.
        action: the policy, int64 ``[n_states]``, −1 for none.
        starts: indices of the states where runs begin.
    """
    onward = transition_matrix(model, action).T.tocsr()
    here = np.zeros(model.n_states)
    here[starts] = 1 / starts.size
    total = here.copy()
    for _ in range(HORIZON - 1):
        here = onward @ here
        total += here
    return total


def looked_at(acting: np.ndarray, visited: np.ndarray, asked: np.ndarray) -> np.ndarray:
    """The states whose gain is worked out, for that of all would take seconds; distinct, sorted.

    Args:
        acting: states where something can be done.
        visited: of each state, `visits`.
        asked: states that are to be among them.
    """
    often = acting[np.argsort(-visited[acting], kind="stable")[:_OFTEN]]
    apart = acting[np.linspace(0, acting.size - 1, min(_APART, acting.size)).astype(np.int64)]
    return np.unique(np.concatenate([often, apart, np.intersect1d(asked, acting)]))
