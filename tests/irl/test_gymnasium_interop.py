from types import SimpleNamespace

import numpy as np
import pytest

from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.gymnasium_interop import from_gymnasium, play
from irl.methods import learn
from irl.metrics import success_mdp
from irl.planning import value_iteration

WORLDS = [
    ("FrozenLake-v1", {}),
    ("FrozenLake-v1", {"is_slippery": False}),
    ("FrozenLake8x8-v1", {}),
    ("Taxi-v4", {}),
    ("Taxi-v4", {"is_rainy": True}),
    ("CliffWalking-v1", {}),
    ("CliffWalkingSlippery-v1", {}),
]


def make(name, **options):
    return pytest.importorskip("gymnasium").make(name, **options)


def optimal_q(world, gamma=0.99):
    nothing = np.zeros(world.model.n_states)
    return value_iteration(world.model, nothing, gamma, pair_reward=world.pair_reward)


def values_by_the_table(env, policy, gamma):
    """Policy evaluation on ``P`` itself: runs end where it says terminated."""
    table = env.unwrapped.P
    n = len(table)
    P, r = np.zeros((n, n)), np.zeros(n)
    for s in range(n):
        for p, after, reward, terminated in table[s][policy[s]]:
            r[s] += p * reward
            P[s, after] += p * (not terminated)
    return np.linalg.solve(np.eye(n) - gamma * P, r)


@pytest.mark.parametrize(("name", "options"), WORLDS)
def test_any_policy_is_worth_what_the_table_says(name, options):
    env = make(name, **options)
    world = from_gymnasium(env)
    model, gamma = world.model, 0.9
    policy = np.random.default_rng(0).integers(model.n_actions, size=model.n_states)
    expected = values_by_the_table(env, policy, gamma)
    policy[world.terminal] = 0
    rows = model.pair_index(np.arange(model.n_states), policy)
    P = model.P[rows].toarray()
    found = np.linalg.solve(np.eye(model.n_states) - gamma * P, world.pair_reward[rows])
    reached = np.flatnonzero(model.reachable(np.flatnonzero(world.start)))
    compared = np.setdiff1d(reached, world.terminal)
    np.testing.assert_allclose(found[compared], expected[compared], atol=1e-12)
    np.testing.assert_allclose(found[world.terminal], 0, atol=1e-12)
    assert compared.size > 10


@pytest.mark.parametrize(("name", "options"), WORLDS)
def test_runs_end_in_terminal_states_and_nowhere_else(name, options):
    world = from_gymnasium(make(name, **options))
    stays = world.model.P[world.model.pair_index(world.terminal, 0)]
    np.testing.assert_array_equal(stays.toarray(), np.eye(world.model.n_states)[world.terminal])
    feasible = world.model.mask.sum(axis=1)
    assert (feasible[world.terminal] == 1).all()
    assert (np.delete(feasible, world.terminal) == world.model.n_actions).all()
    assert world.start.sum() == pytest.approx(1)
    assert not world.start[world.terminal].any()


def test_known_ends():
    assert from_gymnasium(make("FrozenLake-v1")).terminal.tolist() == [5, 7, 11, 12, 15]
    assert from_gymnasium(make("CliffWalking-v1")).terminal.tolist() == [47]
    taxi = make("Taxi-v4")
    encode = taxi.unwrapped.encode
    delivered = [encode(*taxi.unwrapped.locs[k], k, k) for k in range(4)]
    assert from_gymnasium(taxi).terminal.tolist() == sorted(delivered)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    # The optima that gymnasium registers with its environments; the cliff's is a 13-step walk.
    [("FrozenLake-v1", 0.70, 0.78), ("Taxi-v4", 7.5, 8.46), ("CliffWalking-v1", -13, -13)],
)
def test_the_optimal_policy_earns_the_known_optimum(name, low, high):
    env = make(name)
    _, Q = optimal_q(from_gymnasium(env), gamma=0.999)
    episodes = play(env, Q.argmax(axis=1), seed=0, episodes=400)
    assert low <= episodes.returns.mean() <= high
    for array, kind in (("returns", float), ("lengths", int), ("last_state", int)):
        assert getattr(episodes, array).dtype == kind
        assert getattr(episodes, array).shape == (400,)


def test_equal_seeds_meet_equal_chance():
    env = make("FrozenLake-v1")
    _, Q = optimal_q(from_gymnasium(env))
    a, b, other = (play(env, Q.argmax(axis=1), seed=s, episodes=30) for s in (1, 1, 2))
    np.testing.assert_array_equal(a.lengths, b.lengths)
    np.testing.assert_array_equal(a.returns, b.returns)
    assert (a.lengths != other.lengths).any()


