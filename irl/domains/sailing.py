"""The Sailing domain: cross a lake in the least time while the wind turns at random.

R. J. Vanderbei's *Optimal Sailing Strategies* (Princeton), the stochastic benchmark on which Odom &
Natarajan (2016) seek advice (thesis Figures 6.1, 6.2). A boat sails from one of n × n
waypoints to one of its eight neighbours, a *leg*. How long a leg takes depends on the angle
between its heading and where the wind comes from; to turn the boat so that the wind hits the
other side of the sails takes ``delay`` more. After each leg the wind stays or turns by 45°.

Conventions. The eight directions count clockwise from north; x grows to the east, y to the north.
A wind is named by the direction it blows *towards*, so a boat that heads where the wind
blows sails *away*. A leg is on *starboard* tack if the wind comes from the right, on *port* tack
if from the left, and on neither (*neutral*) when sailing away: to or from neutral costs nothing.
State (x, y, wind, tack), the tack being that of the last leg, has the index
((y·n + x)·8 + wind)·3 + tack.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from irl.choices import check_range
from irl.demonstrators import OracleDemonstrator
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.pairs import pair_key
from irl.planning import transition_matrix

DIRECTIONS = ("N", "NE", "E", "SE", "S", "SW", "W", "NW")
HEADINGS = np.array([(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)])
TACKS = ("port", "neutral", "starboard")
PORT, NEUTRAL, STARBOARD = range(3)
POINTS_OF_SAIL = ("into", "up", "cross", "down", "away")  # 0, 45, 90, 135, 180° off the wind
LEG_TIMES = (np.inf, 4.0, 3.0, 2.0, 1.0)  # minutes, Vanderbei; nobody sails into the wind

# Vanderbei's transition matrix: from each direction, to the one before, itself, the one after.
_TURNS = np.array(
    [
        (0.3, 0.4, 0.3),
        (0.4, 0.3, 0.3),
        (0.4, 0.3, 0.3),
        (0.4, 0.3, 0.3),
        (0.4, 0.2, 0.4),
        (0.3, 0.3, 0.4),
        (0.3, 0.3, 0.4),
        (0.3, 0.3, 0.4),
    ]
)


def wind_chain() -> np.ndarray:
    """P(wind' | wind), float64 ``[8, 8]``: Vanderbei's probabilities.

    It mirrors east and west, is reversible, and prefers northerly directions.
    """
    chain = np.zeros((8, 8))
    for wind, row in enumerate(_TURNS):
        chain[wind, (wind + np.arange(-1, 2)) % 8] = row
    return chain


def point_of_sail(heading: np.ndarray | int, wind: np.ndarray | int) -> np.ndarray:
    """Index into ``POINTS_OF_SAIL``: eighths of a turn between heading and source of the wind."""
    bearing = (np.asarray(wind) + 4 - heading) % 8
    return np.minimum(bearing, 8 - bearing)


def tack_of(heading: np.ndarray | int, wind: np.ndarray | int) -> np.ndarray:
    """Index into ``TACKS`` of a leg; neutral also where it would go into the wind."""
    bearing = (np.asarray(wind) + 4 - heading) % 8
    return np.select([bearing % 4 == 0, bearing < 4], [NEUTRAL, STARBOARD], PORT)


@dataclass(frozen=True)
class Sailing:
    """A lake of n × n waypoints; every run ends at the goal.

    Attributes:
        n: waypoints a side.
        goal: (x, y); the north-east corner if absent, the corner that faces the start in
            Vanderbei's example.
        delay: minutes to change between port and starboard tack.

    Raises:
        InputError: if n is below 3, the goal is off the lake or the delay is negative.
    """

    n: int = 8
    goal: tuple[int, int] | None = None
    delay: float = 3.0

    def __post_init__(self) -> None:
        """Place the goal and check the numbers."""
        check_range("size", self.n, 3)
        check_range("delay", self.delay, 0)
        goal = (self.n - 1, self.n - 1) if self.goal is None else self.goal
        if not all(0 <= c < self.n for c in goal):
            raise InputError(f"goal: {goal} is off the {self.n} × {self.n} lake")
        object.__setattr__(self, "goal", goal)

    @property
    def n_states(self) -> int:
        """Number of states, 24 n²."""
        return self.n**2 * 24

    def index(self, x: np.ndarray, y: np.ndarray, wind: np.ndarray, tack: np.ndarray) -> np.ndarray:
        """State index; arguments broadcast."""
        return ((np.asarray(y) * self.n + x) * 8 + wind) * 3 + tack

    @cached_property
    def states(self) -> np.ndarray:
        """int64 ``[n_states, 4]``: x, y, wind, tack of every state."""
        y, x, wind, tack = np.unravel_index(np.arange(self.n_states), (self.n, self.n, 8, 3))
        return np.stack([x, y, wind, tack], axis=1)

    @cached_property
    def model(self) -> TransitionModel:
        """Legs on the lake and not into the wind; all others are absent.

        It knows nothing of the goal, which can be left like any other waypoint.
        """
        wind = self.states[:, 2]
        target = self.states[:, None, :2] + HEADINGS
        on_lake = ((target >= 0) & (target < self.n)).all(axis=2)
        sailable = point_of_sail(np.arange(8), wind[:, None]) > 0
        state, heading = np.nonzero(on_lake & sailable)
        chain = wind_chain()
        pair, next_wind = np.nonzero(chain[wind[state]])
        state, heading = state[pair], heading[pair]
        next_x, next_y = target[state, heading].T
        return TransitionModel.from_entries(
            self.n_states,
            8,
            state,
            heading,
            self.index(next_x, next_y, next_wind, tack_of(heading, wind[state])),
            chain[wind[state], next_wind],
        )

    @cached_property
    def leg_times(self) -> np.ndarray:
        """Minutes each feasible leg takes, delay included; float64 ``[n_pairs]``."""
        state, heading = self.model.pair_state, self.model.pair_action
        wind, before = self.states[state, 2], self.states[state, 3]
        opposite = np.abs(tack_of(heading, wind) - before) == STARBOARD - PORT
        return np.array(LEG_TIMES)[point_of_sail(heading, wind)] + self.delay * opposite

    @cached_property
    def goal_states(self) -> np.ndarray:
        """The goal under every wind and tack; int64 ``[24]``."""
        return np.flatnonzero((self.states[:, :2] == self.goal).all(axis=1))

    @cached_property
    def at_goal(self) -> np.ndarray:
        """Which states end a run; bool ``[n_states]``."""
        ended = np.zeros(self.n_states, dtype=bool)
        ended[self.goal_states] = True
        return ended

    @cached_property
    def starts(self) -> np.ndarray:
        """Every waypoint but the goal, every wind, neutral tack; int64 ``[8 (n² − 1)]``."""
        return np.flatnonzero((self.states[:, 3] == NEUTRAL) & ~self.at_goal)

    @cached_property
    def features(self) -> np.ndarray:
        """What a linear value may depend on, blind to the goal; float64 ``[n_states, 89]``.

        All products of a monomial of x and y (both scaled to −1…1) up to degree two, a harmonic of
        the wind's direction up to the second, and 1, port or starboard; without the constant.
        """
        x, y = 2 * self.states[:, :2].T / (self.n - 1) - 1
        angle = self.states[:, 2] * np.pi / 4
        one = np.ones(self.n_states)
        place = np.stack([one, x, y, x * x, x * y, y * y])
        wind = np.stack([one, *(h(k * angle) for k in (1, 2) for h in (np.cos, np.sin))])
        tack = np.stack([one, self.states[:, 3] == PORT, self.states[:, 3] == STARBOARD])
        return np.einsum("is,js,ks->sijk", place, wind, tack).reshape(self.n_states, -1)[:, 1:]

    def demonstrator(self, gamma: float, label_noise: float = 0.0) -> OracleDemonstrator:
        """A sailor who knows the leg times and the goal, and minimises discounted minutes."""
        return OracleDemonstrator(
            self.model,
            self.goal_states,
            gamma,
            goal_reward=0.0,
            action_cost=self.leg_times,
            label_noise=label_noise,
        )

    def minutes_to_goal(self, policy: np.ndarray, gamma: float) -> np.ndarray:
        """Expected discounted minutes Σ γᵗ c_t that a policy sails; float64 ``[n_states]``.

        Exact within 1e-9. Discounting keeps it finite where the goal is never reached.

        Args:
            policy: actions ``[n_states]`` or probabilities ``[n_states, 8]``.
            gamma: discount factor a leg, in [0, 1).
        """
        if policy.ndim == 1:
            policy = np.eye(8)[policy]
        share = policy[self.model.pair_state, self.model.pair_action]
        cost = np.bincount(self.model.pair_state, share * self.leg_times, self.n_states)
        cost[self.at_goal] = 0.0
        onward = sparse.diags_array(gamma * ~self.at_goal) @ transition_matrix(self.model, policy)
        total, change = cost, cost
        while change.max() > 1e-9 * (1 - gamma):
            change = onward @ change
            total = total + change
        return total

    def sectors(self) -> np.ndarray:
        """Clusters a sailor would name: the wind × where the goal lies; int64 ``[n_states]``.

        The goal lies exactly in one of the eight directions or between two of them, which makes
        16 sectors, of which a goal in a corner leaves 5. −1 at the goal.
        """
        east, north = np.array(self.goal)[:, None] - self.states[:, :2].T
        eighths = np.round(np.arctan2(east, north) / (np.pi / 4), 9) % 8
        sector = np.floor(eighths) + np.ceil(eighths)
        return np.where(self.at_goal, -1, sector.astype(np.int64) * 8 + self.states[:, 2])


def ideal_clusters(optimal: np.ndarray, kind: np.ndarray) -> np.ndarray:
    """Clusters whose states share their optimal action, and a kind such as the wind.

    Args:
        optimal: co-optimal actions, bool ``[n_states, n_actions]``, none where a run ends; among
            several the first counts.
        kind: int64 ``[n_states]``, at least 0.

    Returns:
        int64 ``[n_states]``, −1 where a run ends.
    """
    cluster = pair_key(kind, optimal.argmax(axis=1), optimal.shape[1])
    return np.where(optimal.any(axis=1), cluster, -1)


def shuffled_clusters(clusters: np.ndarray, quality: float, rng: np.random.Generator) -> np.ndarray:
    """Let a share 1 − ``quality`` of the states exchange their clusters at random.

    Sizes stay as they are: 1 leaves the clusters alone, 0 assigns every state at random.

    Args:
        clusters: int64 ``[n_states]``, −1 for states outside, which stay there.
        quality: in [0, 1].
        rng: draws the states and their new places.
    """
    check_range("quality", quality, 0, 1)
    inside = np.flatnonzero(clusters >= 0)
    moved = rng.choice(inside, round((1 - quality) * inside.size), replace=False)
    result = clusters.copy()
    result[moved] = clusters[rng.permutation(moved)]
    return result


def purity(clusters: np.ndarray, optimal: np.ndarray) -> float:
    """Share of states for which the action that is best for most of their cluster is best.

    Args:
        clusters: int64 ``[n_states]``, −1 for states outside.
        optimal: co-optimal actions, bool ``[n_states, n_actions]``.
    """
    inside = clusters >= 0
    votes = np.zeros((clusters.max() + 1, optimal.shape[1]))
    np.add.at(votes, clusters[inside], optimal[inside])
    return float(votes.max(axis=1).sum() / inside.sum())
