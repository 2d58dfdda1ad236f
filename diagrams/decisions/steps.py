"""The steps of an episode, and what they tell of actions that might be taken next."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from models.motion.failures import ActionFailure
from models.task.spaces import N_ACTIONS, N_FREE, POSITIONS, decode_states

_OF_THE_TARGET = (ActionFailure.NO_ROOM, ActionFailure.OUT_OF_REACH)


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


def failed(state: int, steps: Sequence[Step]) -> set[int]:
    """Actions that cannot be carried out in a state, as was found."""
    return {step.action for step in steps if step.state == state and step.stood}


def is_past(step: Step, later: Sequence[Step]) -> bool:
    """Whether what stopped an action says nothing of it any more, after the ``later`` steps.

    Others moved the cube; or something was in the way, and since then a free way led to the same
    state.
    """
    if step.failure != ActionFailure.OBSTRUCTED:
        return step.failure == ActionFailure.DISPLACED
    free = (after for after in later if after.failure is None and after.state != step.state)
    return any(after.next_state == step.state for after in free)


def blocked(state: int, steps: Sequence[Step]) -> np.ndarray:
    """In which cells actions cannot be carried out as the cube is in the hand, as was found.

    Where the hand would end is out of reach or has no room, wherever it came from; whether there is
    a path depends on that.
    """
    shut = np.zeros((len(POSITIONS), N_ACTIONS), dtype=bool)
    if state < N_FREE:
        return shut
    for step in reversed(steps):
        if step.state < N_FREE:
            break
        if step.failure in _OF_THE_TARGET:
            shut[decode_states(step.state).position, step.action] = True
    return shut
