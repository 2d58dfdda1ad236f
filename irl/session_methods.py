"""A session of any method of `irl.methods.METHODS`: it learns anew from all labels, every time."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from irl.active_config import Progress
from irl.choices import check_choice
from irl.demonstrations import Demonstrations
from irl.methods import METHODS, learn
from irl.policy import Policy
from irl.problem import LearningProblem
from irl.queries import (
    COMMITTEE_STRATEGIES,
    STATE_STRATEGIES,
    QueryContext,
    candidate_states,
    select_states,
)
from irl.session import Question, Session
from irl.taught_state import TaughtState
from irl.uncertainty import action_probabilities, entropy

STRATEGIES = tuple(name for name in STATE_STRATEGIES if name not in COMMITTEE_STRATEGIES)
_BETA = 30.0
"""Inverse temperature of its choices in questions, where values differ by 1 at most or so."""


class MethodSession(Session):
    """A session of one method.

    Attributes:
        strategy: which states it asks about, a name in ``STRATEGIES``.
        options: of the method.
    """

    def __init__(
        self,
        method: str,
        problem: LearningProblem,
        state: TaughtState,
        generalise: Callable[[Demonstrations], Demonstrations],
        strategy: str = "visitation_entropy",
        options: Mapping[str, Any] | None = None,
    ) -> None:
        """Nothing was said yet.

        Raises:
            InputError: if there is no such method or strategy.
        """
        check_choice("method", method, METHODS)
        check_choice("strategy", strategy, STRATEGIES)
        super().__init__(problem, state, generalise)
        self.method, self.strategy, self.options = method, strategy, dict(options or {})

    def _refit(self, callback: Callable[[Progress], None] | None) -> None:
        labels, advice, done = self.state.labels, self.state.advice, [0, float("nan")]

        def told(iteration: int, value: float) -> None:
            done[:] = [iteration, value]
            if callback is not None:
                callback(Progress(self.rounds, iteration, iteration, value, labels))

        learnt = learn(
            self.method, self.problem, labels, rng=self.state.rng, progress=told, **self.options
        )
        # A preferred action may be worse than the one that was learnt: it changes nothing.
        self.q = advice.apply(learnt.q, self.problem.model.mask, prefer="ignore")
        if callback is not None:
            n = int(done[0])
            callback(Progress(self.rounds, n, n, done[1], labels, self.q))

    def propose(self, n: int) -> list[Question]:
        """The next questions by ``strategy``, best first."""
        problem, state = self.problem, self.state
        context = QueryContext(
            model=problem.model,
            q=self.q,
            features=self._features,
            demonstrated=np.unique(state.labels.state),
            candidates=candidate_states(problem.model, self.known, problem.candidates),
            beta=_BETA,
            start_states=problem.start_states,
            rng=state.rng,
            ends=state.ends(problem.model),
            asked=len(state.asked),
        )
        chosen = select_states(self.strategy, context, n)
        action = Policy.from_q(self.q, problem.model.mask).action
        score = STATE_STRATEGIES["masked_entropy"](context)
        return [
            Question(s, self.strategy, float(score[s]), int(action[s])) for s in chosen.tolist()
        ]

    @property
    def _features(self) -> np.ndarray:
        """What tells states apart: features of states, or else their factors."""
        problem = self.problem
        if problem.features is not None and problem.features.ndim == 2:
            return problem.features
        columns = [values == value for values in problem.factors.values() for value in set(values)]
        if not columns:
            return np.arange(problem.model.n_states, dtype=np.float64)[:, None]
        return np.column_stack(columns).astype(np.float64)

    def sure(self, states: np.ndarray) -> np.ndarray:
        """The policy's own probability of its action."""
        return action_probabilities(self.q[states], _BETA).max(axis=1)

    def gain(self, states: np.ndarray) -> np.ndarray:
        """The entropy of its choice there, (4.1)."""
        return entropy(self.q[states], _BETA)
