"""Hidden rewards, drawn by chance from stated ranges: a goal, costs that matter, and habits.

Of every twenty, eight have a region as goal, four a held pose, eight a free one. Each has one to
three of the costs by name, of sizes drawn evenly on a logarithmic scale from `RANGES`; two of
twenty mind tilted grips besides, for which no learner has a name. Every action costs 0.01, a goal
is worth 1 and a lost cube −1: these learners know. Half of the demonstrators break ties by habit
(least turning of the wrist, then least motion), half by chance.

A region is told by factors of a state drawn by chance (`KINDS_OF_REGION`). A goal is drawn again
if it is reached within 20 actions from less than 95 % of the free states, or if fewer than 40 % of
them are further than one action away.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from experiments.grasping.hidden.costs import LEFT_OUT, costs, factors, nameless_cost
from irl.demonstrators import OracleDemonstrator
from irl.metrics import HORIZON
from irl.planning import policy_success, uniform_policy
from irl.task_data import TaskData
from models.task.spaces import LOST, N_FREE, N_STATES

RANGES = {
    "grip": (0.05, 0.3),
    "layer": (0.05, 0.2),
    "turn": (0.05, 0.3),
    "motion": (0.05, 0.2),
    "surprise": (0.1, 0.8),
}
"""Least and largest size of each cost, where the goal is worth 1."""
TILT = (0.05, 0.2)
"""The same of the cost without a name."""
KINDS_OF_REGION = (
    ("free", ("face",)),
    ("free", ("cell",)),
    ("free", ("cell", "face")),
    ("free", ("face", "yaw")),
    ("held", ("cell", "face", "yaw")),
    ("held", ("face", "gripper")),
    ("held", ("cell", "gripper")),
    ("held", ("cell", "face", "grip")),
)
"""Regions as goals: of free or of held cubes, by the factors that a drawn state lends."""
ACTION_COST, TOLERANCE = 0.01, 0.005
OFTEN = 20
"""One round of rewards: what shares are counted in."""


@dataclass(frozen=True, eq=False)
class HiddenReward:
    """One demonstrator's wish.

    Attributes:
        number: which of those drawn.
        goal: what it is, in words.
        kind: ``free``, ``held`` or ``region``.
        goal_states: indices.
        sizes: of its costs, by name.
        habit: whether ties are broken by habit.
        oracle: plans for it, and demonstrates.
        moved: share of states whose co-optimal actions differ from those without its costs.
    """

    number: int
    goal: str
    kind: str
    goal_states: np.ndarray
    sizes: dict[str, float]
    habit: bool
    oracle: OracleDemonstrator
    moved: float

    @property
    def told(self) -> dict[str, Any]:
        """What a result says of it."""
        return {
            "reward": self.number,
            "kind": self.kind,
            "goal": self.goal,
            "goal_states": int(self.goal_states.size),
            "costs": {name: round(size, 3) for name, size in self.sizes.items()},
            "habit": self.habit,
            "moved": round(self.moved, 3),
        }


@dataclass(frozen=True, eq=False)
class HabitualDemonstrator(OracleDemonstrator):
    """Breaks ties alike every time: the co-optimal action of the least effort.

    Attributes:
        effort: ``[n_pairs]``, distinct in each state.
    """

    effort: np.ndarray = None  # type: ignore[assignment]

    @cached_property
    def preferred(self) -> np.ndarray:
        """The action of every state, int64 ``[n_states]``; −1 where a run ends."""
        effort = self.model.table(-self.effort)
        effort[~self.optimal_actions] = -np.inf
        return np.where(self.optimal_actions.any(axis=1), effort.argmax(axis=1), -1)

    @property
    def shown(self) -> np.ndarray:
        """As of `OracleDemonstrator`: 1 for the preferred action."""
        return np.arange(self.model.n_actions) == self.preferred[:, np.newaxis]

    def label(self, state: int, rng: np.random.Generator) -> int:
        """The preferred action, or with probability ``label_noise`` a wrong one."""
        if self.label_noise and rng.random() < self.label_noise:
            wrong = np.setdiff1d(
                self.model.actions_of(state), np.flatnonzero(self.optimal_actions[state])
            )
            if wrong.size:
                return int(rng.choice(wrong))
        return int(self.preferred[state])


def draw(task: TaskData, numbers: Iterable[int], seed: int) -> list[HiddenReward]:
    """Rewards of a seed by number, from 0; each depends on the seed and its number alone.

    Args:
        task: the robot's.
        numbers: which.
        seed: of the generator; those of development and of reports differ.
    """
    named = costs(task.model) | {"surprise": task.model.surprise}
    named[LEFT_OUT] = nameless_cost(task.model)
    return [_reward(task, named, number, seed) for number in numbers]


def is_nameless(number: int) -> bool:
    """Whether a reward has a cost without a name."""
    return number % OFTEN in (7, 19)


def told_by(number: int) -> tuple[str, ...]:
    """The factors that a reward's goal is told by; none if it is a single state."""
    place = number % OFTEN
    return KINDS_OF_REGION[place][1] if place < len(KINDS_OF_REGION) else ()


