"""Plays a policy: identify the state, request its action, wait for rest, again."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import BasicVector, Context, EventStatus, LeafSystem, State

from diagrams.action_executor import PERIOD, Execution

SETTLE = 0.5
"""From the end of an action's motion until its outcome is read [s]."""


class Verdict(StrEnum):
    """How an episode stands."""

    RUNNING = "running"
    GOAL = "goal"
    LOST = "lost"
    NO_ACTION = "no action"
    INFEASIBLE = "infeasible"
    OUT_OF_ACTIONS = "out of actions"


@dataclass(frozen=True)
class Step:
    """One action of an episode.

    Attributes:
        state: index of the state it was chosen in.
        action: index of the action.
        next_state: index of the state it led to.
        started: seconds.
        ended: seconds, when the outcome was read.
        failure: why it could not be carried out; empty if it was.
    """

    state: int
    action: int
    next_state: int
    started: float
    ended: float
    failure: str = ""


@dataclass(frozen=True)
class Episode:
    """What a policy controller did so far.

    Attributes:
        steps: the actions taken.
        verdict: how it stands.
        sequence: number of the last request.
        state: index of the state in which that was made, −1 before the first.
        finished_at: when the running action's motion ended [s], −1 while it moves.
    """

    steps: tuple[Step, ...] = ()
    verdict: Verdict = Verdict.RUNNING
    sequence: int = 0
    state: int = -1
    finished_at: float = -1.0

    def __deepcopy__(self, memo: dict) -> "Episode":
        """Itself: nothing in it changes, and Drake copies states at every update."""
        return self


class PolicyController(LeafSystem):
    """Turns the identified state into requests for actions, until the goal or a dead end.

    ::

                       ┌──────────────────┐
         task.state ───┤                  ├── request  [sequence, action]
                       │ PolicyController │
         execution ────┤                  ├── episode  Episode
                       └──────────────────┘

    The first request is made after `SETTLE` seconds.
    """

    def __init__(
        self,
        action: np.ndarray,
        *,
        goal_states: np.ndarray,
        lost_state: int,
        max_actions: int = 20,
    ) -> None:
        """Play a policy.

        Args:
            action: index of each state's action, int ``[n_states]``, −1 where there is none.
            goal_states: indices of the states that end an episode well.
            lost_state: index of the state that ends it badly.
            max_actions: after which an episode ends.
        """
        super().__init__()
        self._action = np.asarray(action)
        self._goals = {int(state) for state in np.atleast_1d(goal_states)}
        self._lost, self._max_actions = int(lost_state), max_actions
        self._task_state = self.DeclareVectorInputPort("task.state", 1)
        self._execution = self.DeclareAbstractInputPort("execution", Value(Execution()))
        self._memory = self.DeclareAbstractState(Value(Episode()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(PERIOD, 0.0, self._update)
        memory = {self.abstract_state_ticket(self._memory)}
        self.DeclareVectorOutputPort("request", 2, self._calc_request, memory)
        self.DeclareAbstractOutputPort(
            "episode", lambda: Value(Episode()), self._calc_episode, memory
        )

    def episode(self, context: Context) -> Episode:
        """Read the episode from this system's context."""
        return context.get_abstract_state(self._memory).get_value()

    def _update(self, context: Context, state: State) -> EventStatus:
        episode = self.episode(context)
        if episode.verdict != Verdict.RUNNING:
            return EventStatus.DidNothing()
        execution: Execution = self._execution.Eval(context)
        if execution.sequence != episode.sequence:
            return EventStatus.DidNothing()
        after = self._advance(context, episode, execution)
        if after is episode:
            return EventStatus.DidNothing()
        state.get_mutable_abstract_state(self._memory).set_value(after)
        return EventStatus.Succeeded()

    def _advance(self, context: Context, episode: Episode, execution: Execution) -> Episode:
        """Wait for the motion's end, then for rest, then judge and choose."""
        now = context.get_time()
        if not execution.finished:
            return episode
        if episode.finished_at < 0.0:
            return Episode(episode.steps, episode.verdict, episode.sequence, episode.state, now)
        if now < episode.finished_at + SETTLE:
            return episode

        state = int(self._task_state.Eval(context)[0])
        steps = episode.steps
        if episode.sequence:
            step = Step(
                episode.state, execution.action, state, execution.started, now, execution.failure
            )
            steps = (*steps, step)
        verdict = self._verdict(state, steps)
        if verdict != Verdict.RUNNING:
            return Episode(steps, verdict, episode.sequence, state, now)
        return Episode(steps, verdict, episode.sequence + 1, state)

    def _verdict(self, state: int, steps: tuple[Step, ...]) -> Verdict:
        if state in self._goals:
            return Verdict.GOAL
        if state == self._lost:
            return Verdict.LOST
        if steps and steps[-1].failure:
            return Verdict.INFEASIBLE
        if len(steps) >= self._max_actions:
            return Verdict.OUT_OF_ACTIONS
        if self._action[state] < 0:
            return Verdict.NO_ACTION
        return Verdict.RUNNING

    def _calc_request(self, context: Context, output: BasicVector) -> None:
        episode = self.episode(context)
        action = int(self._action[episode.state]) if episode.sequence else -1
        output.SetFromVector([episode.sequence, action])

    def _calc_episode(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self.episode(context))
