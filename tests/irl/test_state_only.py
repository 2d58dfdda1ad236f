import numpy as np
import pytest
from scipy.optimize import minimize

from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.gymnasium_interop import from_gymnasium
from irl.mdp import TransitionModel
from irl.methods import METHODS, learn
from irl.planning import policy_success, value_iteration
from irl.policy import Policy
from irl.state_only import (
    LEARN_FROM_STATES,
    StateRuns,
    action_posterior,
    labelled,
    learn_from_states,
)

FAST = {"behaviour_cloning", "planning", "linear_mlirl"}


def test_moves_are_told_by_run_and_step():
    runs = StateRuns.of([[0, 1, 2], np.array([4, 4])])
    assert runs.moves.tolist() == [[0, 0, 0, 1], [0, 1, 1, 2], [1, 0, 4, 4]]


@pytest.mark.parametrize(
    ("runs", "words"),
    [
        ([], "states: at least one run"),
        ([[0, 1], [2]], "run 1: two states or more"),
        ([[0, 0.5]], "run 0: states: integers .* floats"),
        ([0, 1, 2], r"run 0: states: integers \[n\] wanted, got int64 \[\]"),
        ([[0, -1]], "run 0: states: must lie in 0…"),
    ],
)
def test_what_is_no_run_of_states_is_refused_by_name(runs, words):
    with pytest.raises(InputError, match=words):
        StateRuns.of(runs)


def test_a_move_that_only_one_action_makes_was_made_by_it(chain):
    # Left leads from 1 to 0: who stays in 1 has tried to go right.
    runs = StateRuns.of([[0, 1, 1, 2, 3]])
    assert action_posterior(chain, runs).tolist() == [[0, 1]] * 4
    shown = labelled(runs, action_posterior(chain, runs), np.random.default_rng(0), copies=3)
    assert shown.pairs == [(0, 1), (1, 1), (1, 1), (2, 1)] * 3
    assert shown.trajectory.tolist() == [0] * 4 + [1] * 4 + [2] * 4
    shown.check(chain)


def test_under_a_firm_belief_the_posterior_is_bayes_rule(chain):
    runs = StateRuns.of([[0, 0]])
    for belief in (0.5, 0.9):
        prior = np.tile([1 - belief, belief], (4, 1))
        found = action_posterior(chain, runs, prior, weight=1e9)
        odds = np.array([(1 - belief) * 1.0, belief * 0.1])
        np.testing.assert_allclose(found, [odds / odds.sum()], rtol=1e-6)


def test_what_is_done_in_a_state_is_what_makes_its_moves_likeliest():
    rng = np.random.default_rng(0)
    P = rng.dirichlet(np.ones(6), size=(6, 3))
    model = TransitionModel.from_dense(P)
    done = np.array([0.7, 0.3, 0.0])
    after = rng.choice(6, size=400, p=done @ P[0])
    runs = StateRuns.of([[0, s] for s in after])
    found = action_posterior(model, runs)

    def negative(logits):  # log-likelihood of the moves and of one believed move, an even choice
        log_pi = logits - np.log(np.exp(logits).sum())
        return -np.log(np.exp(log_pi) @ P[0][:, after]).sum() - log_pi.mean()

    answer = minimize(negative, np.zeros(3), tol=1e-10).x
    policy = np.exp(answer) / np.exp(answer).sum()
    expected = policy * P[0][:, after].T
    np.testing.assert_allclose(found, expected / expected.sum(axis=1, keepdims=True), atol=2e-3)


def test_labels_are_told_in_their_shares():
    rng = np.random.default_rng(0)
    runs = StateRuns.of([rng.integers(5, size=9) for _ in range(4)])
    posterior = rng.dirichlet(np.ones(3), size=32)
    posterior[0] = [0, 1, 0]
    shown = labelled(runs, posterior, rng, copies=20)
    assert len(shown) == 20 * 32
    for k, (run, step, state, _) in enumerate(runs.moves):
        rows = (shown.trajectory % 4 == run) & (shown.step == step)
        assert (shown.state[rows] == state).all()
        counted = np.bincount(shown.action[rows], minlength=3)
        assert counted.sum() == 20
        assert np.abs(counted - 20 * posterior[k]).max() < 1