def _reward(task: TaskData, named: dict[str, np.ndarray], number: int, seed: int) -> HiddenReward:
    rng = np.random.default_rng([seed, number])
    place = number % OFTEN
    kind = "region" if place < 8 else "held" if place < 12 else "free"
    sizes = _sizes(rng, nameless=is_nameless(number))
    plainly = np.full(task.model.n_pairs, ACTION_COST)
    pair_cost = plainly + sum(size * named[name] for name, size in sizes.items())
    while True:
        told, goal = _goal(kind, KINDS_OF_REGION[place % 8], task, rng)
        oracle = _oracle(task, goal, pair_cost, named, habit=bool(number % 2))
        if _reasonable(task, oracle):
            break
    plain = _oracle(task, goal, plainly, named, habit=False)
    differs = (oracle.optimal_actions != plain.optimal_actions).any(axis=1)
    counted = task.model.reachable(task.start_states) & ~oracle.terminal
    moved = float(differs[counted].mean())
    return HiddenReward(number, told, kind, goal, sizes, bool(number % 2), oracle, moved)


def _sizes(rng: np.random.Generator, nameless: bool) -> dict[str, float]:
    names = rng.choice(list(RANGES), rng.integers(1, 4), replace=False)
    ranges = {name: RANGES[name] for name in RANGES if name in names}
    if nameless:
        ranges[LEFT_OUT] = TILT
    return {name: float(np.exp(rng.uniform(*np.log(span)))) for name, span in ranges.items()}


def _goal(
    kind: str, region: tuple[str, tuple[str, ...]], task: TaskData, rng: np.random.Generator
) -> tuple[str, np.ndarray]:
    """A goal in words, and its states."""
    where, by = (kind, ()) if kind != "region" else region
    reached = np.flatnonzero(task.model.reachable(task.start_states))
    of = reached[reached < N_FREE] if where == "free" else reached[reached >= N_FREE]
    state = int(rng.choice(of[of < N_STATES]))
    if kind != "region":
        return f"state {state}", np.array([state])
    parts = factors()
    free = np.arange(N_STATES + 1) < N_FREE
    member = free if where == "free" else ~free
    for name in by:
        member = member & (parts[name] == parts[name][state])
    told = ", ".join(f"{name} {parts[name][state]}" for name in by)
    return f"{where}: {told}", np.flatnonzero(member)


def _oracle(
    task: TaskData,
    goal: np.ndarray,
    pair_cost: np.ndarray,
    named: dict[str, np.ndarray],
    habit: bool,
) -> OracleDemonstrator:
    plain = OracleDemonstrator(
        task.model,
        goal,
        gamma=task.gamma,
        lost_states=np.array([LOST]),
        action_cost=pair_cost,
        tolerance=TOLERANCE,
    )
    return habitual(plain, named) if habit else plain


def habitual(plain: OracleDemonstrator, named: dict[str, np.ndarray]) -> HabitualDemonstrator:
    """The same wish with a person's habits; ``named``: costs of pairs, turn and motion of them."""
    # Turning first, motion where that is equal, and the action's number last.
    effort = named["turn"] + 1e-3 * named["motion"] + 1e-6 * plain.model.pair_action
    return HabitualDemonstrator(**vars_of(plain), effort=effort)


def vars_of(oracle: OracleDemonstrator) -> dict[str, Any]:
    """The fields of an oracle, without what it computed from them."""
    return {name: getattr(oracle, name) for name in OracleDemonstrator.__dataclass_fields__}


def with_noise(reward: HiddenReward, share: float) -> HiddenReward:
    """The same wish, of a demonstrator who gives wrong labels with this probability."""
    return replace(reward, oracle=replace(reward.oracle, label_noise=share))


def _reasonable(task: TaskData, oracle: OracleDemonstrator) -> bool:
    """Whether a goal can be reached from nearly everywhere, and is not where runs begin."""
    policy = uniform_policy(oracle.optimal_actions)
    reached = policy_success(task.model, policy, oracle.goal_states, HORIZON)[task.start_states]
    soon = policy_success(task.model, policy, oracle.goal_states, 1)[task.start_states]
    return bool(reached.mean() >= 0.95 and (soon < 0.5).mean() >= 0.4)
