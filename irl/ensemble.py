"""Knowing when it is enough without a posterior: members that learnt from parts of what was shown.

Each member learns from some 63 % of the labels, as many as a bootstrap leaves, none counted twice.
What members disagree about is not settled by what was shown. So a learner predicts that it is as
often right as its members let its action pass. Whether it gets to where runs ended needs no
members: that follows from the transition model. Like every rule that asks labels alone, this one is
blind to what no member can say.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from irl.demonstrations import Demonstrations
from irl.mdp import TransitionModel
from irl.metrics import success_mdp
from irl.policy import Policy
from irl.posterior.predictions import Predicted

KEPT = 1 - math.exp(-1)
"""Share of the labels that a member learns from: those that a bootstrap draws once or more."""
SUCCESS, ACCURACY, IN_A_ROW = 0.99, 0.95, 2
"""What must be predicted, and at how many checks in a row."""


@dataclass(frozen=True, eq=False)
class Member:
    """What was learnt once.

    Attributes:
        q: action values, float64 ``[n_states, n_actions]``; −∞ where infeasible.
        beta: the inverse temperature that they are read with.
    """

    q: np.ndarray
    beta: float

    def action(self, model: TransitionModel) -> np.ndarray:
        """The policy, int64 ``[n_states]``; −1 for none."""
        return Policy.from_q(self.q, model.mask).action

    def lets_pass(self, states: np.ndarray, action: np.ndarray) -> np.ndarray:
        """Whether it holds an action for at least half as likely as its own, bool ``[n]``.

        Args:
            states: int64 ``[n]``.
            action: a feasible one of each, int64 ``[n]``.
        """
        short = self.q[states].max(axis=1) - self.q[states, action]
        return np.asarray(self.beta * short <= np.log(2))


def part_of(shown: Demonstrations, rng: np.random.Generator) -> Demonstrations:
    """What a member learns from: some of the labels, at least one, and where runs ended.

    An end goes with its run, if none of that is left.
    """
    kept = rng.random(len(shown)) < KEPT
    if len(shown) and not kept.any():
        kept[rng.integers(len(shown))] = True
    return shown.select(kept)


def predicted(
    model: TransitionModel,
    own: Member,
    others: Sequence[Member],
    ends: np.ndarray,
    starts: np.ndarray,
    judged: np.ndarray,
) -> Predicted:
    """How well the policy of ``own`` is going to do: where it arrives, and what the others say.

    Args:
        model: the transition model.
        own: learnt from all that was shown.
        others: from parts of it.
        ends: states where runs ended, int64.
        starts: states that runs start in, int64.
        judged: states that accuracy is taken over, int64.
    """
    action = own.action(model)
    judged = judged[action[judged] >= 0]
    agreed = [each.lets_pass(judged, action[judged]).mean() for each in others]
    arrives = success_mdp(model, action, ends, starts) if ends.size else 0.0
    return Predicted(arrives, float(np.mean(agreed)))


@dataclass
class EnsembleRule:
    """Says that it is enough when predictions were good at two checks in a row.

    Attributes:
        passed: checks in a row that were passed.
    """

    passed: int = field(default=0, init=False)

    def __call__(self, told: Predicted) -> bool:
        """Check once; True when it is enough."""
        good = told.success >= SUCCESS and told.accuracy >= ACCURACY
        self.passed = self.passed + 1 if good else 0
        return self.passed >= IN_A_ROW
