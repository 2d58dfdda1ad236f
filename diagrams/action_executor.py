"""Carries out the task's actions: grasp, translate, rotate, drop (thesis 5.8.2)."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, EventStatus, LeafSystem, State
from pydrake.trajectories import Trajectory

from models.arrays import finite_number, finite_vector
from models.errors import ModelError
from models.motion.planner import ActionPlanner, Grip, Infeasible, Move
from models.motion.timing import time_path
from models.scenes import gripper
from models.scenes.planning_scene import HOME
from models.task.spaces import Action, decode_states

PERIOD = 0.01
"""Between two looks at the request [s]."""


class Timeline:
    """A plan laid out in time: what to command at any moment since its start."""

    def __init__(
        self, q: np.ndarray, width: float, plan: Sequence[Move | Grip], velocity_limit: np.ndarray
    ) -> None:
        """Start at ``q [7]`` [rad] with the pads ``width`` [m] apart, then follow ``plan``.

        Raises:
            ModelError: if ``q`` is not so many finite angles, ``width`` not a finite number, or a
                move of the plan is no path (`time_path`).
        """
        q = finite_vector(q, len(HOME), "q")
        width = finite_number(width, "width", valid="metres")
        self.plan = tuple(plan)
        """What it follows."""
        self._starts = [0.0]
        self._arm: list[Trajectory | np.ndarray] = [np.array(q)]
        self._width = [float(width)]
        now = 0.0
        for part in plan:
            if isinstance(part, Move):
                path = time_path(part.waypoints, velocity_limit, cuts=part.cuts)
                self._arm.append(path)
                seconds, q = path.end_time(), part.waypoints[-1]
            else:
                self._arm.append(np.array(q))
                seconds, width = part.seconds, part.width
            self._starts.append(now)
            self._width.append(float(width))
            now += seconds
        self._starts.append(now)
        self._arm.append(np.array(q))
        self._width.append(float(width))
        self.duration = now

    def arm(self, t: float) -> np.ndarray:
        """Joint angles ``[7]`` [rad], ``t`` seconds after the start."""
        index = self._part(t)
        arm = self._arm[index]
        if isinstance(arm, np.ndarray):
            return arm
        return arm.value(t - self._starts[index]).ravel()

    def width(self, t: float) -> float:
        """Commanded opening [m], ``t`` seconds after the start."""
        return self._width[self._part(t)]

    def _part(self, t: float) -> int:
        return max(0, bisect_right(self._starts, t) - 1)


@dataclass(frozen=True)
class Execution:
    """One request and how far it is.

    Attributes:
        sequence: number of the request; 0 before the first.
        action: index of the action, −1 before the first.
        started: time at which it started [s].
        finished: whether its motion is over.
        failure: why it could not be planned; empty if it could.
    """

    sequence: int = 0
    action: int = -1
    started: float = 0.0
    finished: bool = True
    failure: str = ""


@dataclass(frozen=True)
class _Memory:
    execution: Execution
    timeline: Timeline

    def __deepcopy__(self, memo: dict) -> "_Memory":
        """Itself: nothing in it changes, and Drake copies states at every update."""
        return self


class ActionExecutor(LeafSystem):
    """Plans and plays the requested action.

    ::

                             ┌────────────────┐
         request ────────────┤                ├── arm.position_command      [7] rad
         task.state ─────────┤ ActionExecutor ├── gripper.position_command  [1] m
         object.pose ────────┤                ├── execution                 Execution
                             └────────────────┘

    `request` is [sequence, action], whole numbers; a new sequence number, from 1 on, starts the
    action. [0, −1] asks for nothing. A request that comes while another is under way waits until
    that one has finished. The executor commands the posture and opening given at construction
    until the first request, so the station must start there.

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
        self._object = self.DeclareAbstractInputPort(
            "object.pose", AbstractValue.Make(RigidTransform())
        )
        hold = Timeline(q, width, (), planner.velocity_limit)
        self._memory = self.DeclareAbstractState(Value(_Memory(Execution(), hold)))
        self.DeclarePeriodicUnrestrictedUpdateEvent(PERIOD, 0.0, self._update)
        state_and_time = {self.abstract_state_ticket(self._memory), self.time_ticket()}
        self.DeclareVectorOutputPort("arm.position_command", 7, self._calc_arm, state_and_time)
        self.DeclareVectorOutputPort(
            "gripper.position_command", 1, self._calc_gripper, state_and_time
        )
        self.DeclareAbstractOutputPort(
            "execution",
            lambda: Value(Execution()),
            self._calc_execution,
            {self.abstract_state_ticket(self._memory)},
        )

    def start_at(self, context: Context, q: np.ndarray, width: float) -> None:
        """Forget everything; command ``q [7]`` [rad] and an opening [m] until the next request.

        Raises:
            ModelError: if ``q`` is not so many finite angles, or ``width`` not a finite number.
        """
        hold = Timeline(q, width, (), self._planner.velocity_limit)
        context.SetAbstractState(self._memory, _Memory(Execution(), hold))

    def execution(self, context: Context) -> Execution:
        """Read how far the last request is from this system's context."""
        return context.get_abstract_state(self._memory).get_value().execution

    def plan(self, context: Context) -> tuple[Move | Grip, ...]:
        """Read how the last request is carried out; nothing before the first, or if it cannot."""
        return context.get_abstract_state(self._memory).get_value().timeline.plan

    def _update(self, context: Context, state: State) -> EventStatus:
        memory = context.get_abstract_state(self._memory).get_value()
        execution, timeline = memory.execution, memory.timeline
        sequence, action = self._read_request(context, execution)
        now = context.get_time()
        if not execution.finished:
            if now < execution.started + timeline.duration:
                return EventStatus.DidNothing()
            execution = Execution(execution.sequence, execution.action, execution.started, True)
        if sequence != execution.sequence:
            execution, timeline = self._plan(context, sequence, action, timeline)
        if execution is memory.execution:
            return EventStatus.DidNothing()
        state.get_mutable_abstract_state(self._memory).set_value(_Memory(execution, timeline))
        return EventStatus.Succeeded()

    def _read_request(self, context: Context, execution: Execution) -> tuple[int, int]:
        """Sequence number and action that are asked for.

        Raises:
            ModelError: if they are no whole numbers, or an action comes under the number 0, or
                under that of another.
        """
        asked = self._request.Eval(context)
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

    def _plan(
        self, context: Context, sequence: int, action: int, before: Timeline
    ) -> tuple[Execution, Timeline]:
        """Plan an action from where the last one ended."""
        position, _, hand = decode_states(int(self._task_state.Eval(context)[0]))
        now, end = context.get_time(), before.duration
        q, width = before.arm(end), before.width(end)
        failure = ""
        plan: Sequence[Move | Grip] = ()
        try:
            plan = self._planner.plan(
                Action.from_index(action),
                int(position),
                int(hand) if hand >= 0 else None,
                q,
                width,
                self._object.Eval(context),
            )
        except Infeasible as reason:
            failure = str(reason)
        timeline = Timeline(q, width, plan, self._planner.velocity_limit)
        return Execution(sequence, action, now, bool(failure), failure), timeline

    def _elapsed(self, context: Context) -> tuple[Timeline, float]:
        memory = context.get_abstract_state(self._memory).get_value()
        return memory.timeline, context.get_time() - memory.execution.started

    def _calc_arm(self, context: Context, output: BasicVector) -> None:
        timeline, elapsed = self._elapsed(context)
        output.SetFromVector(timeline.arm(elapsed))

    def _calc_gripper(self, context: Context, output: BasicVector) -> None:
        timeline, elapsed = self._elapsed(context)
        output[0] = timeline.width(elapsed)

    def _calc_execution(self, context: Context, output: AbstractValue) -> None:
        output.set_value(context.get_abstract_state(self._memory).get_value().execution)
