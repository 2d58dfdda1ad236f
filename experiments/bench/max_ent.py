"""One step of maximum causal entropy inverse reinforcement learning, against ``imitation``.

A step is soft values, expected discounted visits, and the gradient of one reward per state.
``imitation`` keeps dense transitions, knows no infeasible pair, and looks ``HORIZON`` moves ahead,
by when the discount leaves nothing that shows; it earns R(s) *in* s, discounted once less than on
entering. On a grid where a move off the edge stays, all pairs are feasible in both.
"""

import numpy as np

from experiments.bench.comparison import Peers, Row, best_of, one_core
from experiments.bench.learning import one_thread
from irl.baselines.differentiable_planning import Planner, SoftMax
from irl.domains.gridworld import MOVES
from irl.mdp import TransitionModel

SIDE = 45  # cells: 2,025 states, the fifth column of Table 6.1
GAMMA = 0.9
HORIZON = 200  # moves; 0.9²⁰⁰ is below 1e-9
WANTED = 100.0
REPEATS = 3


def rows(peers: Peers, seed: int) -> list[Row]:
    """Time the step on the same model, reward and starts, and compare its visits."""
    rng = np.random.default_rng(seed)
    model, n = walled_grid(SIDE), SIDE**2
    reward, start, demonstrated = rng.normal(size=n), rng.dirichlet(np.ones(n)), rng.random(n)

    def step() -> tuple[np.ndarray, np.ndarray]:
        planner = Planner(model, GAMMA, SoftMax())  # a new one, which knows no earlier solution
        planner.solve(GAMMA * reward)
        visits = planner.pull(start)
        return visits, demonstrated - visits

    entries = model.P.tocoo()
    with one_core(), one_thread():
        ours = best_of(step, 20)
        theirs = peers.run(
            "imitation_mce.py",
            state=model.pair_state[entries.row],
            action=model.pair_action[entries.row],
            next_state=entries.col,
            probability=entries.data,
            reward=reward,
            start=start,
            demonstrated=demonstrated,
            gamma=np.array(GAMMA),
            horizon=np.array(HORIZON),
            repeats=np.array(REPEATS),
        )
        ours = min(ours, best_of(step, 20))  # on both sides of the peer's turn
    visits, _ = step()
    return [
        Row(
            work=f"maximum causal entropy step, {n:,} states, γ = {GAMMA}",
            ours_s=ours,
            other="imitation, mce_occupancy_measures",
            other_s=float(theirs["seconds"]),
            wanted=WANTED,
            details={
                "max_visit_deviation": float(np.abs(visits - theirs["visits"]).max()),
                "largest_visits": float(visits.max()),
            },
        )
    ]


def walled_grid(side: int) -> TransitionModel:
    """``irl.domains.gridworld`` with walls: a move off the grid stays, so every pair exists."""
    y, x = np.divmod(np.arange(side**2), side)
    target = np.clip(np.stack([x, y], axis=1)[:, None, :] + MOVES, 0, side - 1)
    state, action = np.divmod(np.arange(side**2 * len(MOVES)), len(MOVES))
    return TransitionModel.from_entries(
        side**2,
        len(MOVES),
        state,
        action,
        (target[..., 1] * side + target[..., 0]).ravel(),
        np.ones(state.size),
    )
