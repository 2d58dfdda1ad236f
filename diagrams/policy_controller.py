"""Plays a policy: identify the state, request an action, wait for rest, again."""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import BasicVector, Context, EventStatus, LeafSystem, State

from diagrams.action_executor import PERIOD, Execution
from diagrams.decisions import By, Choice, Decision, Sight, Step
from diagrams.execution.watches import LOOK
from diagrams.state_identifier import FLAT_ANGLE, identify_state, tilt
from models.task.discretise import name_margin
from models.task.spaces import N_FREE, Action, Kind
from models.task.tracking import NOTHING, InHand

SETTLE = 0.5
"""From the end of an action's motion until its outcome is read [s]."""
LOOKS_AGAIN = 4
"""How often the controller waits as long once more for a cube that is nowhere, or leans, or may not
be at the goal that it seems to be at."""
SURE = 2.0
"""Standard errors of a pose within which a cube must have the goal's name to have arrived."""
CLAMPED = 0.06
"""So near to the tool centre point a cube that is neither held nor free may be clamped askew
between fingers and table [m]."""


class Verdict(StrEnum):
    """How an episode stands."""

    RUNNING = "running"
    GOAL = "goal"
    LOST = "lost"
    NO_ACTION = "no action"
    INFEASIBLE = "infeasible"
    OUT_OF_ACTIONS = "out of actions"
    OUT_OF_TIME = "out of time"


@dataclass(frozen=True)
class Episode:
    """What a policy controller did so far.

    Attributes:
        steps: the actions taken.
        verdict: how it stands.
        sequence: number of the last request.
        state: index of the state in which that was made, −1 before the first.
        finished_at: when the running action's motion ended [s], −1 while it moves.
        action: index of the action then requested, −1 before the first.
        chosen_by: what chose it.
        in_hand: what is known of a held cube's pose in the hand.
        lying: what was seen of a free cube's pose in the world since the last motion ended.
        waited: how often it waited once more for a cube that seemed to be nowhere.
    """

    steps: tuple[Step, ...] = ()
    verdict: Verdict = Verdict.RUNNING
    sequence: int = 0
    state: int = -1
    finished_at: float = -1.0
    action: int = -1
    chosen_by: By = By.POLICY
    in_hand: InHand = NOTHING
    lying: InHand = NOTHING
    waited: int = 0

    def __deepcopy__(self, memo: dict) -> "Episode":
        """Itself: nothing in it changes, and Drake copies states at every update."""
        return self