def test_success_counts_goals_that_were_reached_in_time():
    env = make("FrozenLake-v1")
    _, Q = optimal_q(from_gymnasium(env))
    episodes = play(env, Q.argmax(axis=1), seed=0, episodes=50)
    reached = episodes.success(np.array([15]))
    assert reached.successes == episodes.returns.sum() < 50
    assert reached.interval[0] < reached.value < reached.interval[1]
    hurried = play(env, Q.argmax(axis=1), seed=0, episodes=50, max_steps=3)
    assert hurried.lengths.max() == 3
    assert hurried.success(np.array([15])).successes == 0
    # A run given up in a state is no success there.
    assert hurried.success(np.arange(16)).successes == hurried.terminated.sum() < 50


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("name", ["max_ent", "deep_max_ent"])
def test_runs_cut_where_chance_ended_them_teach_the_ice(name, seed):
    """Pairs alone: neither where a run ended is told, nor that it did."""
    world = from_gymnasium(make("FrozenLake8x8-v1"))
    model, goal, gamma = world.model, np.array([63]), 0.95
    best = optimal_q(world)[1].argmax(axis=1)
    rng, runs = np.random.default_rng(seed), []
    for _ in range(40):
        state, run = 0, []
        while state not in world.terminal:
            run.append((state, int(best[state])))
            state = model.sample(*run[-1], rng)
        runs.append(run)
    columns = np.stack(np.divmod(np.arange(64), 8), axis=1) / 7
    learnt = learn(
        name, model, Demonstrations.from_trajectories(runs), columns, gamma=gamma,
        rng=np.random.default_rng(seed),
    )  # fmt: skip
    found, optimum = (
        success_mdp(model, action, goal, np.array([0]), horizon=200)
        for action in (learnt.q.argmax(axis=1), best)
    )
    assert optimum == pytest.approx(0.863, abs=1e-3)
    assert found >= optimum - 0.02


def test_a_policy_without_action_is_named():
    with pytest.raises(InputError, match="no action in state 0"):
        play(make("FrozenLake-v1"), np.full(16, -1), seed=0)
    with pytest.raises(InputError, match="episodes"):
        play(make("FrozenLake-v1"), np.zeros(16, int), seed=0, episodes=0)


def small(table, start=(1, 0)):
    """An environment reduced to what is read of it, with as many actions as state 0 has."""
    world = SimpleNamespace(
        P=table, initial_state_distrib=start, action_space=SimpleNamespace(n=len(table[0]))
    )
    return SimpleNamespace(unwrapped=world)


def test_equal_successors_are_merged_with_their_mean_reward():
    outcomes = [(0.25, 1, 4.0, True), (0.5, 1, 0.0, True), (0.25, 0, 2.0, False), (0.0, 0, 9, True)]
    world = from_gymnasium(small({0: {0: outcomes}, 1: {0: [(1.0, 0, 5.0, False)]}}))
    np.testing.assert_array_equal(world.model.P.toarray(), [[0.25, 0.75], [0, 1]])
    np.testing.assert_array_equal(world.pair_reward, [1.5, 0])


def test_what_is_no_transition_model_is_refused():
    sometimes = {0: {0: [(1.0, 1, 0, True)], 1: [(1.0, 1, 0, False)]}, 1: {0: [(1.0, 0, 0, False)]}}
    with pytest.raises(InputError, match="state 1 ends a run on some ways"):
        from_gymnasium(small(sometimes))
    with pytest.raises(InputError, match="sum to 1"):
        from_gymnasium(small({0: {0: [(0.5, 1, 0, True)]}, 1: {0: [(1.0, 1, 0, True)]}}))
    with pytest.raises(InputError, match="no table P"):
        from_gymnasium(SimpleNamespace(unwrapped=SimpleNamespace()))


class Coin:
    """Two states, heads 0 and tails 1, by the environment's own chance; the action is recorded."""

    def __init__(self, ends=lambda step: (False, step == 100)):
        self.ends, self.seen = ends, []

    def reset(self, seed=None):
        if seed is not None:
            self.rng = np.random.default_rng(seed)
        self.step_number = 0
        return 0, {}

    def step(self, action):
        self.step_number += 1
        heads = self.rng.random() < 0.5
        self.seen.append((action, int(heads)))
        return 0, 1.0, *self.ends(self.step_number), {}


def test_a_policy_by_chance_is_played_by_its_own_chance():
    for seed in range(3):
        env = Coin()
        play(env, np.array([[0.25, 0.0, 0.75]]), seed=seed, episodes=100)
        action, heads = np.array(env.seen).T
        assert set(action) == {0, 2}
        # 10,000 draws: a standard deviation is 0.0043 of a share, and 0.01 of a correlation.
        assert (action == 0).mean() == pytest.approx(0.25, abs=0.018)
        assert abs(np.corrcoef(action, heads)[0, 1]) < 0.04
        again = Coin()
        play(again, np.array([[0.25, 0.0, 0.75]]), seed=seed, episodes=100)
        assert again.seen == env.seen


