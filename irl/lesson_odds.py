"""Which answers are at odds with the rest: each one's likelihood when it alone is left out.

A posterior over goals and costs learns from all that was shown, slips included, and is then
weighed anew for each answer, as if that had not been given: w_h(−i) ∝ w_h / p_h(a_i). How likely
the answer is then, compared with the likeliest one in its state, says how odd it is: several
actions may be equally good, and none of them is odd.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from irl.demonstrations import Demonstrations
from irl.lesson_events import AUDIT, DONE, HELD_OUT, LEARN
from irl.lesson_taught import Taught
from irl.posterior.belief import Belief
from irl.posterior.evidence import BETAS, EPSILONS
from irl.posterior.learner import GoalConfig, GoalLearner
from irl.problem import LearningProblem

_MISTAKEN = 0.01  # probability of going on at a goal, and of ending where there is none
_HYPOTHESES = 64


@dataclass(frozen=True)
class Odds:
    """How an answer stands to the rest.

    Attributes:
        likelihood: its probability, by all that was shown but itself.
        ratio: the same over that of the likeliest answer in its state, 0 to 1; low is odd.
        likeliest: that answer: an action, or ``DONE``.
    """

    likelihood: float
    ratio: float
    likeliest: int


def at_odds(
    problem: LearningProblem, initial: Demonstrations, taught: Taught, rng: np.random.Generator
) -> list[dict[str, Any]]:
    """All answers of a lesson as plain values, the oddest first.

    None before anything was ever brought to its end: any answer then suits some goal. What was held
    out is neither judged nor learnt from.

    Args:
        problem: what is known beforehand.
        initial: what was demonstrated before the first question.
        taught: what was said.
        rng: draws hypotheses.

    Returns:
        Rows with ``answer`` (its number), ``state``, ``action``, and the fields of `Odds`.
    """
    answers = {n: a for n, a in taught.answers.items() if a.purpose != HELD_OUT}
    shown = Demonstrations.concatenate([initial, taught.demonstrations((LEARN, AUDIT))])
    if not (shown.state.size and shown.ends.size):
        return []
    said = [(answer.state, answer.action) for answer in answers.values()]
    each = odds(problem, shown, said, rng)
    rows = [
        {"answer": number, "state": answer.state, "action": answer.action, **vars(odd)}
        for (number, answer), odd in zip(answers.items(), each, strict=True)
    ]
    return sorted(rows, key=lambda row: (row["ratio"], row["answer"]))


def odds(
    problem: LearningProblem,
    shown: Demonstrations,
    answers: Sequence[tuple[int, int]],
    rng: np.random.Generator,
    config: GoalConfig | None = None,
) -> list[Odds]:
    """Leave each answer out in turn.

    Args:
        problem: what is known beforehand.
        shown: all that was shown, the answers included, one label or end each.
        answers: pairs of state and action, ``DONE`` for that nothing is to be done there.
        rng: draws hypotheses.
        config: how long they are sought.

    Raises:
        InputError: if nothing was shown.
    """
    learner = GoalLearner(problem, rng=rng, config=config)
    learner.learn(shown)
    belief = learner.belief
    chosen, weight = belief.likely(_HYPOTHESES)
    return [_of_one(belief, chosen, weight, state, action) for state, action in answers]


def _of_one(
    belief: Belief, chosen: np.ndarray, weight: np.ndarray, state: int, action: int
) -> Odds:
    model = belief.plans.model
    p = _probabilities(belief, chosen, state)
    row = -1 if action == DONE else int(model.pair_index(state, action) - model.first_pair[state])
    without = weight / np.maximum(p[row], 1e-300)
    mixed = p @ (without / without.sum())
    best = int(mixed.argmax())
    is_end = best == len(mixed) - 1
    likeliest = DONE if is_end else int(model.pair_action[model.first_pair[state] + best])
    return Odds(float(mixed[row]), float(mixed[row] / mixed[best]), likeliest)


def _probabilities(belief: Belief, chosen: np.ndarray, state: int) -> np.ndarray:
    """Of each action of a state, and last of *done*, under each hypothesis: ``[m + 1, n]``."""
    model = belief.plans.model
    b, e = np.unravel_index(belief.care.argmax(), belief.care.shape)
    width = int(model.widths[state])
    pairs = model.first_pair[state] + np.arange(width)
    q = belief.values_of(chosen, pairs).astype(np.float64)
    p = np.exp(BETAS[b] * (q - q.max(axis=0, initial=-np.inf)))
    p = (1 - EPSILONS[e]) * p / np.maximum(p.sum(axis=0), 1e-300) + EPSILONS[e] / max(width, 1)
    at_goal = belief.members(belief.goal[chosen])[state]
    ends = np.where(at_goal, 1 - _MISTAKEN, _MISTAKEN)
    return np.vstack([p * (1 - ends), ends])
