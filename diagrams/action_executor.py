"""Carries out the task's actions: grasp, translate, rotate, drop (thesis 5.8.2)."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    BasicVector,
    Context,
    EventStatus,
    InputPort,
    LeafSystem,
    State,
)

from diagrams.execution.clock import PERIOD, SLOWS, STOPS, Clock
from diagrams.execution.timeline import Timeline
from diagrams.execution.watches import BEHIND, LOOK, Measured, Vigil
from models.errors import ModelError
from models.motion.failures import ActionFailure, Infeasible
from models.motion.moves import Grip, Move
from models.motion.planner import ActionPlanner
from models.scenes import gripper
from models.scenes.planning_scene import HOME
from models.task.spaces import Action, decode_states

OVERTIME = 2.0
"""How long after a plan's end its last posture may be still to be reached [s]."""
ARRIVED = 0.02
"""How near to its command an arm has arrived [rad]."""


@dataclass(frozen=True)
class Execution:
    """One request and how far it is.

    Attributes:
        sequence: number of the request; 0 before the first.
        action: index of the action, −1 before the first.
        started: time at which it started [s].
        finished: whether its motion is over.
        failure: why it was not carried out, or not to its end; None if it was.
        reason: the same for a person; empty if it was.
    """

    sequence: int = 0
    action: int = -1
    started: float = 0.0
    finished: bool = True
    failure: ActionFailure | None = None
    reason: str = ""


@dataclass(frozen=True)
class _Memory:
    """What is executed, what is commanded and how far that is, and what was seen meanwhile.

    The opening commanded now is kept beside the timeline: it changes rarely, and what depends on
    it is not computed at every step.
    """

    execution: Execution
    timeline: Timeline
    width: float
    clock: Clock = field(default_factory=Clock)
    vigil: Vigil = field(default_factory=lambda: Vigil(RigidTransform()))

    def __deepcopy__(self, memo: dict) -> "_Memory":
        """Itself: nothing in it changes, and Drake copies states at every update."""
        return self