def test_a_policy_by_chance_that_is_certain_is_the_policy():
    env = make("FrozenLake-v1")
    _, Q = optimal_q(from_gymnasium(env))
    action = Q.argmax(axis=1)
    sure, plain = (play(env, p, seed=3, episodes=30) for p in (np.eye(4)[action], action))
    np.testing.assert_array_equal(sure.lengths, plain.lengths)
    np.testing.assert_array_equal(sure.last_state, plain.last_state)


def test_a_random_policy_earns_what_it_is_worth():
    env = make("FrozenLake-v1")
    world = from_gymnasium(env)
    even = world.model.mask / world.model.mask.sum(axis=1, keepdims=True)
    table = env.unwrapped.P
    A, b = np.eye(16), np.zeros(16)
    for s in range(16):
        for a in range(4):
            for p, after, reward, terminated in table[s][a]:
                b[s] += p * reward / 4
                A[s, after] -= p / 4 * (not terminated)
    for s in world.terminal:
        A[s], b[s] = np.eye(16)[s], 0
    episodes = play(env, even, seed=0, episodes=4000)
    worth = np.linalg.solve(A, b)[0]
    assert episodes.returns.mean() == pytest.approx(worth, abs=4 * np.sqrt(worth / 4000))


@pytest.mark.parametrize(
    "policy", [[[0.5, 0.4]], [[1.5, -0.5]], [[np.nan, 1.0]], [[np.inf, 0.0]], [[0.2, 0.0]]]
)
def test_what_is_no_policy_by_chance_is_refused(policy):
    with pytest.raises(InputError, match=r"policy: probabilities that sum to 1 .* in state 0"):
        play(Coin(), np.array(policy), seed=0)


def test_a_policy_by_chance_may_have_no_action_where_no_run_comes():
    assert play(Coin(), np.array([[1.0], [0.0]]), seed=0, episodes=1).lengths.tolist() == [100]
    with pytest.raises(InputError, match="no action in state 0"):
        play(Coin(), np.array([[0.0], [1.0]]), seed=0)


@pytest.mark.parametrize(
    ("ends", "most", "told"),
    [
        ((True, False), 9, (True, False)),
        ((False, True), 9, (False, True)),
        ((True, True), 9, (True, False)),  # at the limit, but by itself
        ((False, False), 3, (False, False)),
    ],
)
def test_an_end_a_limit_and_giving_up_are_told_apart(ends, most, told):
    env = Coin(lambda step: ends if step == 5 else (False, False))
    episodes = play(env, np.array([0]), seed=0, episodes=2, max_steps=most)
    assert episodes.lengths.tolist() == [min(5, most)] * 2
    assert list(zip(episodes.terminated, episodes.truncated, strict=True)) == [told] * 2


def test_gymnasiums_own_limit_is_a_truncation():
    env = make("CliffWalking-v1", max_episode_steps=7)
    episodes = play(env, np.zeros(48, int), seed=0, episodes=2)
    assert episodes.truncated.all()
    assert not episodes.terminated.any()


class Shifted:
    """FrozenLake as an environment that counts states and actions from other numbers than 0."""

    def __init__(self, states=3, actions=7):
        self.inner, spaces = make("FrozenLake-v1"), pytest.importorskip("gymnasium.spaces")
        self.observation_space = spaces.Discrete(16, start=states)
        self.action_space = spaces.Discrete(4, start=actions)
        self.initial_state_distrib = self.inner.unwrapped.initial_state_distrib
        self.unwrapped = self
        self.P = {
            s + states: {
                a + actions: [(p, t + states, r, end) for p, t, r, end in outcomes]
                for a, outcomes in row.items()
            }
            for s, row in self.inner.unwrapped.P.items()
        }

    def reset(self, seed):
        state, told = self.inner.reset(seed=seed)
        return state + self.observation_space.start, told

    def step(self, action):
        assert self.action_space.contains(action)
        state, *rest = self.inner.step(action - self.action_space.start)
        return state + self.observation_space.start, *rest


def test_spaces_that_do_not_start_at_0_are_read_and_played_alike():
    env, plain = Shifted(), make("FrozenLake-v1")
    world, same = from_gymnasium(env), from_gymnasium(plain)
    np.testing.assert_array_equal(world.model.P.toarray(), same.model.P.toarray())
    np.testing.assert_array_equal(world.pair_reward, same.pair_reward)
    np.testing.assert_array_equal(world.terminal, same.terminal)
    best = optimal_q(world)[1].argmax(axis=1)
    ours, theirs = (play(e, best, seed=0, episodes=30) for e in (env, plain))
    np.testing.assert_array_equal(ours.returns, theirs.returns)
    np.testing.assert_array_equal(ours.last_state, theirs.last_state)


