"""What the goal may be: states where runs ended, where rewards were found, and regions around them.

A region is named by what its states have in common: "position 4, face 2" are all states that agree
with a proposed one in these two factors, whatever the others are.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

_FEW = 6  # factors of which every subset makes a region


@dataclass(frozen=True, eq=False)
class Goal:
    """A set of states where a demonstrator may want to be.

    Attributes:
        name: what its states have in common, in words.
        member: bool ``[n_states]``.
        parts: number of factors that it is named by; 0 for a single state or a list of them.
    """

    name: str
    member: np.ndarray
    parts: int = 0

    @property
    def is_list(self) -> bool:
        """Whether it is of several states that nothing names but themselves."""
        return not self.parts and bool(self.member.sum() > 1)

    @property
    def key(self) -> bytes:
        """Equal for equal sets."""
        return np.packbits(self.member).tobytes()


def regions(state: int, factors: Mapping[str, np.ndarray]) -> list[Goal]:
    """The state alone, and every set of states that agree with it in some of the factors.

    With more than six factors, in one or two of them, or in all but one or two.

    Args:
        state: which state.
        factors: name → int64 ``[n_states]``.

    Returns:
        Distinct sets, the smallest first.
    """
    names = list(factors)
    n_states = len(next(iter(factors.values()))) if factors else None
    found: dict[bytes, Goal] = {}
    sizes = range(len(names), 0, -1)
    if len(names) > _FEW:
        sizes = [k for k in sizes if k <= 2 or k >= len(names) - 2]  # type: ignore[assignment]
    alike = {name: factors[name] == factors[name][state] for name in names}
    for size in sizes:
        for some in combinations(names, size):
            member = np.logical_and.reduce([alike[name] for name in some])
            told = ", ".join(f"{name} {factors[name][state]}" for name in some)
            goal = Goal(told, member, size)
            found[goal.key] = goal  # by the fewest factors that say it
    if n_states is not None:
        single = one_state(state, n_states)
        found[single.key] = single
        found.pop(Goal("all", np.ones(n_states, dtype=bool)).key, None)
    return sorted(found.values(), key=lambda goal: int(goal.member.sum()))


def one_state(state: int, n_states: int) -> Goal:
    """A single state as a goal."""
    return any_of([state], n_states)


def any_of(states: Sequence[int], n_states: int) -> Goal:
    """A list of states as a goal: any of them will do."""
    member = np.zeros(n_states, dtype=bool)
    member[list(states)] = True
    told = " or ".join(f"state {s}" for s in states)
    return Goal(told, member)


def propose(
    ends: np.ndarray,
    rewarded: np.ndarray,
    factors: Mapping[str, np.ndarray],
    n_states: int,
) -> list[Goal]:
    """Every goal worth a thought.

    Args:
        ends: states where runs ended, the most frequent first, int64.
        rewarded: states of the largest learnt rewards, the largest first, int64.
        factors: name → int64 ``[n_states]``; may be empty.
        n_states: number of states.

    Returns:
        Distinct goals: the states alone, regions around them, the first of either list together.
    """
    found: dict[bytes, Goal] = {}

    def add(goals: Sequence[Goal]) -> None:
        for goal in goals:
            found.setdefault(goal.key, goal)

    for state in [*ends.tolist(), *rewarded.tolist()]:
        add([one_state(state, n_states)])
    for state in [*ends.tolist(), *rewarded.tolist()]:
        add(regions(state, factors))
    for several in (ends, rewarded):
        add([any_of(several[:k].tolist(), n_states) for k in range(2, len(several) + 1)])
    return list(found.values())


def beyond(
    goals: Sequence[Goal], ends: np.ndarray, taken: np.ndarray, askable: np.ndarray
) -> int | None:
    """A state that is taken for a goal, though what ended there might as well have meant less.

    Of all such states one that the fewest goals hold which hold every end: what is said of it
    decides most of them at once. A list of ends is no such goal.

    Args:
        goals: every goal proposed.
        ends: states where runs ended, int64.
        taken: bool ``[n_states]``, the states taken for goals.
        askable: the states that may be asked about, int64.

    Returns:
        The state; None if all that is taken for a goal is in every goal that holds all ends, or
        none may be asked about.
    """
    holding = [g for g in goals if not g.is_list and g.member[ends].all()]
    states = np.intersect1d(np.flatnonzero(taken), askable)
    if not holding or not states.size:
        return None
    held = np.sum([g.member[states] for g in holding], axis=0)
    return int(states[held.argmin()]) if held.min() < len(holding) else None
