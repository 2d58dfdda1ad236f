"""A grid-world whose reward is known, and what a policy learnt on it is worth."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest

from irl.collection import demonstrate
from irl.demonstrations import Demonstrations
from irl.demonstrators import PolicyDemonstrator
from irl.domains.gridworld import GridWorld
from irl.mdp import TransitionModel
from irl.planning import transition_matrix, value_iteration

GAMMA = 0.9


@pytest.fixture
def grid(request) -> GridWorld:
    """n × n cells, n = 5 or as parametrised; entering the goal earns 1, again and again."""
    n = getattr(request, "param", 5)
    return GridWorld(n, (2 * n // 3, n // 4))


@pytest.fixture
def true_reward(grid) -> np.ndarray:
    """The hidden reward ``[n_states]``."""
    return np.eye(grid.n_states)[grid.goal_state]


@pytest.fixture
def optimal_policy(grid, true_reward) -> np.ndarray:
    """One of the best policies under the hidden reward, integer ``[n_states]``."""
    return value_iteration(grid.model, true_reward, GAMMA)[1].argmax(axis=1)


@pytest.fixture
def strict_policy(grid, true_reward):
    """The best policy where small differences between cells leave no ties."""
    cells = 1e-3 * np.random.default_rng(0).random(grid.n_states)
    return value_iteration(grid.model, true_reward + cells, GAMMA)[1].argmax(axis=1)


@pytest.fixture
def optimal_walks(grid, optimal_policy) -> Demonstrations:
    """From every corner the best way to the goal, which ends a walk."""
    last = grid.n - 1
    return _walks(grid, optimal_policy, [(0, 0), (last, 0), (0, last), (last, last)])


@pytest.fixture
def border_walks(grid, optimal_policy) -> Demonstrations:
    """The same from every cell of the border."""
    border = ((grid.cells == 0) | (grid.cells == grid.n - 1)).any(axis=1)
    return _walks(grid, optimal_policy, grid.cells[border])


def _walks(grid: GridWorld, policy: np.ndarray, cells) -> Demonstrations:
    actions = np.eye(4, dtype=bool)[policy]
    actions[grid.goal_state] = False
    starts = [grid.index(*cell) for cell in cells]
    return demonstrate(PolicyDemonstrator(grid.model, actions), starts, np.random.default_rng(0))


@pytest.fixture
def share_of_optimum_of(grid) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """What a policy earns under a reward, over the optimum; ``[n_states]``."""

    def share(reward: np.ndarray, policy: np.ndarray) -> np.ndarray:
        P = transition_matrix(grid.model, policy).toarray()
        earned = np.linalg.solve(np.eye(grid.n_states) - GAMMA * P, P @ reward)
        return earned / value_iteration(grid.model, reward, GAMMA)[0]

    return share


@pytest.fixture
def share_of_optimum(true_reward, share_of_optimum_of) -> Callable[[np.ndarray], np.ndarray]:
    """What a policy earns under the hidden reward, over the optimum; ``[n_states]``."""
    return partial(share_of_optimum_of, true_reward)


@pytest.fixture
def dense_soft_policies():
    """Soft policies ``[n_states, n_actions]`` by moves to go, from dense tables."""

    def policies(
        model: TransitionModel, reward: np.ndarray, horizon: int, gamma: float = 1.0
    ) -> list[np.ndarray]:
        V, found = np.zeros(model.n_states), []
        for _ in range(horizon):
            e = np.exp(model.q_values(reward + gamma * V))
            total = e.sum(axis=1, keepdims=True)
            V = np.where(total > 0, np.log(np.maximum(total, 1e-300)), 0.0)[:, 0]
            found.append(e / np.maximum(total, 1e-300))
        return found

    return policies


@pytest.fixture
def stochastic(random_model) -> TransitionModel:
    """A random model of 12 states, 3 actions, several successors, the last state a dead end."""
    return random_model(np.random.default_rng(3), n_states=12, n_actions=3)
