"""PolicyUpdate of thesis Algorithm 4.1: action values from a VR function, at once or planned.

``greedy`` is the thesis': what an action leads to is worth what f says. Where labels are few, f has
hilltops of its own, a little above all that can be reached from there; whoever climbs it stays on
them, and goes round in circles. By (3.18) such a hilltop is a reward for staying. ``planned`` takes
that reward for an error of the fit, unless a demonstrator was seen to stay: no state earns more
than most states do, except where demonstrations ended. What is then worth what is planned anew.
Whatever f says that a state *costs* remains.

An expert may be wrong, and to avoid what is right can cost the way to where demonstrations ended.
What is avoided in a state is therefore not heeded there if, by the learner's own account, a run
would get to such an end less often than without advice. With ``avoid="doubt"``, the default, it is
not heeded either where all that is left is worse, by the values learnt without advice, by more than
half of what one action more on the way costs. ``"mask"`` obeys there: labels may be too few to
tell. By that right advice gains a little more, and wrong advice costs much.
"""

from dataclasses import dataclass

import numpy as np

from irl.advice import Advice
from irl.mdp import TransitionModel
from irl.planning import best, policy_success, value_iteration
from irl.policy import Policy

POLICY_UPDATES = ("greedy", "planned")
HORIZON = 20
"""Actions within which a run is to end."""
_NEVER = -1e3
"""What an excluded action earns: f lies within ±1, and no plan is worth as little."""
_LESS = 1e-3  # by how much less often a run may end for the sake of advice
_DOUBT = 0.5  # what advice may cost, as a share of what one action more costs


@dataclass(frozen=True, eq=False)
class PolicyUpdate:
    """UpdateQ and PolicyUpdate of thesis Algorithm 4.1: from f and advice to action values.

    Attributes:
        model: the transition model.
        gamma: discount factor in [0, 1).
        kind: a name in ``POLICY_UPDATES``.
        avoid: as for `Advice.apply`.
        prefer: likewise.
    """

    model: TransitionModel
    gamma: float
    kind: str = "greedy"
    avoid: str = "doubt"
    prefer: str = "ignore"

    def q(self, f: np.ndarray, caution: float, advice: Advice, ends: np.ndarray) -> np.ndarray:
        """Action values ``[n_states, n_actions]``, −∞ where excluded; the policy is their argmax.

        Args:
            f: VR values, ``[n_states]``.
            caution: u, the dislike of uncertain outcomes.
            advice: about actions.
            ends: indices of states where demonstrators had nothing left to do.
        """
        if self.avoid == "thesis" or not np.size(ends) or not advice.avoided.any():
            return self._q(f, caution, advice, ends)
        nowhere = np.ones(self.model.n_states, dtype=bool)
        alone = self._q(f, caution, advice.but_for(nowhere), ends)
        if self.avoid == "doubt":
            advice = advice.but_for(self._dear(alone, advice, f[ends].max()))
        could = self._ends(alone, ends)
        while True:
            q = self._q(f, caution, advice, ends)
            lost = (self._ends(q, ends) < could - _LESS) & advice.avoided.any(axis=1)
            if not lost.any():
                return q
            advice = advice.but_for(lost)

    def _q(self, f: np.ndarray, caution: float, advice: Advice, ends: np.ndarray) -> np.ndarray:
        """The same, with all advice heeded."""
        q = self._advised(self.model.q_values(f, caution), advice)
        if self.kind == "greedy":
            return q
        f = planned_values(
            self.model, f, self.gamma, ends, caution=caution, excluded=np.isneginf(q)
        )
        return self._advised(self.model.q_values(f, caution), advice)

    def _ends(self, q: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Probability that a run by these values gets to one of the ends; ``[n_states]``."""
        action = Policy.from_q(q, self.model.mask).action
        return policy_success(self.model, action, ends, HORIZON)

    def _dear(self, alone: np.ndarray, advice: Advice, end: float) -> np.ndarray:
        """Where advice costs too much by the values without it; ``end``: what an end is worth."""
        left = np.where(advice.avoided, -np.inf, alone).max(axis=1)
        # So also where nothing is left, and not where nothing can be done.
        return left < alone.max(axis=1) - _DOUBT * (1 - self.gamma) * max(end, 0.0)

    def _advised(self, q: np.ndarray, advice: Advice) -> np.ndarray:
        return advice.apply(q, self.model.mask, self.avoid, self.prefer)


def planned_values(
    model: TransitionModel,
    f: np.ndarray,
    gamma: float,
    ends: np.ndarray,
    *,
    caution: float = 0.0,
    excluded: np.ndarray | None = None,
) -> np.ndarray:
    """VR values that lead to where demonstrations ended, and to no other hilltop of f.

    With R(s) = f(s) − γ max_a (Σ P f − u · surprise), thesis (3.18), and c its median over the
    states where something can be done, they solve V(s) = min(R(s), c) + γ max_a (Σ P V −
    u · surprise), and are f where demonstrations ended and where nothing can be done. Nowhere are
    they above f, but for rounding.

    Args:
        model: the transition model.
        f: VR values, ``[n_states]``.
        gamma: discount factor in [0, 1).
        ends: indices of states where demonstrators had nothing left to do; without any nobody
            knows which hilltops are meant, and f stays as it is.
        caution: u, the dislike of uncertain outcomes.
        excluded: actions not to plan with, bool ``[n_states, n_actions]``, never all of a state's;
            none if absent.

    Returns:
        float64 ``[n_states]``.
    """
    f = np.asarray(f, dtype=np.float64)
    if not np.size(ends):
        return f
    acting = model.widths > 0
    settled = ~acting
    settled[ends] = True
    doubt = caution * model.surprise
    reward = f - gamma * best(model, model.P @ f - doubt, fill=0.0)
    reward = np.minimum(reward, np.median(reward[acting]))
    earned = reward[model.pair_state] - gamma * doubt
    if excluded is not None:
        earned[excluded[model.pair_state, model.pair_action]] = _NEVER
    # Who comes to where a run ends earns what it is worth there and then.
    arrival = np.where(settled, gamma * f, 0.0)
    V, _ = value_iteration(
        model, arrival, gamma, earned, terminal=np.flatnonzero(settled), tolerance=1e-6
    )
    return np.where(settled, f, V)
