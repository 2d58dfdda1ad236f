"""Grids on which methods are tried, with all that each method needs to learn them."""

import numpy as np

from irl.advice import Advice
from irl.baselines.birl import SamplingConfig
from irl.demonstrations import Demonstrations
from irl.domains.gridworld import GridWorld, goal_cell
from irl.planning import transition_matrix, value_iteration

GAMMA = 0.9
QUICK = {
    "bellman_gradient": {"max_iterations": 20},
    "linear_mlirl": {"max_iterations": 20},
    "deep_max_ent": {"iterations": 100},
    "birl": {"sampling": SamplingConfig(chains=2, burn_in=100, samples=50, thin=2)},
}


class World:
    """A grid whose centre pays 1 whenever it is entered, and a walk from each corner."""

    def __init__(self, n: int) -> None:
        self.grid = GridWorld(n, goal_cell(n, "centre"))
        self.model = self.grid.model
        self.reward = np.eye(self.grid.n_states)[self.grid.goal_state]
        self.V, self.Q = value_iteration(self.model, self.reward, GAMMA)
        self.walks = Demonstrations.from_trajectories(self.grid.trajectories("diagonal"))

    def demonstrations(self, name: str) -> Demonstrations:
        """Four walks suffice, except for a posterior mean over 225 rewards."""
        if name != "birl" or self.grid.n == 5:
            return self.walks
        rng, after, runs = np.random.default_rng(0), self.model.P.indices, []
        for cell in range(self.grid.n_states):
            state, pairs = cell, []
            while state != self.grid.goal_state:
                best = np.flatnonzero(self.Q[state] > self.Q[state].max() - 1e-9)
                pairs.append((state, int(rng.choice(best))))
                state = int(after[self.model.pair_index(*pairs[-1])])
            runs.append(pairs)
        return Demonstrations.from_trajectories(runs)

    def options(self, name: str) -> dict:
        """What a method needs besides: (3.9) lives on advice, (3.12) on its basis functions."""
        if name == "lp_advice":
            worse = self.model.mask & (self.Q.max(axis=1, keepdims=True) - 1e-9 > self.Q)
            return {"advice": Advice(np.zeros_like(worse), worse), "hardness": 0.01}
        if name == "lp_basis":
            return {"basis": np.hstack([self.reward[:, None], self.grid.features])}
        return QUICK.get(name, {})

    def value_share(self, q: np.ndarray) -> float:
        """What the policy earns under the hidden reward, over the optimum, from every cell."""
        P = transition_matrix(self.model, q.argmax(axis=1)).toarray()
        earned = np.linalg.solve(np.eye(len(P)) - GAMMA * P, P @ self.reward)
        return earned.sum() / self.V.sum()
