"""Which action a policy controller takes where it stands: by the policy's table, or looking ahead.

A `Decision` is a pure function of what is seen and of the steps so far; `PolicyController` gets one
at construction.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from pydrake.math import RigidTransform

from irl.policy import Policy
from models.errors import ModelError
from models.motion.failures import ActionFailure
from models.task.discretise import nearest_column
from models.task.forecast import Scenes, arrival, free_scene, held_scene, outcomes
from models.task.spaces import (
    LOST,
    N_ACTIONS,
    N_FREE,
    N_STATES,
    POSITIONS,
    R_WG,
    R_WO,
    REST_HEIGHT,
    decode_states,
)
from models.task.tracking import NOTHING, InHand

HORIZON = 12
"""Within so many actions a course is to arrive."""
ARRIVES = 0.5
"""From this probability of reaching a goal a course counts as arriving."""
FIRST = 8
"""So many first actions, the best, are played ahead before all others: the answer is mostly there.
"""
_OF_THE_TARGET = (ActionFailure.NO_ROOM, ActionFailure.OUT_OF_REACH)
DOUBTED = 2
"""An action that was taken so often in a state did not do there what was forecast."""


class By(StrEnum):
    """What chose an action."""

    POLICY = "policy"
    FORECAST = "forecast"
    UNTRIED = "untried"
    RELEASE = "release"
    PERSON = "person"


@dataclass(frozen=True)
class Step:
    """One action of an episode.

    Attributes:
        state: index of the state it was chosen in.
        action: index of the action.
        next_state: index of the state it led to.
        started: seconds.
        ended: seconds, when the outcome was read.
        failure: why it could not be carried out, or not to its end; None if it was.
        chosen_by: what chose it.
    """

    state: int
    action: int
    next_state: int
    started: float
    ended: float
    failure: ActionFailure | None = None
    chosen_by: By = By.POLICY

    @property
    def stood(self) -> bool:
        """Whether the robot did not even set out, because it knew beforehand of the failure."""
        return self.failure is not None and self.failure.is_foreseen


@dataclass(frozen=True)
class Sight:
    """What is seen between two actions.

    Attributes:
        state: index of the state, as identified.
        X_WO: measured pose of the cube; None if the decision does not go by poses.
        in_hand: what is known of its pose in the hand.
        told: index of the action that somebody outside asks for, −1 for none.
    """

    state: int
    X_WO: RigidTransform | None = None
    in_hand: InHand = NOTHING
    told: int = -1


@dataclass(frozen=True)
class Choice:
    """An action, and what chose it."""

    action: int
    by: By


class Decision(Protocol):
    """How to act."""

    goes_by_poses: bool
    """Whether it wants to see poses, or goes by the state's name alone."""

    def state(self, sight: Sight) -> int:
        """What to call the state that is seen: an index."""

    def choose(self, sight: Sight, steps: Sequence[Step]) -> Choice | None:
        """The action to take after the steps so far, None if there is none."""


class Table:
    """The thesis' decision: the action that the policy has for the state, whatever its pose.

    Where that could not be carried out, it is the next one by the policy's values, if it has any.
    """

    goes_by_poses = False

    def __init__(self, policy: Policy | np.ndarray) -> None:
        """Act by a policy, or by its action table ``[n_states]``, −1 where there is none."""
        self._action = policy.action if isinstance(policy, Policy) else np.asarray(policy)
        self._q = policy.q if isinstance(policy, Policy) else None

    def state(self, sight: Sight) -> int:
        """As it was identified."""
        return sight.state

    def choose(self, sight: Sight, steps: Sequence[Step]) -> Choice | None:
        """What the table says, of what has not failed here."""
        own, failed = int(self._action[sight.state]), _failed(sight.state, steps)
        if own >= 0 and own not in failed:
            return Choice(own, By.POLICY)
        ranked = [] if own < 0 or self._q is None else _ranked(self._q[sight.state])
        action = next((action for action in ranked if action not in failed), None)
        return None if action is None else Choice(action, By.UNTRIED)