class ActionExecutor(LeafSystem):
    """Plans and plays the requested action, and watches over it.

    ::

                                     ┌────────────────┐
                         request ────┤                ├── arm.position_command      [7] rad
                      task.state ────┤                ├── gripper.position_command  [1] m
                     object.pose ────┤                ├── execution                 Execution
            object.pose_measured ────┤ ActionExecutor │
           arm.position_measured ────┤                │
       gripper.position_measured ────┤                │
          gripper.force_measured ────┤                │
                                     └────────────────┘

    `request` is [sequence, action], whole numbers; a new sequence number, from 1 on, starts the
    action. [0, −1] asks for nothing. A request that comes while another is under way waits until
    that one has finished. The executor commands the posture and opening given at construction
    until the first request, so the station must start there.

    Actions are planned with `object.pose`. What is measured besides is watched, phase by phase
    (`diagrams.execution`), where it is connected: an action that goes wrong brakes along its own
    path, keeps the fingers as they are, and ends with its failure. A plan waits for an arm that is
    behind it, and no joint is commanded further than 0.025 rad from where it is. An arm that cannot
    follow rests where it is: what is in its way is not pushed, and the next plan starts from there.

    A request that is none ends the simulation with a `ModelError`: parts of numbers, an action
    without a number of its own, or no action of the task.
    """

    def __init__(
        self,
        planner: ActionPlanner,
        *,
        q: np.ndarray = HOME,
        width: float = gripper.MAX_OPENING,
    ) -> None:
        """Execute with ``planner``, starting at ``q [7]`` [rad] and an opening [m].

        Raises:
            ModelError: if ``q`` is not so many finite angles, or ``width`` not a finite number.
        """
        super().__init__()
        self._planner = planner
        self._request = self.DeclareVectorInputPort("request", 2)
        self._task_state = self.DeclareVectorInputPort("task.state", 1)
        pose = AbstractValue.Make(RigidTransform())
        self._object = self.DeclareAbstractInputPort("object.pose", pose)
        self._measured_object = self.DeclareAbstractInputPort("object.pose_measured", pose)
        self._measured_arm = self.DeclareVectorInputPort("arm.position_measured", len(HOME))
        self._opening = self.DeclareVectorInputPort("gripper.position_measured", 1)
        self._force = self.DeclareVectorInputPort("gripper.force_measured", 1)
        hold = Timeline(q, width, (), planner.velocity_limit)
        self._memory = self.DeclareAbstractState(Value(_Memory(Execution(), hold, width)))
        self.DeclarePeriodicUnrestrictedUpdateEvent(PERIOD, 0.0, self._update)
        state_and_time = {self.abstract_state_ticket(self._memory), self.time_ticket()}
        state = {self.abstract_state_ticket(self._memory)}
        command = {*state_and_time, self._measured_arm.ticket()}
        self.DeclareVectorOutputPort("arm.position_command", 7, self._calc_arm, command)
        self.DeclareVectorOutputPort("gripper.position_command", 1, self._calc_gripper, state)
        self.DeclareAbstractOutputPort(
            "execution", lambda: Value(Execution()), self._calc_execution, state
        )

    def start_at(self, context: Context, q: np.ndarray, width: float) -> None:
        """Forget everything; command ``q [7]`` [rad] and an opening [m] until the next request.

        Raises:
            ModelError: if ``q`` is not so many finite angles, or ``width`` not a finite number.
        """
        hold = Timeline(q, width, (), self._planner.velocity_limit)
        context.SetAbstractState(self._memory, _Memory(Execution(), hold, width))

    def execution(self, context: Context) -> Execution:
        """Read how far the last request is from this system's context."""
        return self._remembered(context).execution

    def plan(self, context: Context) -> tuple[Move | Grip, ...]:
        """Read how the last request is carried out; nothing before the first, or if it cannot."""
        return self._remembered(context).timeline.plan

    def _remembered(self, context: Context) -> _Memory:
        return context.get_abstract_state(self._memory).get_value()

    def _update(self, context: Context, state: State) -> EventStatus:
        memory = before = self._remembered(context)
        sequence, action = self._read_request(context, memory.execution)
        if not memory.execution.finished:
            memory = self._go_on(context, memory)
        if memory.execution.finished and sequence != memory.execution.sequence:
            memory = self._plan(context, sequence, action, memory)
        width = memory.timeline.width(memory.clock.read(context.get_time()))
        if width != memory.width:
            memory = replace(memory, width=width)
        if memory is before:
            return EventStatus.DidNothing()
        state.get_mutable_abstract_state(self._memory).set_value(memory)
        return EventStatus.Succeeded()

    def _go_on(self, context: Context, memory: _Memory) -> _Memory:
        """Watch over what is under way, and end it when it is over; itself if nothing changes."""
        now = context.get_time()
        execution, timeline = memory.execution, memory.timeline
        elapsed = memory.clock.read(now)
        behind = self._behind(context, timeline.arm(elapsed))
        if execution.failure is not None:
            return self._come_to_rest(context, memory, behind)
        if _is_look(now - execution.started):
            vigil = memory.vigil.looked(timeline.watch(elapsed), self._look(context, behind))
            if vigil.failure is not None:
                failed = replace(execution, failure=vigil.failure, reason="on the way")
                rest = timeline.braked(elapsed, memory.clock.rate)
                if vigil.failure == ActionFailure.OBSTRUCTED:
                    rest = self._yielded(context, timeline, elapsed)
                return _Memory(failed, rest, memory.width, Clock(now), vigil)
            if vigil is not memory.vigil:
                memory = replace(memory, vigil=vigil)
        if elapsed < timeline.duration:
            return self._led(memory, now, behind)
        if behind is not None and behind > ARRIVED:
            if elapsed < timeline.duration + OVERTIME:
                return self._led(memory, now, 0.0)
            late = f"{behind:.3f} rad behind"
            failed = replace(execution, failure=ActionFailure.OVERTIME, reason=late, finished=True)
            rest = self._yielded(context, timeline, elapsed)
            return _Memory(failed, rest, memory.width, Clock(now), memory.vigil)
        return replace(memory, execution=replace(execution, finished=True))

    def _come_to_rest(self, context: Context, memory: _Memory, behind: float | None) -> _Memory:
        """Brake, or rest at once where the arm cannot even follow that."""
        now = context.get_time()
        elapsed = memory.clock.read(now)
        if elapsed < memory.timeline.duration:
            if behind is None or behind <= BEHIND:
                return self._led(memory, now, behind)
            rest = self._yielded(context, memory.timeline, elapsed)
            memory = replace(memory, timeline=rest, clock=Clock(now))
        return replace(memory, execution=replace(memory.execution, finished=True))

    @staticmethod
    def _led(memory: _Memory, now: float, behind: float | None) -> _Memory:
        """With a clock that waits for an arm that is behind; itself if nothing changes."""
        clock, behind = memory.clock, behind or 0.0
        if behind > SLOWS or clock.rate < 1.0:
            changes = memory.timeline.changes(clock.read(now), clock.rate)
            clock = clock.led(now, behind, changes)
        return memory if clock is memory.clock else replace(memory, clock=clock)

    def _yielded(self, context: Context, timeline: Timeline, elapsed: float) -> Timeline:
        """Rest where the arm is."""
        return timeline.yielded(elapsed, np.array(self._measured_arm.Eval(context)))

    def _look(self, context: Context, behind: float | None) -> Measured:
        """What is seen now, of what is connected."""
        seen = [self._read(port, context) for port in (self._opening, self._force)]
        opening, force = (None if values is None else float(values[0]) for values in seen)
        X_WO = self._read(self._measured_object, context)
        # Kept beyond this look, while the port's own value changes.
        X_WO = None if X_WO is None else RigidTransform(X_WO)
        return Measured(behind, opening, force, X_WO)

    def _behind(self, context: Context, command: np.ndarray) -> float | None:
        """The joints' largest distance from their command [rad]; None if nothing measures them."""
        q = self._read(self._measured_arm, context)
        return None if q is None else float(np.abs(q - command).max())

    @staticmethod
    def _read(port: InputPort, context: Context) -> Any:
        return port.Eval(context) if port.HasValue(context) else None

    def _read_request(self, context: Context, execution: Execution) -> tuple[int, int]:
        """Sequence number and action that are asked for.

        Raises:
            ModelError: if they are no whole numbers, or an action comes under the number 0, or
                under that of another.
        """
        asked = self._request.Eval(context)
        if asked[0] == execution.sequence and asked[1] == execution.action:
            return execution.sequence, execution.action
        shown = f"request {asked.tolist()}"
        if not (np.isfinite(asked).all() and (asked == np.round(asked)).all()):
            raise ModelError(f"{shown}; valid: whole numbers [sequence, action]")
        sequence, action = (int(value) for value in asked)
        if sequence < 0 or (sequence == 0 and action != -1):
            raise ModelError(f"{shown}: sequence {sequence}; valid: from 1 on, or [0, -1]")
        if sequence and sequence == execution.sequence and action != execution.action:
            raise ModelError(
                f"{shown}: sequence {sequence} was action {execution.action}; valid: a new number"
            )
        return sequence, action

    def _plan(self, context: Context, sequence: int, action: int, before: _Memory) -> _Memory:
        """Plan an action from where the last one ended."""
        position, _, hand = decode_states(int(self._task_state.Eval(context)[0]))
        now, end = context.get_time(), before.timeline.duration
        q, width = before.timeline.arm(end), before.timeline.width(end)
        X_WO = RigidTransform(self._object.Eval(context))
        execution = Execution(sequence, action, now, False)
        plan: Sequence[Move | Grip] = ()
        try:
            plan = self._planner.plan(
                Action.from_index(action),
                int(position),
                int(hand) if hand >= 0 else None,
                q,
                width,
                X_WO,
            )
        except Infeasible as refused:
            execution = Execution(sequence, action, now, True, refused.failure, str(refused))
        timeline = Timeline(q, width, plan, self._planner.velocity_limit)
        return _Memory(execution, timeline, width, Clock(now), Vigil(X_WO))

    def _calc_arm(self, context: Context, output: BasicVector) -> None:
        memory = self._remembered(context)
        command = memory.timeline.arm(memory.clock.read(context.get_time()))
        q = self._read(self._measured_arm, context)
        if q is not None:
            # A joint that is stopped by something stops at once, the others as they can.
            command = np.clip(command, q - STOPS, q + STOPS)
        output.SetFromVector(command)

    def _calc_gripper(self, context: Context, output: BasicVector) -> None:
        output[0] = self._remembered(context).width

    def _calc_execution(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._remembered(context).execution)


def _is_look(elapsed: float) -> bool:
    """Whether one of the updates, `PERIOD` apart, is a look, `LOOK` apart."""
    return round(elapsed / PERIOD) % round(LOOK / PERIOD) == 0
