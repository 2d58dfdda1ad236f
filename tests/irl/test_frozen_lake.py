"""Slippery FrozenLake 8 × 8, forty optimal runs cut where they end, from pairs alone."""

import numpy as np
import pytest

from irl.demonstrations import Demonstrations
from irl.gymnasium_interop import from_gymnasium, play
from irl.methods import learn
from irl.planning import policy_success, value_iteration

gymnasium = pytest.importorskip("gymnasium")

GAMMA = 0.99
SLOW = ("max_ent", "deep_max_ent", "linear_mlirl", "bellman_gradient", "birl")
QUICK = ("planning", "lp", "lp_basis", "fa_mlirl")


@pytest.fixture(scope="module")
def lake():
    env = gymnasium.make("FrozenLake-v1", map_name="8x8", is_slippery=True)
    world = from_gymnasium(env)
    goal = np.flatnonzero(env.unwrapped.desc.ravel() == b"G")
    n = world.model.n_states
    _, Q = value_iteration(world.model, np.zeros(n), GAMMA, pair_reward=world.pair_reward)
    return world, goal, Q


def runs(world, Q: np.ndarray, seed: int) -> Demonstrations:
    rng, shown = np.random.default_rng(seed), []
    for _ in range(40):
        state, run = int(world.start.argmax()), []
        while state not in world.terminal:
            best = np.flatnonzero(Q[state] == Q[state].max())
            run.append((state, int(rng.choice(best))))
            state = world.model.sample(*run[-1], rng)
        shown.append(run)
    return Demonstrations.from_trajectories(shown)


def success(world, goal: np.ndarray, q: np.ndarray) -> float:
    return float(policy_success(world.model, q.argmax(axis=1), goal, 200) @ world.start)


def reaches_the_optimum(lake, name: str, seed: int) -> None:
    world, goal, Q = lake
    n = world.model.n_states
    learnt = learn(
        name,
        world.model,
        runs(world, Q, seed),
        np.eye(n),
        gamma=GAMMA,
        rng=np.random.default_rng(seed),
    )
    assert success(world, goal, learnt.q) >= success(world, goal, Q) - 0.02


def test_the_optimum_is_what_gymnasium_plays(lake):
    world, goal, Q = lake
    env = gymnasium.make("FrozenLake-v1", map_name="8x8", is_slippery=True, max_episode_steps=200)
    played = play(env, Q.argmax(axis=1), seed=0, episodes=500).success(goal)
    low, high = played.interval
    assert low - 0.01 <= success(world, goal, Q) <= high + 0.01


@pytest.mark.parametrize("name", QUICK)
def test_quick_methods_reach_the_optimum(lake, name):
    reaches_the_optimum(lake, name, seed=0)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("name", QUICK + SLOW)
def test_every_method_reaches_the_optimum_on_every_set(lake, name, seed):
    reaches_the_optimum(lake, name, seed)


@pytest.mark.parametrize("name", ["lp", "lp_advice", "lp_basis"])
def test_no_sum_of_margins_is_bought_with_the_demonstrated_action_of_the_first_state(name):
    # 4 × 4: the largest sum of margins pays 1 everywhere but in holes. Then all ways that avoid
    # these are alike, and the first of them leads nowhere, which was 0 % success.
    env = gymnasium.make("FrozenLake-v1", map_name="4x4", is_slippery=True)
    world, goal = from_gymnasium(env), np.array([15])
    n = world.model.n_states
    _, Q = value_iteration(world.model, np.zeros(n), GAMMA, pair_reward=world.pair_reward)
    for seed in range(8):
        rng, shown = np.random.default_rng(seed), runs(world, Q, seed)
        learnt = learn(name, world.model, shown, np.eye(n), gamma=GAMMA, rng=rng)
        best = success(world, goal, Q)
        assert success(world, goal, learnt.q) >= best - 0.02, (seed, learnt.note)


@pytest.mark.parametrize("name", ["lp", "lp_advice", "lp_basis"])
def test_a_run_does_not_end_where_nothing_was_demonstrated(name):
    # CliffWalking, every move at the same cost: 13 moves along the cliff are the shortest way. A
    # reward that is explained by runs that end a row above, where nobody was, makes them 15.
    env = gymnasium.make("CliffWalking-v1")
    world = from_gymnasium(env)
    n = world.model.n_states
    way = [(36, 0), *((s, 1) for s in range(24, 35)), (35, 2)]
    given = {"gamma": GAMMA, "rng": np.random.default_rng(0)}
    learnt = learn(name, world.model, Demonstrations.from_pairs(way), np.eye(n), **given)
    assert play(env, learnt.q.argmax(axis=1), seed=0, episodes=1, max_steps=50).returns == [-13]
