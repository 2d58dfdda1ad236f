"""Who answers the learner's questions about states: demonstrators.

The oracle knows a hidden reward and plans under it; the learner sees only its answers.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from irl.choices import check_range
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.planning import uniform_policy, value_iteration


class Demonstrator(Protocol):
    """Knows what to do in a state."""

    def label(self, state: int, rng: np.random.Generator) -> int:
        """The action to take in ``state``."""
        ...

    def trajectory(
        self, state: int, rng: np.random.Generator, max_steps: int = 50
    ) -> list[tuple[int, int]]:
        """(state, action) pairs from ``state`` until the run ends; empty if it ends there."""
        ...


@dataclass(frozen=True, eq=False)
class OracleDemonstrator:
    """Plans on the transition model under a hidden reward, and shows what it would do.

    R(s') is earned on entering s': ``goal_reward`` at a goal, −``discomfort`` at an
    uncomfortable state, −``loss`` at a lost one; every action costs ``action_cost``, and
    ``surprise`` times the probability that its likeliest outcome does not come. A run ends at a
    goal, at a lost state, and where nothing is feasible.

    Attributes:
        model: the transition model.
        goal_states: indices.
        gamma: discount factor in [0, 1).
        uncomfortable: indices of states to keep out of, if it costs little.
        lost_states: indices of states that end a run for the worse.
        goal_reward: at least 0, like the next four.
        action_cost: cost of an action, one number or ``[n_pairs]``.
        discomfort: penalty of an uncomfortable state.
        loss: penalty of a lost state.
        surprise: dislike of actions with uncertain outcomes; no reward on states explains it.
        tolerance: actions whose Q is within this of the best are co-optimal.
        label_noise: probability that a label is a random feasible action that is not
            co-optimal.
    """

    model: TransitionModel
    goal_states: np.ndarray
    gamma: float = 0.95
    uncomfortable: np.ndarray | None = None
    lost_states: np.ndarray | None = None
    goal_reward: float = 1.0
    action_cost: float | np.ndarray = 0.01
    discomfort: float = 0.05
    loss: float = 1.0
    surprise: float = 0.0
    tolerance: float = 1e-6
    label_noise: float = 0.0

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            InputError: if ``label_noise`` is outside [0, 1] or ``tolerance`` is not above 0.
        """
        check_range("demonstrator: label_noise", self.label_noise, 0, 1)
        check_range("demonstrator: tolerance", self.tolerance, 0, open_low=True)

    @cached_property
    def terminal(self) -> np.ndarray:
        """Where a run ends; bool ``[n_states]``."""
        ended = self.model.widths == 0
        ended[self.goal_states] = True
        if self.lost_states is not None:
            ended[self.lost_states] = True
        return ended

    @cached_property
    def state_reward(self) -> np.ndarray:
        """The hidden R, ``[n_states]``."""
        R = np.zeros(self.model.n_states)
        if self.uncomfortable is not None:
            R[self.uncomfortable] -= self.discomfort
        if self.lost_states is not None:
            R[self.lost_states] -= self.loss
        R[self.goal_states] += self.goal_reward
        return R

    @cached_property
    def optimal_actions(self) -> np.ndarray:
        """The co-optimal actions, none where a run ends; bool ``[n_states, n_actions]``."""
        _, Q = value_iteration(
            self.model,
            self.state_reward,
            self.gamma,
            pair_reward=-self.action_cost - self.surprise * self.model.surprise,
            terminal=np.flatnonzero(self.terminal),
            # Two errors meet in a comparison; a tenth leaves the tolerance its meaning.
            tolerance=self.tolerance / 10,
        )
        good_enough = Q.max(axis=1, keepdims=True) - self.tolerance
        return np.isfinite(Q) & (good_enough <= Q)

    @property
    def shown(self) -> np.ndarray:
        """How likely each action is to be shown, slips apart; float64 ``[n_states, n_actions]``."""
        return uniform_policy(self.optimal_actions)

    def label(self, state: int, rng: np.random.Generator) -> int:
        """A co-optimal action, drawn evenly; with probability ``label_noise`` another.

        Raises:
            InputError: if a run ends in ``state``.
        """
        optimal = np.flatnonzero(self.optimal_actions[state])
        if not optimal.size:
            raise InputError(f"demonstrator: nothing to demonstrate in state {state}, a run's end")
        if self.label_noise and rng.random() < self.label_noise:
            wrong = np.setdiff1d(self.model.actions_of(state), optimal)
            if wrong.size:
                return int(rng.choice(wrong))
        return int(rng.choice(optimal))

    def trajectory(
        self, state: int, rng: np.random.Generator, max_steps: int = 50
    ) -> list[tuple[int, int]]:
        """Act by ``label`` on the transition model until the run ends or ``max_steps``."""
        return _act(self, self.model, self.terminal, state, rng, max_steps)


@dataclass(frozen=True, eq=False)
class PolicyDemonstrator:
    """Acts by a policy that is known: evenly among the marked actions of each state.

    A run ends where none is marked.

    Attributes:
        model: the transition model.
        actions: bool ``[n_states, n_actions]``, feasible pairs only.
    """

    model: TransitionModel
    actions: np.ndarray

    def label(self, state: int, rng: np.random.Generator) -> int:
        """One of the marked actions.

        Raises:
            InputError: if ``state`` has none.
        """
        marked = np.flatnonzero(self.actions[state])
        if not marked.size:
            raise InputError(f"demonstrator: the policy has no action in state {state}")
        return int(rng.choice(marked))

    def trajectory(
        self, state: int, rng: np.random.Generator, max_steps: int = 50
    ) -> list[tuple[int, int]]:
        """Act by ``label`` on the transition model until the run ends or ``max_steps``."""
        ended = ~np.asarray(self.actions.any(axis=1))
        return _act(self, self.model, ended, state, rng, max_steps)


def _act(
    demonstrator: Demonstrator,
    model: TransitionModel,
    ended: np.ndarray,
    state: int,
    rng: np.random.Generator,
    max_steps: int,
) -> list[tuple[int, int]]:
    """A run of what ``demonstrator`` does, until a state ``ended`` or ``max_steps``."""
    pairs: list[tuple[int, int]] = []
    while not ended[state] and len(pairs) < max_steps:
        action = demonstrator.label(state, rng)
        pairs.append((state, action))
        state = model.sample(state, action, rng)
    return pairs


class RecordedDemonstrator:
    """Repeats what was recorded, and knows nothing else; of contradicting labels the most frequent.

    See ``Labels.most_frequent``.
    """

    def __init__(self, recording: Demonstrations) -> None:
        """Answer from ``recording``."""
        self._recording = recording
        self._action = dict(recording.resolved().pairs)

    @property
    def states(self) -> np.ndarray:
        """Indices of the states it can answer for, ascending: restrict queries to them."""
        return np.array(sorted(self._action), dtype=np.int64)

    def label(self, state: int, rng: np.random.Generator) -> int:
        """The recorded action; ``rng`` is not drawn from.

        Raises:
            InputError: if ``state`` was not recorded.
        """
        if state not in self._action:
            raise InputError(
                f"recorded demonstrations: no label for state {state}; "
                f"{len(self._action)} states are recorded"
            )
        return self._action[state]

    def trajectory(
        self, state: int, rng: np.random.Generator, max_steps: int = 50
    ) -> list[tuple[int, int]]:
        """The rest of the first run that did here what ``label`` says; empty if there is none."""
        record = self._recording
        shown = record.in_order
        here = (record.state[shown] == state) & (record.action[shown] == self._action.get(state))
        if not here.any():
            return []
        rest = shown[here.argmax() :]
        rest = rest[record.trajectory[rest] == record.trajectory[rest[0]]]
        return record.select(rest[:max_steps]).pairs