class PolicyController(LeafSystem):
    """Turns the identified state into requests for actions, until the goal or a dead end.

    ::

                       ┌──────────────────┐
         task.state ───┤                  ├── request     [sequence, action]
        object.pose ───┤                  ├── task.state  index, as the decision calls it
           tcp.pose ───┤ PolicyController ├── object.pose RigidTransform, as it is believed to be
          execution ───┤                  ├── episode     Episode
               told ───┤                  │
                       └──────────────────┘

    The first request is made after `SETTLE` seconds. Looks at poses are `LOOK` seconds apart, and
    each refines what is believed of the cube: in the world where it lies, in the hand where it is
    held. A decision that goes by the state's name alone needs no poses; one that goes by them has
    the state named by what is believed. `told` is the index of an action that somebody outside asks
    for, −1 for none; nothing asks where it is not connected, and only `Correctable` obeys.

    A cube that stays nowhere is *lost*. One beside the tool centre point may be clamped, so the
    fingers let go of it first, unless the decision goes by the state's name alone.
    """

    def __init__(
        self,
        decision: Decision,
        *,
        goal_states: np.ndarray,
        lost_state: int,
        max_actions: int = 20,
    ) -> None:
        """Play a policy.

        Args:
            decision: chooses each action.
            goal_states: indices of the states that end an episode well.
            lost_state: index of the state that ends it badly.
            max_actions: after which an episode ends.
        """
        super().__init__()
        self._decision = decision
        self._goals = {int(state) for state in np.atleast_1d(goal_states)}
        self._lost, self._max_actions = int(lost_state), max_actions
        self._task_state = self.DeclareVectorInputPort("task.state", 1)
        pose = AbstractValue.Make(RigidTransform())
        self._object = self.DeclareAbstractInputPort("object.pose", pose)
        self._tcp = self.DeclareAbstractInputPort("tcp.pose", pose)
        self._execution = self.DeclareAbstractInputPort("execution", Value(Execution()))
        self._told = self.DeclareVectorInputPort("told", 1)
        self._memory = self.DeclareAbstractState(Value(Episode()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(PERIOD, 0.0, self._update)
        memory = {self.abstract_state_ticket(self._memory)}
        self.DeclareVectorOutputPort("request", 2, self._calc_request, memory)
        self.DeclareVectorOutputPort("task.state", 1, self._calc_state, memory)
        self.DeclareAbstractOutputPort(
            "object.pose", lambda: AbstractValue.Make(RigidTransform()), self._calc_object
        )
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
            return self._look(context, replace(episode, finished_at=now, lying=NOTHING))
        if round((now - episode.finished_at) / PERIOD) % round(LOOK / PERIOD) == 0:
            episode = self._look(context, episode)
        if now < episode.finished_at + SETTLE:
            return episode

        sight = self._sight(context, episode)
        state = self._decision.state(sight)
        leans = state in self._goals and state < N_FREE and _leans(sight.X_WO)
        unsure = state in self._goals and not leans and _is_unsure(episode, sight.X_WO)
        if unsure and episode.waited < LOOKS_AGAIN:
            return replace(episode, finished_at=now, waited=episode.waited + 1)
        if (state == self._lost or leans) and episode.waited < LOOKS_AGAIN:
            # It may be in the air, in somebody's hand, or still on its way down.
            return replace(episode, finished_at=now, lying=NOTHING, waited=episode.waited + 1)
        steps = episode.steps
        if episode.sequence:
            step = Step(
                episode.state,
                execution.action,
                state,
                execution.started,
                now,
                execution.failure,
                episode.chosen_by,
            )
            steps = (*steps, step)
        over = replace(episode, steps=steps, state=state, finished_at=now)
        # A cube beside the goal's cell has only its name, as one that leans on something, or that
        # may as well have another: it is yet to be placed.
        if state in self._goals and state == sight.state and not (leans or unsure):
            return replace(over, verdict=Verdict.GOAL)
        if state == self._lost:
            clamped = self._clamped(context, sight, steps)
            if clamped is None:
                return replace(over, verdict=Verdict.LOST)
            over = replace(over, state=clamped)
            choice: Choice | None = Choice(Action(Kind.DROP).index, By.RELEASE)
        else:
            choice = self._decision.choose(sight, steps)
        if choice is None:
            failed = bool(steps and steps[-1].failure)
            return replace(over, verdict=Verdict.INFEASIBLE if failed else Verdict.NO_ACTION)
        if sum(not step.stood for step in steps) >= self._max_actions:
            return replace(over, verdict=Verdict.OUT_OF_ACTIONS)
        return replace(
            over,
            sequence=episode.sequence + 1,
            finished_at=-1.0,
            waited=0,
            action=choice.action,
            chosen_by=choice.by,
        )

    def _clamped(self, context: Context, sight: Sight, steps: tuple[Step, ...]) -> int | None:
        """Held state that a lost cube is nearest to, None if it is not clamped.

        Nor is it after fingers have opened in vain.
        """
        if sight.X_WO is None or (steps and steps[-1].chosen_by == By.RELEASE):
            return None
        X_WG = self._tcp.Eval(context)
        distance = np.linalg.norm(sight.X_WO.translation() - X_WG.translation())
        return identify_state(sight.X_WO, X_WG, True) if distance <= CLAMPED else None

    def _look(self, context: Context, episode: Episode) -> Episode:
        """What is known of the cube's pose after one more look, where it is measured."""
        if not (self._object.HasValue(context) and self._tcp.HasValue(context)):
            return episode
        X_WO = self._object.Eval(context)
        cube = X_WO.rotation().matrix(), X_WO.translation()
        if self._is_held(context):
            X_WG = self._tcp.Eval(context)
            seen = episode.in_hand.measured(X_WG.rotation().matrix(), X_WG.translation(), *cube)
            return replace(episode, in_hand=seen, lying=NOTHING)
        lying = episode.lying.measured(np.eye(3), np.zeros(3), *cube)
        return replace(episode, in_hand=episode.in_hand.released(), lying=lying)

    def _is_held(self, context: Context) -> bool:
        return N_FREE <= int(self._task_state.Eval(context)[0]) < self._lost

    def _believed(self, context: Context, episode: Episode) -> RigidTransform:
        """Where the cube is, by all looks; as it is measured now if there were none."""
        known = episode.lying if episode.lying.count else episode.in_hand
        if not known.count:
            return self._object.Eval(context)
        X = RigidTransform(RotationMatrix(known.R_GO), known.p_GO)
        return X if known is episode.lying else self._tcp.Eval(context) @ X

    def _sight(self, context: Context, episode: Episode) -> Sight:
        """What the decision goes by."""
        state = int(self._task_state.Eval(context)[0])
        told = int(self._told.Eval(context)[0]) if self._told.HasValue(context) else -1
        if not self._decision.goes_by_poses:
            return Sight(state, told=told)
        X_WO = self._believed(context, episode)
        state = identify_state(X_WO, self._tcp.Eval(context), self._is_held(context))
        return Sight(state, X_WO, episode.in_hand, told)

    def _calc_request(self, context: Context, output: BasicVector) -> None:
        episode = self.episode(context)
        output.SetFromVector([episode.sequence, episode.action])

    def _calc_state(self, context: Context, output: BasicVector) -> None:
        output[0] = self.episode(context).state

    def _calc_object(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._believed(context, self.episode(context)))

    def _calc_episode(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self.episode(context))


def _leans(X_WO: RigidTransform | None) -> bool:
    """Whether a cube is known to be askew, on none of its faces."""
    return X_WO is not None and tilt(X_WO) > FLAT_ANGLE


def _is_unsure(episode: Episode, X_WO: RigidTransform | None) -> bool:
    """Whether a cube may have another name than it seems to, by how its measured poses differ."""
    if X_WO is None or not episode.lying.count:
        return False
    margins = name_margin(X_WO.rotation().matrix(), X_WO.translation())
    errors = episode.lying.error
    return any(m < SURE * e for m, e in zip(margins, errors, strict=True))
