"""A grid-world whose reward is known, and what a policy learnt on it is worth."""

from collections.abc import Callable

import numpy as np
import pytest

from irl.demonstrations import Demonstrations
from irl.domains.gridworld import GridWorld
from irl.mdp import TransitionModel
from irl.planning import transition_matrix, value_iteration

GAMMA = 0.9


@pytest.fixture
def grid() -> GridWorld:
    """5 × 5 cells; entering the goal, off the centre, earns 1, again and again."""
    return GridWorld(5, (3, 1))


@pytest.fixture
def true_reward(grid) -> np.ndarray:
    """The hidden reward ``[n_states]``."""
    return np.eye(grid.n_states)[grid.goal_state]


@pytest.fixture
def optimal_policy(grid, true_reward) -> np.ndarray:
    """One of the best policies under the hidden reward, integer ``[n_states]``."""
    return value_iteration(grid.model, true_reward, GAMMA)[1].argmax(axis=1)


@pytest.fixture
def optimal_walks(grid, optimal_policy) -> Demonstrations:
    """From every corner the best way to the goal, which ends a walk."""
    after = grid.model.P.indices  # moves are certain: one successor a pair
    walks = []
    for k, corner in enumerate((0, 4, 20, 24)):
        state, pairs = corner, []
        while state != grid.goal_state:
            pairs.append((state, optimal_policy[state]))
            state = after[grid.model.pair_index(*pairs[-1])]
        walks.append(Demonstrations.from_pairs(pairs, trajectory=k))
    return Demonstrations.concatenate(walks)


@pytest.fixture
def share_of_optimum(grid, true_reward) -> Callable[[np.ndarray], np.ndarray]:
    """What a policy earns under the hidden reward, over the optimum; ``[n_states]``."""

    def share(policy: np.ndarray) -> np.ndarray:
        P = transition_matrix(grid.model, policy).toarray()
        earned = np.linalg.solve(np.eye(grid.n_states) - GAMMA * P, P @ true_reward)
        return earned / value_iteration(grid.model, true_reward, GAMMA)[0]

    return share


@pytest.fixture
def stochastic(random_model) -> TransitionModel:
    """A random model of 12 states, 3 actions, several successors, the last state a dead end."""
    return random_model(np.random.default_rng(3), n_states=12, n_actions=3)
