"""Small models with known answers, and random ones to check against other methods."""

from collections import defaultdict

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import spsolve

from irl.demonstrations import Demonstrations
from irl.domains.gridworld import MOVES, GridWorld
from irl.generalisation import Generalisation
from irl.mdp import TransitionModel
from irl.planning import value_iteration
from irl.task import TaskData, Transitions

# (state, action, next state, probability): 0 → 1 → 2 → 3, moving right works 9 times in 10 from
# 0 and 1 and always from 2; left always works; 3 is absorbing, with nothing to do.
CHAIN = [
    (0, 0, 0, 1.0),
    (0, 1, 1, 0.9),
    (0, 1, 0, 0.1),
    (1, 0, 0, 1.0),
    (1, 1, 2, 0.9),
    (1, 1, 1, 0.1),
    (2, 0, 1, 1.0),
    (2, 1, 3, 1.0),
]


@pytest.fixture
def chain() -> TransitionModel:
    """A chain of 4 states with the actions 0, left, and 1, right."""
    state, action, after, p = (np.array(column) for column in zip(*CHAIN, strict=True))
    return TransitionModel.from_entries(4, 2, state, action, after, p)


@pytest.fixture
def random_model():
    """Build a random sparse model: ``random_model(rng, n_states, n_actions)``."""

    def build(rng: np.random.Generator, n_states: int = 30, n_actions: int = 4) -> TransitionModel:
        feasible = rng.random((n_states, n_actions)) < 0.6
        feasible[:, 0] |= ~feasible.any(axis=1)
        feasible[-1] = False
        entries = []
        for s, a in zip(*np.nonzero(feasible), strict=True):
            successors = rng.choice(n_states, size=rng.integers(1, 4), replace=False)
            for s_next, p in zip(successors, rng.dirichlet(np.ones(successors.size)), strict=True):
                entries.append((s, a, s_next, p))
        state, action, after, p = (np.array(column) for column in zip(*entries, strict=True))
        return TransitionModel.from_entries(n_states, n_actions, state, action, after, p)

    return build


@pytest.fixture
def small_task() -> TaskData:
    """The chain as a task, with a little of everything."""
    state, action, after, p = (np.array(column) for column in zip(*CHAIN, strict=True))
    return TaskData(
        name="chain",
        states=[{"x": f"{0.1 * k}", "note": 'a "quoted", comma'} for k in range(4)],
        actions=[{"kind": "left"}, {"kind": "right"}],
        transitions=Transitions(
            state=state.astype(np.int32),
            action=action.astype(np.int32),
            next_state=after.astype(np.int32),
            probability=p,
            count=np.arange(8, dtype=np.int64),
            evidence=np.array([0, 0, 0, 1, 1, 1, 2, 2], dtype=np.uint8),
        ),
        goal_states=np.array([3]),
        start_states=np.array([0, 1]),
        gamma=0.9,
        features={
            "thesis": np.linspace(0, 1, 8).reshape(4, 2),
            "rotation": np.eye(4, 3, dtype=np.float32),
        },
        clusters={"low": np.array([0, 1]), "all": np.arange(4)},
        preferred=np.array([3]),
        avoided=np.zeros(0, dtype=np.int64),
        generalisation=Generalisation(
            state=np.array([0, 1, 2, 0], dtype=np.int32),
            action=np.array([1, 1, 1, 0], dtype=np.int32),
            group=np.array([0, 0, 0, 1], dtype=np.int32),
            rule=np.array([0, 0, 0, 1], dtype=np.uint8),
            rule_names=["onwards", "back"],
        ),
        demonstrations=Demonstrations.from_pairs([(0, 1), (1, 1)]),
        fixed_vr={2: -1.0},
        provenance={"seed": 7},
    )


class SlipperyGrid:
    """n × n cells; a move goes to another side, any of the four, with probability ``slip``.

    Every move costs 1 until the goal is reached, where a run ends: it stays there, is free to
    leave, or nothing can be done.
    """

    gamma = 0.99

    def __init__(self, n, goal, end, slip=0.2):
        self.n, self.goal = n, goal[1] * n + goal[0]
        self.features = GridWorld(n, goal).features
        y, x = np.divmod(np.arange(n * n), n)
        to = np.stack(
            [np.clip(y + v, 0, n - 1) * n + np.clip(x + u, 0, n - 1) for u, v in MOVES], axis=1
        )
        chance: dict = defaultdict(float)
        for s in range(n * n):
            if s == self.goal and end != "leave":
                if end == "stay":
                    chance[s, 0, s] = 1.0
                continue
            for a in range(4):
                chance[s, a, to[s, a]] += 1 - slip
                for b in range(4):
                    chance[s, a, to[s, b]] += slip / 4
        entries = (np.array(column) for column in zip(*chance, strict=True))
        self.model = TransitionModel.from_entries(n * n, 4, *entries, np.array([*chance.values()]))
        self.cost = np.where(self.model.pair_state == self.goal, 0.0, -1.0)
        self.V, self.Q = value_iteration(
            self.model, np.zeros(n * n), self.gamma, pair_reward=self.cost, terminal=[self.goal]
        )

    def value(self, policy):
        """Mean value over all cells of a policy ``[n_states, n_actions]``, by a linear system."""
        model = self.model
        weight = policy[model.pair_state, model.pair_action] * (model.pair_state != self.goal)
        choice = sparse.csr_matrix((weight, (model.pair_state, np.arange(model.n_pairs))))
        choice.resize(model.n_states, model.n_pairs)
        A = sparse.identity(model.n_states) - self.gamma * (choice @ model.P)
        return spsolve(A.tocsc(), choice @ self.cost).mean()

    def share(self, q):
        """How far acting greedily by ``q`` comes from the random to the optimal value."""
        mask = self.model.mask
        chance = self.value(mask / np.maximum(mask.sum(axis=1, keepdims=True), 1))
        return (self.value(np.eye(4)[q.argmax(axis=1)]) - chance) / (self.V.mean() - chance)

    def walks(self, seed):
        """An optimal walk from each corner."""
        rng, last, runs = np.random.default_rng(seed), self.n - 1, []
        for corner in (0, last, self.n * last, self.n * self.n - 1):
            state, pairs = corner, []
            while state != self.goal:
                best = np.flatnonzero(self.Q[state] > self.Q[state].max() - 1e-7)
                pairs.append((state, int(rng.choice(best))))
                state = self.model.sample(*pairs[-1], rng)
            runs.append(pairs)
        return Demonstrations.from_trajectories(runs)


@pytest.fixture(scope="session")
def slippery_grid():
    """A large grid to learn: ``slippery_grid(n, goal, end)``."""
    return SlipperyGrid
