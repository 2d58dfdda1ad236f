"""Gymnasium's tabular environments as transition models, and policies played in gymnasium.

    world = from_gymnasium(env)  # FrozenLake, Taxi, CliffWalking, or any env with a table P
    learnt = learn("planning", world.model, demonstrations, features, gamma=0.95, rng=rng)
    episodes = play(env, learnt.q.argmax(axis=1), seed=0, episodes=100)

Environments are only ever handed in, so this module needs no gymnasium to be imported.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from irl.choices import check_number, check_range
from irl.errors import InputError
from irl.evaluation import TOLERANCE
from irl.gymnasium_spaces import numbering, table_entries
from irl.integers import integers, reals
from irl.mdp import TransitionModel
from irl.metrics import Share

if TYPE_CHECKING:
    import gymnasium


@dataclass(frozen=True, eq=False)
class TabularWorld:
    """What an environment's table ``P`` says.

    Attributes:
        model: the transition model; in a state that ends a run, action 0 always stays there.
        pair_reward: expected reward of each pair, float64 ``[n_pairs]``. Discounted or not, the
            expected return of any policy is the same as with rewards on (s, a, s').
        terminal: indices of the states that end a run, int64 ``[n]``.
        start: distribution of the first state, float64 ``[n_states]``.
    """

    model: TransitionModel
    pair_reward: np.ndarray
    terminal: np.ndarray
    start: np.ndarray


@dataclass(frozen=True, eq=False)
class Episodes:
    """Runs of one policy, one entry an episode.

    Attributes:
        returns: undiscounted sum of rewards, float64 ``[n]``.
        lengths: number of actions, int64 ``[n]``.
        last_state: int64 ``[n]``.
        terminated: whether the run ended by itself, not for want of time; bool ``[n]``.
        truncated: whether it was cut off by the environment's own limit; bool ``[n]``. A run that
            is neither was given up after ``max_steps``.
    """

    returns: np.ndarray
    lengths: np.ndarray
    last_state: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray

    def success(self, goal_states: np.ndarray) -> Share:
        """How many runs ended at a goal; its ``interval`` is Wilson's, of 95 %."""
        reached = self.terminated & np.isin(self.last_state, goal_states)
        return Share(int(reached.sum()), reached.size)


def from_gymnasium(env: "gymnasium.Env") -> TabularWorld:
    """Read the table ``P[s][a]`` = [(probability, next state, reward, terminated), …].

    States and actions count from 0 in what is returned, from wherever the environment counts.
    Equal successors are merged and impossible ones left out. What the table says of states where a
    run has ended is replaced by one action, number 0, that stays and earns nothing. True returns
    remain as they are; and for a learner, a constant in the reward no longer decides whether it is
    better to end early or late, as it would if nothing followed the end.

    Args:
        env: an environment with discrete states and actions whose unwrapped form has ``P`` and
            ``initial_state_distrib``, as all of gymnasium's toy-text worlds but Blackjack. What an
            environment does besides ``P``, such as Taxi's fickle passenger, is not seen.

    Raises:
        InputError: if the environment has no such table, the table is not a transition model, it
            cannot be told from where it counts, or a state that can be reached sometimes ends a
            run and sometimes doesn't.
    """
    world: Any = env.unwrapped
    if not hasattr(world, "P") or not hasattr(world, "initial_state_distrib"):
        raise InputError(f"environment {env}: no table P with an initial_state_distrib to read")
    start = reals(world.initial_state_distrib, f"environment {env}: initial_state_distrib")
    if start.ndim != 1 or not ((start >= 0).all() and abs(start.sum() - 1) <= TOLERANCE):
        raise InputError(
            f"probabilities that sum to 1 wanted, sum to {start.sum():.9g}",
            place=f"environment {env}: initial_state_distrib",
        )
    n_states, n_actions = start.size, int(world.action_space.n)
    table = table_entries(world, n_states, n_actions)
    state, action, next_state = (np.array([row[k] for row in table], np.int64) for k in (0, 1, 3))
    p, reward = (np.array([row[k] for row in table], np.float64) for k in (2, 4))
    ends = np.array([row[5] for row in table], dtype=bool)

    terminal = np.unique(next_state[ends & (p > 0)])
    undecided = np.intersect1d(terminal, _passed(start > 0, state, next_state, ~ends & (p > 0)))
    if undecided.size:
        raise InputError(
            f"environment {env}: state {undecided[0]} ends a run on some ways into it only; "
            "a transition model needs two states there"
        )
    kept = (p != 0) & ~np.isin(state, terminal)
    stay = np.stack([terminal, np.zeros_like(terminal), terminal])
    entries = np.hstack([np.stack([state, action, next_state])[:, kept], stay])
    p, reward = np.r_[p[kept], np.ones(terminal.size)], np.r_[reward[kept], np.zeros(terminal.size)]
    (s, a, after), merged = np.unique(entries, axis=1, return_inverse=True)
    together = np.bincount(merged.ravel(), p)
    model = TransitionModel.from_entries(n_states, n_actions, s, a, after, together)
    pair_reward = np.bincount(model.pair_index(*entries[:2]), p * reward, model.n_pairs)
    return TabularWorld(model, pair_reward, terminal, start)


def _passed(
    start: np.ndarray, state: np.ndarray, next_state: np.ndarray, goes_on: np.ndarray
) -> np.ndarray:
    """Indices of the states in which some run from ``start``, bool ``[n_states]``, goes on."""
    passed = start.copy()
    count = -1
    while count != (count := int(passed.sum())):
        passed[next_state[goes_on & passed[state]]] = True
    return np.flatnonzero(passed)


def play(
    env: "gymnasium.Env",
    policy: np.ndarray,
    *,
    seed: int,
    episodes: int = 100,
    max_steps: int = 1000,
) -> Episodes:
    """Play a policy in an environment with discrete states.

    Args:
        env: the environment; it is left open.
        policy: actions, integer ``[n_states]``, such as ``irl.policy.Policy.action``, −1 for none;
            or probabilities ``[n_states, n_actions]``, a row of 0 for none. States and actions
            count from 0, here and in what is returned, whatever ``start`` the environment's
            spaces have.
        seed: of the environment's chance, given at the first reset, and of the policy's own. The
            same seed meets the same chance whatever was played before.
        episodes: how many, at least 1.
        max_steps: where a run is given up; the environment's own time limits count too.

    Raises:
        InputError: if ``episodes`` or ``max_steps`` is below 1, ``seed`` below 0, a space is not
            discrete, the policy is neither actions nor probabilities, is for another number of
            states or actions, or has no action in a state it meets.
    """
    for name, value, least in (
        ("seed", seed, 0),
        ("episodes", episodes, 1),
        ("max_steps", max_steps, 1),
    ):
        check_number(name, value, whole=True)
        check_range(name, value, least)
    _, n_states = numbering(env, "observation_space")
    _, n_actions = numbering(env, "action_space")
    choose = _chooser(policy, seed, n_states, n_actions)
    runs = [_run(env, choose, seed if k == 0 else None, max_steps) for k in range(episodes)]
    returns, lengths, last_state, terminated, truncated = zip(*runs, strict=True)
    return Episodes(
        np.array(returns, np.float64),
        np.array(lengths, np.int64),
        np.array(last_state, np.int64),
        np.array(terminated, bool),
        np.array(truncated, bool),
    )


def _chooser(
    policy: np.ndarray, seed: int, n_states: int | None, n_actions: int | None
) -> Callable[[int], int]:
    """What to do in a state, −1 for nothing."""
    wanted = [n_states, n_actions][: max(1, np.ndim(policy))]
    if any(n is not None and n != m for n, m in zip(wanted, np.shape(policy), strict=False)):
        raise InputError(f"{wanted} wanted, got {list(np.shape(policy))}", place="policy")
    if np.ndim(policy) != 2:
        action = integers(policy, "policy: actions", low=-1, below=n_actions)
        return lambda state: int(action[state])
    table = reals(policy, "policy")
    total = table.sum(axis=1)
    wrong = (table < 0).any(axis=1) | ~((np.abs(total - 1) <= TOLERANCE) | (total == 0))
    for state in np.flatnonzero(wrong)[:1]:
        raise InputError(
            f"probabilities that sum to 1 wanted, or all 0 for no action, got {table[state]} in "
            f"state {state}",
            place="policy",
        )
    # Environments seed their generator alike: with the same key, choices would follow their chance.
    rng = np.random.default_rng([seed, 1])
    bounds = np.cumsum(table, axis=1)

    def choose(state: int) -> int:
        if total[state] == 0:
            return -1
        drawn = rng.random() * bounds[state, -1]
        return int(np.searchsorted(bounds[state], drawn, side="right"))

    return choose


def _run(
    env: "gymnasium.Env", choose: Callable[[int], int], seed: int | None, max_steps: int
) -> tuple[float, int, int, bool, bool]:
    """Return, length, last state, whether the run ended by itself, whether it was cut off."""
    first_state, _ = numbering(env, "observation_space")
    first_action, _ = numbering(env, "action_space")
    seen, _ = env.reset(seed=seed)
    state = int(seen) - first_state
    total, steps, terminated, truncated = 0.0, 0, False, False
    while not (terminated or truncated) and steps < max_steps:
        action = choose(state)
        if action < 0:
            raise InputError(f"policy: no action in state {state}, where the run goes on")
        seen, reward, terminated, truncated, _ = env.step(action + first_action)
        state = int(seen) - first_state
        total, steps = total + float(reward), steps + 1
    # A run that ends by itself in its last allowed step was not cut off.
    return total, steps, state, bool(terminated), bool(truncated and not terminated)
