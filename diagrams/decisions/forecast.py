"""Looking ahead from the true pose before the policy is followed."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from diagrams.decisions.deciding import Choice, Sight, ranked
from diagrams.decisions.steps import By, Step, blocked, failed, is_past
from irl.policy import Policy
from models.errors import ModelError
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

HORIZON = 12
"""Within so many actions a course is to arrive."""
ARRIVES = 0.5
"""From this probability of reaching a goal a course counts as arriving."""
FIRST = 8
"""So many first actions, the best, are played ahead before all others: the answer is mostly there.
"""
DOUBTED = 2
"""An action that was taken so often in a state did not do there what was forecast."""


class Forecast:
    """Plays the policy ahead from the true pose before it follows it.

    If that reaches a goal within `HORIZON` actions, the policy's action is taken; else the first
    action, by the policy's values, after which the policy does; else the best that was not yet
    tried here. What could not be planned here is not tried again, nor in this cell by another hand
    while the cube stays as it is in the hand; what was ended on the way is, from where the cube is
    then, and anew once what was in the way is gone.
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
        blocked_in = blocked(state, steps)
        shut = failed(state, steps)
        if state >= N_FREE:
            shut |= set(np.flatnonzero(blocked_in[decode_states(state).position]).tolist())
        taken = [
            step.action
            for k, step in enumerate(steps)
            if step.state == state and not is_past(step, steps[k + 1 :])
        ]
        doubted = {action for action in taken if taken.count(action) >= DOUBTED} | shut
        scene = self._scene(sight, state)
        if own >= 0 and own not in doubted and self._arrives(scene, [own], blocked_in)[0]:
            return Choice(own, By.POLICY)
        by_value = ranked(self._policy.q[state])
        open_to = [action for action in by_value if action not in doubted]
        for some in (open_to[:FIRST], open_to[FIRST:]):
            arrives = self._arrives(scene, some, blocked_in)
            if arrives.any():
                return Choice(some[int(arrives.argmax())], By.FORECAST)
        for action in by_value:
            if action not in taken and action not in shut:
                return Choice(action, By.UNTRIED)
        if own < 0 or own in shut:
            own = next((action for action in by_value if action not in shut), -1)
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