class Forecast:
    """Plays the policy ahead from the true pose before it follows it.

    If that reaches a goal within `HORIZON` actions, the policy's action is taken; else the first
    action, by the policy's values, after which the policy does; else the best that was not yet
    tried here. What could not be planned here is not tried again, nor in this cell by another hand
    while the cube stays as it is in the hand; what was ended on the way is, from where the cube is
    then.
    """

    goes_by_poses = True

    def __init__(self, policy: Policy, goals: ArrayLike) -> None:
        """Act by a policy.

        Args:
            policy: its actions and values, of the grasping task.
            goals: indices of the states that count as arrived: those by which the episode is
                judged, or `held_goal`.

        Raises:
            ModelError: if the policy is for another number of states or actions, or a goal is none.
        """
        if policy.q.shape[0] < N_STATES or policy.q.shape[1] != N_ACTIONS:
            raise ModelError(
                f"policy: q is {list(policy.q.shape)}; valid: [{N_STATES} or more, {N_ACTIONS}]"
            )
        self._policy = policy
        self._goals = np.zeros(LOST + 1, dtype=bool)
        for goal in np.atleast_1d(np.asarray(goals)).tolist():
            if not 0 <= goal < N_STATES:
                raise ModelError(f"goals: {goal} is not a state; valid: 0…{N_STATES - 1}")
            self._goals[goal] = True

    def state(self, sight: Sight) -> int:
        """As it was identified; a cube on the table beside the grid is in its nearest column.

        A free cube that does not lie on the table is lost, such as one on top of another.
        """
        if N_FREE <= sight.state < LOST or sight.X_WO is None:
            return sight.state
        column = nearest_column(sight.X_WO.translation()).reshape(1)
        if sight.state != LOST and column[0] >= 0:
            return sight.state
        R_WO, p_WO = sight.X_WO.rotation().matrix()[None], sight.X_WO.translation()[None]
        return int(Scenes(column, np.array([-1]), R_WO, p_WO).state[0])

    def choose(self, sight: Sight, steps: Sequence[Step]) -> Choice | None:
        """Look ahead from the true pose."""
        state = self.state(sight)
        if state == LOST:
            return None
        own = int(self._policy.action[state])
        here = [step for step in steps if step.state == state]
        blocked = _blocked(state, steps)
        failed = _failed(state, steps)
        if state >= N_FREE:
            failed |= set(np.flatnonzero(blocked[decode_states(state).position]).tolist())
        # That the cube was moved by others says nothing of an action.
        taken = [step.action for step in here if step.failure != ActionFailure.DISPLACED]
        doubted = {action for action in taken if taken.count(action) >= DOUBTED} | failed
        scene = self._scene(sight, state)
        if own >= 0 and own not in doubted and self._arrives(scene, [own], blocked)[0]:
            return Choice(own, By.POLICY)
        ranked = _ranked(self._policy.q[state])
        open_to = [action for action in ranked if action not in doubted]
        for some in (open_to[:FIRST], open_to[FIRST:]):
            arrives = self._arrives(scene, some, blocked)
            if arrives.any():
                return Choice(some[int(arrives.argmax())], By.FORECAST)
        for action in ranked:
            if action not in taken and action not in failed:
                return Choice(action, By.UNTRIED)
        if own < 0 or own in failed:
            own = next((action for action in ranked if action not in failed), -1)
        return None if own < 0 else Choice(own, By.POLICY)

    def _arrives(self, scene: Scenes, first: Sequence[int], blocked: np.ndarray) -> np.ndarray:
        """Whether the policy reaches a goal after each of some first actions ``[n]``."""
        many = scene.select(np.zeros(len(first), dtype=int))
        policy = self._policy.action
        chance = arrival(many, np.array(first), policy, self._goals, HORIZON, blocked)
        return chance >= ARRIVES

    @staticmethod
    def _scene(sight: Sight, state: int) -> Scenes:
        """Where cube and hand are, called as the state is."""
        if sight.X_WO is None:
            raise ModelError("a forecast needs the cube's pose; connect object.pose and tcp.pose")
        if state < N_FREE:
            return free_scene(state, sight.X_WO.rotation().matrix(), sight.X_WO.translation())
        known = sight.in_hand
        if not known.count:  # grasped, and not yet measured in the hand
            _, _, hand = decode_states(state)
            return held_scene(
                state, R_WG[int(hand)].T @ sight.X_WO.rotation().matrix(), np.zeros(3)
            )
        return held_scene(state, known.R_GO, known.p_GO)


def _failed(state: int, steps: Sequence[Step]) -> set[int]:
    """Actions that cannot be carried out in a state, as was found."""
    return {step.action for step in steps if step.state == state and step.stood}


def _blocked(state: int, steps: Sequence[Step]) -> np.ndarray:
    """In which cells actions cannot be carried out as the cube is in the hand, as was found.

    Where the hand would end is out of reach or has no room, wherever it came from; whether there is
    a path depends on that.
    """
    blocked = np.zeros((len(POSITIONS), N_ACTIONS), dtype=bool)
    if state < N_FREE:
        return blocked
    for step in reversed(steps):
        if step.state < N_FREE:
            break
        if step.failure in _OF_THE_TARGET:
            blocked[decode_states(step.state).position, step.action] = True
    return blocked


def _ranked(q: np.ndarray) -> list[int]:
    """Actions with a value, the best first."""
    return [int(a) for a in np.argsort(-q, kind="stable") if np.isfinite(q[a])]


class Correctable:
    """Takes an action from outside where there is one, such as a person's; else decides itself."""

    def __init__(self, otherwise: Decision) -> None:
        """Decide by ``otherwise`` where nobody asks for anything."""
        self._otherwise = otherwise
        self.goes_by_poses = otherwise.goes_by_poses

    def state(self, sight: Sight) -> int:
        """As the other decision calls it."""
        return self._otherwise.state(sight)

    def choose(self, sight: Sight, steps: Sequence[Step]) -> Choice | None:
        """What was told, else what the other decision chooses."""
        if sight.told >= 0:
            return Choice(sight.told, By.PERSON)
        return self._otherwise.choose(sight, steps)


def held_goal(policy: Policy) -> int:
    """The state that a learner holds for the goal: where the action leads that it values most.

    Its values are expected values of the states that follow (3.17), so that the largest is of the
    surest way to the state it likes best. A policy that came of no learning may have any.

    Raises:
        ModelError: if no action has a finite value.
    """
    q = np.where(np.isfinite(policy.q[:N_STATES]), policy.q[:N_STATES], -np.inf)
    state, action = np.unravel_index(int(q.argmax()), q.shape)
    if np.isneginf(q[state, action]):
        raise ModelError("policy: no action has a finite value, so it holds no state for the goal")
    position, orientation, hand = decode_states(np.array([state]))
    R = R_WO[orientation]
    if state < N_FREE:
        before = free_scene(int(state), R[0], [*POSITIONS[int(position[0])][:2], REST_HEIGHT])
    else:
        before = Scenes(position, hand, R, POSITIONS[position])
    came = outcomes(before, np.array([action]))
    return int(came.scenes.state[came.probability.argmax()])
