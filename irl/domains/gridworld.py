"""The grid-world of thesis §6.2: n × n cells, four moves, a goal, demonstrations from corners.

Cell (x, y) has index y·n + x; x grows to the right, y upwards. A move off the grid is
infeasible and so absent from the transition model, which knows nothing of the goal: it can
be left like any other cell.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irl.choices import check_choice
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.preferences import StatePreferences

RIGHT, UP, LEFT, DOWN = range(4)
ACTIONS = ("right", "up", "left", "down")
MOVES = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
GOALS = ("centre", "offset")
TRAJECTORIES = ("diagonal", "border")


def goal_cell(n: int, goal: str) -> tuple[int, int]:
    """(x, y) of the goal: the middle cell for ``centre``, (n // 4, 2n // 3) for ``offset``.

    Raises:
        InputError: if the name is unknown, or the grid has no middle cell.
    """
    check_choice("goal", goal, GOALS)
    if goal == "offset":
        return n // 4, 2 * n // 3
    if n % 2 == 0:
        raise InputError(f"size: goal centre needs an odd size, got {n}; or choose goal offset")
    return n // 2, n // 2


@dataclass(frozen=True)
class GridWorld:
    """A grid of ``n`` × ``n`` cells with its goal at the cell ``goal`` = (x, y).

    Raises:
        InputError: if n is below 3, or the goal is off the grid.
    """

    n: int
    goal: tuple[int, int]

    def __post_init__(self) -> None:
        """Check the size and the goal."""
        if self.n < 3:
            raise InputError(f"size: a grid needs at least 3 cells a side, got {self.n}")
        if not all(0 <= c < self.n for c in self.goal):
            raise InputError(f"goal: {self.goal} is off the {self.n} × {self.n} grid")

    def index(self, x: int, y: int) -> int:
        """State index of cell (x, y)."""
        return y * self.n + x

    @property
    def n_states(self) -> int:
        """Number of cells."""
        return self.n**2

    @property
    def goal_state(self) -> int:
        """State index of the goal."""
        return self.index(*self.goal)

    @cached_property
    def cells(self) -> np.ndarray:
        """int64 ``[n_states, 2]``: x, y of every state."""
        y, x = np.divmod(np.arange(self.n_states), self.n)
        return np.stack([x, y], axis=1)

    @cached_property
    def features(self) -> np.ndarray:
        """float64 ``[n_states, 2]``: x and y, scaled to 0…1."""
        return self.cells / (self.n - 1)

    @cached_property
    def model(self) -> TransitionModel:
        """Deterministic moves; those off the grid are absent."""
        target = self.cells[:, None, :] + MOVES
        state, action = np.nonzero(((target >= 0) & (target < self.n)).all(axis=2))
        x, y = target[state, action].T
        return TransitionModel.from_entries(
            self.n_states, len(MOVES), state, action, y * self.n + x, np.ones(state.size)
        )

    def trajectories(self, kind: str) -> list[list[tuple[int, int]]]:
        """(state, action) pairs from each of the four corners to the goal.

        ``diagonal`` steps along x and y by turns (Figure 6.5's staircases) and finishes
        straight. ``border`` follows the edge counter-clockwise as far as the goal's column or
        row, leaves it there and goes straight in, so that no two trajectories share a cell.
        A corner that is the goal yields an empty one.

        Raises:
            InputError: if ``kind`` is unknown.
        """
        check_choice("trajectories", kind, TRAJECTORIES)
        last = self.n - 1
        # Counter-clockwise, the edge that begins in a corner runs along the axis named here.
        corners = (((0, 0), 0), ((last, 0), 1), ((last, last), 0), ((0, last), 1))
        return [self._walk(corner, axis, kind == "diagonal") for corner, axis in corners]

    def _walk(self, corner: tuple[int, int], axis: int, alternate: bool) -> list[tuple[int, int]]:
        cell, goal, pairs = np.array(corner), np.array(self.goal), []
        while (cell != goal).any():
            if cell[axis] == goal[axis]:
                axis = 1 - axis
            ahead = goal[axis] > cell[axis]
            action = ((RIGHT, LEFT), (UP, DOWN))[axis][0 if ahead else 1]
            pairs.append((self.index(*cell), action))
            cell = cell + MOVES[action]
            if alternate:
                axis = 1 - axis
        return pairs

    def demonstrations(self, kind: str) -> tuple[np.ndarray, np.ndarray]:
        """All trajectories of a kind as states and actions, int64 ``[n_pairs]`` each."""
        pairs = [pair for trajectory in self.trajectories(kind) for pair in trajectory]
        state, action = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
        return state, action

    def preferences(self) -> StatePreferences:
        """The thesis' own: the goal is preferred, the cells at the limits are avoided.

        A goal at the limit counts as preferred.
        """
        at_limit = ((self.cells == 0) | (self.cells == self.n - 1)).any(axis=1)
        at_limit[self.goal_state] = False
        return StatePreferences(np.array([self.goal_state]), np.flatnonzero(at_limit))

    def accuracy(self, policy: np.ndarray) -> float:
        """Share of cells from which ``policy`` ``[n_states]`` reaches the goal within 2n moves.

        No best path is longer than 2(n − 1). Reaching the goal counts, whatever the policy
        does there; the goal's own cell counts as reached. A move off the grid stays.
        """
        here = np.arange(self.n_states)
        stepped = np.clip(self.cells + MOVES[policy], 0, self.n - 1)
        following = stepped[:, 1] * self.n + stepped[:, 0]
        following[self.goal_state] = self.goal_state
        for _ in range(2 * self.n):
            here = following[here]
        return float((here == self.goal_state).mean())