@pytest.mark.parametrize("form", ["lists", "array"])
def test_tables_come_as_lists_and_as_arrays(form):
    plain = make("FrozenLake-v1")
    table = [[plain.unwrapped.P[s][a] for a in range(4)] for s in range(16)]
    if form == "array":  # as many outcomes each, those that never happen with probability 0
        table = np.array([[(row + [(0, 0, 0, False)] * 3)[:3] for row in rows] for rows in table])
        assert table.shape == (16, 4, 3, 4)
    start = plain.unwrapped.initial_state_distrib
    world, same = from_gymnasium(small(table, start)), from_gymnasium(plain)
    np.testing.assert_array_equal(world.model.P.toarray(), same.model.P.toarray())
    np.testing.assert_array_equal(world.pair_reward, same.pair_reward)


def test_a_table_of_unknown_numbering_or_form_is_refused_by_name():
    spaces = pytest.importorskip("gymnasium.spaces")
    env = small({1: {0: [(1.0, 1, 0.0, True)]}, 0: {0: [(1.0, 1, 0.0, True)]}})
    env.unwrapped.observation_space = spaces.Discrete(2, start=1)  # and the table counts from 0
    assert from_gymnasium(env).terminal.tolist() == [1]
    env.unwrapped.P = {1: {0: [(1.0, 1, 0.0, True)]}}  # the first, or the second?
    with pytest.raises(InputError, match=r"P, states: 1…1 fit counting from either.*0…1, 1…2"):
        from_gymnasium(env)
    env.unwrapped.P = {5: {0: [(1.0, 5, 0.0, True)]}}
    with pytest.raises(InputError, match="counting from neither"):
        from_gymnasium(env)
    for table, words in (
        ("a", "a dict, a list or an array wanted, got str"),
        (np.full((2, 1, 2), 0.5), r"P\[0\]\[0\]: \(probability, next state"),
        ({0: {0: [(1.0, 0.5, 0.0, True)]}}, "next state"),
    ):
        with pytest.raises(InputError, match=words):
            env.unwrapped.P = table
            from_gymnasium(env)


def test_a_policy_of_another_environment_is_refused():
    with pytest.raises(InputError, match=r"policy: \[16\] wanted, got \[64\]"):
        play(make("FrozenLake-v1"), np.zeros(64, int), seed=0)
    with pytest.raises(InputError, match=r"policy: \[16, 4\] wanted, got \[16, 5\]"):
        play(make("FrozenLake-v1"), np.full((16, 5), 0.2), seed=0)
    with pytest.raises(InputError, match="must lie in -1…3, is 4"):
        play(make("FrozenLake-v1"), np.full(16, 4), seed=0)
    with pytest.raises(InputError, match=r"observation_space: a discrete space wanted.*Tuple"):
        play(make("Blackjack-v1"), np.zeros(16, int), seed=0)


GOOD = {0: {0: [(1.0, 1, 0.0, False)]}, 1: {0: [(1.0, 1, 0.0, False)]}}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({2: {0: [(1.0, 1, 0.0, False)]}}, r"P: state 2, .*states must lie in 0…1"),
        ({0: {0: [(1.0, 7, 0.0, False)]}}, r"P: state 0, action 0, next state 7: states must lie"),
        ({0: {3: [(1.0, 1, 0.0, False)]}}, r"P: state 0, action 3, .* actions in 0…"),
        ({0: {0: [(1.0, 1, np.nan, False)]}}, "P: state 0, action 0: the reward is nan"),
        ({1: {}}, "P: state 0, action 0 leads to state 1, of which nothing is told"),
        ({"0": {0: [(1.0, 1, 0.0, False)]}}, "P: keys: integers"),
        ({0: {0.5: [(1.0, 1, 0.0, False)]}}, r"P\[0\]: keys: integers"),
    ],
)
def test_a_table_that_does_not_fit_its_spaces_is_refused_by_state_and_action(changes, words):
    assert from_gymnasium(small(GOOD)).model.n_pairs == 2
    with pytest.raises(InputError, match=words):
        from_gymnasium(small(GOOD | changes))


@pytest.mark.parametrize("start", [[np.nan, 1.0], [0.5, 0.0], [1.5, -0.5], ["a", "b"]])
def test_starts_that_are_no_probabilities_are_refused(start):
    env = small(GOOD)
    env.unwrapped.initial_state_distrib = start
    with pytest.raises(InputError, match="initial_state_distrib: "):
        from_gymnasium(env)


@pytest.mark.parametrize(
    "given", [{"seed": -1}, {"seed": 0.5}, {"episodes": 2.5}, {"max_steps": np.nan}]
)
def test_numbers_of_play_that_are_no_whole_ones_are_refused_by_name(given):
    with pytest.raises(InputError, match=f"^{next(iter(given))}: "):
        play(Coin(), np.zeros(2, int), **({"seed": 0} | given))
