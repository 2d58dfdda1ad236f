"""The grid-world of thesis §6.2: n × n cells, four moves, a goal, demonstrations from corners.

Cell (x, y) has index y·n + x; x grows to the right, y upwards. A move off the grid or into a
blocked cell is infeasible and so absent from the transition model, which knows nothing of the
goal: it can be left like any other cell.
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
GOALS = ("centre", "offset", "corner")
TRAJECTORIES = ("diagonal", "border")

Cell = tuple[int, int]


def goal_cell(n: int, goal: str) -> Cell:
    """(x, y) of the goal: ``centre``, ``offset`` = (n // 4, 2n // 3), ``corner`` = (0, 0).

    Raises:
        InputError: if the name is unknown, or the grid has no middle cell.
    """
    check_choice("goal", goal, GOALS)
    if goal == "corner":
        return 0, 0
    if goal == "offset":
        return n // 4, 2 * n // 3
    if n % 2 == 0:
        raise InputError(
            f"goal centre needs an odd size, got {n}; or choose goal offset", place="size"
        )
    return n // 2, n // 2


def bar(n: int) -> frozenset[Cell]:
    """A wall across the middle column, open for a quarter of the side at either end."""
    return frozenset((n // 2, y) for y in range(n // 4, n - n // 4))


def four_rooms(n: int) -> frozenset[Cell]:
    """Walls along the middle row and column, with a door of one cell in the middle of each half.

    After the rooms of Sutton, Precup & Singh (1999).
    """
    middle, doors = n // 2, (n // 4, n - 1 - n // 4)
    along = [k for k in range(n) if k not in doors]
    return frozenset([(middle, k) for k in along] + [(k, middle) for k in along])


@dataclass(frozen=True)
class GridWorld:
    """A grid of ``n`` × ``n`` cells with its goal at the cell ``goal`` = (x, y).

    Attributes:
        n: cells a side.
        goal: (x, y).
        blocked: cells (x, y) that cannot be entered; they stay states, without actions.

    Raises:
        InputError: if n is below 3, a cell is off the grid, or the goal is blocked.
    """

    n: int
    goal: Cell
    blocked: frozenset[Cell] = frozenset()

    def __post_init__(self) -> None:
        """Check the size and the cells."""
        if self.n < 3:
            raise InputError(f"a grid needs at least 3 cells a side, got {self.n}", place="size")
        for name, cells in (("goal", [self.goal]), ("blocked", self.blocked)):
            for cell in cells:
                if not all(0 <= c < self.n for c in cell):
                    raise InputError(f"{name}: {cell} is off the {self.n} × {self.n} grid")
        if self.goal in self.blocked:
            raise InputError(f"goal: {self.goal} is blocked")

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

    @property
    def blocked_states(self) -> np.ndarray:
        """State indices of the blocked cells, ascending."""
        return np.array(sorted(self.index(*cell) for cell in self.blocked), dtype=np.int64)

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
    def _strides(self) -> np.ndarray:
        """What each move adds to the state index."""
        return MOVES @ np.array([1, self.n])

    @cached_property
    def _open(self) -> np.ndarray:
        """Which moves are feasible; bool ``[n_states, 4]``."""
        free = np.zeros((self.n + 2, self.n + 2), dtype=bool)  # [y, x], a frame of no cells
        free[1:-1, 1:-1] = True
        for x, y in self.blocked:
            free[y + 1, x + 1] = False
        inside = slice(1, self.n + 1)
        ahead = [
            free[1 + dy : self.n + 1 + dy, 1 + dx : self.n + 1 + dx] & free[inside, inside]
            for dx, dy in MOVES
        ]
        return np.stack(ahead, axis=-1).reshape(self.n_states, len(MOVES))

    @cached_property
    def model(self) -> TransitionModel:
        """Deterministic moves; infeasible ones are absent."""
        state, action = np.nonzero(self._open)
        return TransitionModel.from_entries(
            self.n_states,
            len(MOVES),
            state,
            action,
            state + self._strides[action],
            np.ones(state.size),
        )

    @cached_property
    def distance(self) -> np.ndarray:
        """Fewest moves to the goal, int64 ``[n_states]``; −1 where there is no way."""
        distance = np.full(self.n_states, -1)
        # Breadth first from the goal: what can be done can be undone.
        ring, moves = np.array([self.goal_state]), 0
        while ring.size:
            distance[ring] = moves
            at, action = np.nonzero(self._open[ring])
            beside = ring[at] + self._strides[action]
            ring, moves = np.unique(beside[distance[beside] < 0]), moves + 1
        return distance

    def trajectories(self, kind: str) -> list[list[tuple[int, int]]]:
        """(state, action) pairs from each of the four corners to the goal, by a shortest way.

        ``diagonal`` steps along x and y in turn (Figure 6.5's staircases) and finishes
        straight. ``border`` follows the edge counter-clockwise as far as that leads nearer to
        the goal, leaves it there and goes straight in; on a grid without blocked cells no two of
        its trajectories share a cell. A corner that is the goal, or that has no way to it,
        yields an empty one.

        Raises:
            InputError: if ``kind`` is unknown.
        """
        check_choice("trajectories", kind, TRAJECTORIES)
        last = self.n - 1
        # Counter-clockwise, the edge that begins in a corner runs along the axis named here.
        corners = (((0, 0), 0), ((last, 0), 1), ((last, last), 0), ((0, last), 1))
        return [self._walk(corner, axis, kind == "diagonal") for corner, axis in corners]

    def _walk(self, corner: Cell, axis: int, alternate: bool) -> list[tuple[int, int]]:
        state, pairs = self.index(*corner), []
        while self.distance[state] > 0:
            actions = np.flatnonzero(self._open[state])
            after = self.distance[state + self._strides[actions]]
            nearer = actions[after < self.distance[state]]
            along = nearer[MOVES[nearer, axis] != 0]
            if not along.size:
                axis, along = 1 - axis, nearer
            action = int(along[0])
            pairs.append((state, action))
            state += int(self._strides[action])
            if alternate:
                axis = 1 - axis
        return pairs

    def demonstrations(self, kind: str) -> tuple[np.ndarray, np.ndarray]:
        """All trajectories of a kind as states and actions, int64 ``[n_pairs]`` each."""
        pairs = [pair for trajectory in self.trajectories(kind) for pair in trajectory]
        state, action = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
        return state, action

    @cached_property
    def limits(self) -> np.ndarray:
        """Which cells are at the grid's limits; bool ``[n_states]``."""
        return ((self.cells == 0) | (self.cells == self.n - 1)).any(axis=1)

    def preferences(self) -> StatePreferences:
        """The thesis' own: the goal is preferred, the cells at the limits are avoided.

        A goal at the limit counts as preferred.
        """
        at_limit = self.limits.copy()
        at_limit[self.goal_state] = False
        return StatePreferences(np.array([self.goal_state]), np.flatnonzero(at_limit))

    def _following(self, policy: np.ndarray) -> np.ndarray:
        """Where ``policy`` leads; an infeasible move stays, and the goal is never left."""
        state = np.arange(self.n_states)
        following = np.where(self._open[state, policy], state + self._strides[policy], state)
        following[self.goal_state] = self.goal_state
        return following

    def moves_to_goal(self, policy: np.ndarray) -> np.ndarray:
        """Moves that ``policy`` ``[n_states]`` takes to the goal; int64 ``[n_states]``.

        An infeasible move stays where it is. −1 if the goal is not reached within 2n moves or,
        where walls make a shortest way longer than that, within the longest such way.
        """
        horizon = max(2 * self.n, int(self.distance.max()))
        there = self._following(policy)
        moves = np.ones(self.n_states, dtype=np.int64)
        moves[self.goal_state] = 0
        ahead = 1
        while ahead < horizon:  # doubles how far ``there`` and ``moves`` look ahead
            moves += moves[there]
            there = there[there]
            ahead *= 2
        return np.where((there == self.goal_state) & (moves <= horizon), moves, -1)

    def accuracy(self, policy: np.ndarray) -> float:
        """Share of cells from which ``policy`` ``[n_states]`` reaches the goal in time.

        What is in time, ``moves_to_goal`` says. Only cells from where there is a way count; the
        goal is one of them, whatever the policy does there.
        """
        return float((self.moves_to_goal(policy)[self.distance >= 0] >= 0).mean())

    def shortest(self, policy: np.ndarray) -> float:
        """The same share, counting shortest ways alone."""
        way = self.distance >= 0
        return float((self.moves_to_goal(policy) == self.distance)[way].mean())

    def stays_at_limits(self, policy: np.ndarray) -> float:
        """Share of the limits' cells, corners aside, where ``policy`` does not move inwards."""
        at = np.flatnonzero(self.limits & (self.distance > 0))
        at = at[(self.cells[at] % (self.n - 1) != 0).any(axis=1)]
        return float(self.limits[self._following(policy)[at]].mean())
