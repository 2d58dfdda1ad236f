"""Decisions: by what is seen and by the steps so far, which action to take.

A policy's table and a person decide here; how to look ahead is in `forecast`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from pydrake.math import RigidTransform

from diagrams.decisions.steps import By, Step, failed
from irl.policy import Policy
from models.task.tracking import NOTHING, InHand


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
        own, shut = int(self._action[sight.state]), failed(sight.state, steps)
        if own >= 0 and own not in shut:
            return Choice(own, By.POLICY)
        others = [] if own < 0 or self._q is None else ranked(self._q[sight.state])
        action = next((action for action in others if action not in shut), None)
        return None if action is None else Choice(action, By.UNTRIED)


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


def ranked(q: np.ndarray) -> list[int]:
    """Actions with a value, the best first."""
    return [int(a) for a in np.argsort(-q, kind="stable") if np.isfinite(q[a])]
