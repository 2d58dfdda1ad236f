"""One step of maximum causal entropy IRL with ``imitation``: visitations, then the gradient.

Reads ``transition [n, A, n]`` as its indices ``state, action, next_state`` and ``probability``,
``reward [n]``, ``start [n]``, ``demonstrated [n]``, ``gamma``, ``horizon`` and ``repeats``. Writes
the shortest time, ``seconds``; the discounted ``visits [n]``; and the ``gradient [n]`` for one
reward per state.
"""

import sys
import time

import numpy as np
from imitation.algorithms.mce_irl import mce_occupancy_measures, mce_partition_fh
from seals.base_envs import TabularModelPOMDP

given = np.load(sys.argv[1], allow_pickle=False)
n, n_actions = given["reward"].size, int(given["action"].max()) + 1
gamma = float(given["gamma"])
transition = np.zeros((n, n_actions, n))
transition[given["state"], given["action"], given["next_state"]] = given["probability"]
env = TabularModelPOMDP(
    transition_matrix=transition,
    observation_matrix=np.zeros((n, 1)),
    reward_matrix=given["reward"],
    horizon=int(given["horizon"]),
    initial_state_dist=given["start"],
)


def step() -> tuple[np.ndarray, np.ndarray]:
    """Soft values, the policy that follows from them, where it goes, and the gradient."""
    _, _, pi = mce_partition_fh(env, discount=gamma)
    _, visits = mce_occupancy_measures(env, pi=pi, discount=gamma)
    return visits, given["demonstrated"] - visits


seconds = []
for _ in range(int(given["repeats"])):
    began = time.perf_counter()
    visits, gradient = step()
    seconds.append(time.perf_counter() - began)
np.savez(sys.argv[2], seconds=min(seconds), visits=visits, gradient=gradient)