@pytest.fixture(scope="module")
def lake():
    """FrozenLake on slippery ice: each of three actions may have made a move."""
    gymnasium = pytest.importorskip("gymnasium")
    world = from_gymnasium(gymnasium.make("FrozenLake-v1"))
    model = world.model
    _, Q = value_iteration(model, np.zeros(16), 0.99, pair_reward=world.pair_reward)
    optimal, rng, runs = Q.argmax(axis=1), np.random.default_rng(0), []
    for _ in range(100):
        run = [0]
        while run[-1] not in world.terminal and len(run) < 200:
            run.append(model.sample(run[-1], int(optimal[run[-1]]), rng))
        runs.append(run)
    return model, StateRuns.of(runs), policy_success(model, optimal, [15], 200)[0]


@pytest.mark.parametrize("name", sorted(FAST))
def test_states_alone_teach_what_actions_do(lake, name):
    model, runs, best = lake
    for seed in range(2):
        rng = np.random.default_rng(seed)
        learnt = learn_from_states(name, model, runs, gamma=0.99, rng=rng, rounds=2)
        action = Policy.from_q(learnt.q, model.mask).action
        assert policy_success(model, action, [15], 200)[0] > best - 0.02


@pytest.mark.parametrize("name", LEARN_FROM_STATES)
def test_where_states_leave_no_doubt_they_teach_the_same_as_actions(chain, name):
    runs = StateRuns.of([[0, 1, 1, 2, 3], [1, 2, 3]])
    options = {"iterations": 50} if name == "deep_max_ent" else {}
    features = np.arange(4)[:, None] / 3
    given = {"gamma": 0.9, "rounds": 1, **options}
    learnt = learn_from_states(name, chain, runs, features, rng=np.random.default_rng(0), **given)
    told = Demonstrations.from_trajectories([[(0, 1), (1, 1), (1, 1), (2, 1)], [(1, 1), (2, 1)]])
    rng = np.random.default_rng(0)
    known = learn(name, chain, told, features, rng=rng, gamma=0.9, **options)
    assert learnt.q[:3].argmax(axis=1).tolist() == known.q[:3].argmax(axis=1).tolist()
    assert learnt.q[:2].argmax(axis=1).tolist() == [1, 1]
    again = learn_from_states(name, chain, runs, features, rng=np.random.default_rng(0), **given)
    np.testing.assert_array_equal(again.q, learnt.q)


@pytest.mark.parametrize("name", sorted(METHODS.keys() - set(LEARN_FROM_STATES)))
def test_the_others_refuse_by_name(chain, name):
    runs = StateRuns.of([[0, 1]])
    with pytest.raises(InputError, match=rf"method: {name} needs the actions, .*; valid: fa_mlirl"):
        learn_from_states(name, chain, runs, gamma=0.9, rng=np.random.default_rng(0))


def test_what_the_model_does_not_know_is_named(chain):
    given = {"gamma": 0.9, "rng": np.random.default_rng(0)}
    with pytest.raises(
        InputError, match="run 1, step 1: no action leads from state 1 to state 3; if two runs"
    ):
        learn_from_states("planning", chain, StateRuns.of([[0, 1], [0, 1, 3]]), **given)
    with pytest.raises(InputError, match="run 0: states: must lie in 0…3, is 4"):
        learn_from_states("planning", chain, StateRuns.of([[0, 4]]), **given)
    with pytest.raises(InputError, match="unknown name 'magic'"):
        learn_from_states("magic", chain, StateRuns.of([[0, 1]]), **given)
    with pytest.raises(InputError, match="rounds: must be ≥ 1"):
        learn_from_states("planning", chain, StateRuns.of([[0, 1]]), **given, rounds=0)
    with pytest.raises(InputError, match=r"got StateRuns; .* irl\.state_only\.learn_from_states"):
        learn("planning", chain, StateRuns.of([[0, 1]]), **given)
