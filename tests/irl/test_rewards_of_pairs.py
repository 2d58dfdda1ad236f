"""Rewards earned by acting, learnt from features of pairs of state and action."""

from itertools import product

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from irl.active import active_fa_mlirl
from irl.baselines.birl import SamplingConfig, birl
from irl.baselines.differentiable_planning import HardMax, Planner, PNorm, SoftMax
from irl.baselines.linear_mlirl import linear_mlirl
from irl.baselines.max_ent import max_ent
from irl.baselines.planned_likelihood import PlannedLikelihood
from irl.baselines.sparse_planning import sparse_planning
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.evaluation import expected_value_difference, policy_value, regret
from irl.mdp import TransitionModel
from irl.method_inputs import Inputs
from irl.methods import METHODS, OF_PAIRS, learn
from irl.outcomes import LearntReward, load_reward, save_reward
from irl.planning import value_iteration
from irl.problem import LearningProblem
from irl.state_only import StateRuns, learn_from_states
from irl.teacher import Teacher

N, GAMMA, WEIGHTS = 8, 0.8, np.array([1.5, -1.0, 2.0])
SHORT = SamplingConfig(chains=2, burn_in=200, samples=100, thin=2)
QUICK = {"birl": {"sampling": SHORT}}
SAME_CHOICES = {
    "bellman_gradient": {"sharpness": 1.0},
    "planning": {"sparsity": 0.0},
    "max_ent": {"l2": 0.0},
}


class Ring:
    """A ring where one goes left or right, each in two ways that lead alike.

    The careful way costs, but on wet ground, which is every third state, it pays. Where an action
    leads says nothing of the way, so that no reward of states can tell the two apart.
    """

    def __init__(self) -> None:
        self.P = np.zeros((N, 4, N))
        for s, a in product(range(N), range(4)):
            self.P[s, a, (s + (1 if a % 2 else -1)) % N] += 0.8
            self.P[s, a, s] += 0.2
        self.model = TransitionModel.from_dense(self.P)
        state, action = np.arange(N)[:, None], np.arange(4)[None, :]
        self.features = np.stack(
            [
                (state == 5) & (action % 2 == 1),
                (action >= 2) & (state >= 0),
                (action >= 2) & (state % 3 == 0),
            ],
            axis=2,
        ).astype(float)
        self.reward = self.features @ WEIGHTS

    def q(self, maximum):
        """Bellman's equation by plain sweeps over the tables."""
        q = np.zeros((N, 4))
        for _ in range(400):
            q = self.reward + GAMMA * self.P @ maximum(q)
        return q

    @property
    def best(self):
        """The best action of every state; no two are alike."""
        return self.q(lambda q: q.max(axis=1)).argmax(axis=1)

    @property
    def shown(self):
        """In every state but 2 and 6, each action as often as soft-optimal behaviour takes it."""
        q = self.q(lambda q: np.log(np.exp(q).sum(axis=1)))
        often = np.round(400 * np.exp(q) / np.exp(q).sum(axis=1, keepdims=True)).astype(int)
        often[[2, 6]] = 0
        pairs = np.repeat(np.argwhere(often >= 0), often.ravel(), axis=0)
        return Demonstrations.from_labels(pairs)


@pytest.fixture(scope="module")
def ring():
    return Ring()


def fit(ring, name, features=None, shown=None, **options):
    shown, rng = ring.shown if shown is None else shown, np.random.default_rng(0)
    return learn(name, ring.model, shown, features, gamma=GAMMA, rng=rng, **options)


@pytest.mark.parametrize("name", OF_PAIRS)
def test_what_no_reward_of_states_can_tell_is_learnt_and_planned_for(ring, name):
    learnt = fit(ring, name, ring.features, **QUICK.get(name, {}))
    assert learnt.reward.shape == (N, 4)
    np.testing.assert_array_equal(learnt.q.argmax(axis=1), ring.best)
    of_states = fit(ring, name, np.eye(N), **QUICK.get(name, {}))
    assert of_states.reward.shape == (N,)
    np.testing.assert_allclose(of_states.q[:, :2], of_states.q[:, 2:])


@pytest.mark.parametrize("name", SAME_CHOICES)
def test_the_reward_of_a_demonstrator_of_the_same_choices_is_recovered(ring, name):
    options = SAME_CHOICES[name] | {"max_iterations": 3000, "tolerance": 1e-7}
    learnt = fit(ring, name, ring.features, **options)
    np.testing.assert_allclose(learnt.reward, ring.reward, atol=0.02)


@pytest.mark.parametrize("name", OF_PAIRS)
def test_an_action_that_cannot_be_done_has_no_reward_and_its_features_are_ignored(ring, name):
    mask = np.ones((N, 4), dtype=bool)
    mask[1, 2] = mask[4, 0] = False
    model, features = TransitionModel.from_dense(ring.P, mask), ring.features.copy()
    features[~mask] = np.nan
    best = np.where(mask[np.arange(N), ring.best], ring.best, 1)
    shown = Demonstrations.from_labels(list(enumerate(best.tolist())))
    rng = np.random.default_rng(0)
    learnt = learn(name, model, shown, features, gamma=GAMMA, rng=rng, **QUICK.get(name, {}))
    assert not learnt.reward[~mask].any()
    np.testing.assert_array_equal(np.isfinite(learnt.q), mask)


def posterior_mean(model, shown, features, *, gamma):
    rng = np.random.default_rng(0)
    reward = birl(model, shown, features, gamma=gamma, rng=rng, config=SHORT).reward
    return reward, None


@pytest.mark.parametrize("fit", [max_ent, linear_mlirl, sparse_planning, posterior_mean])
def test_features_of_states_told_as_those_of_pairs_give_the_same_reward(ring, fit):
    # What acting earns is what one is expected to enter, and so is its feature: P Φ.
    phi = np.random.default_rng(1).normal(size=(N, 2))
    entered, _ = fit(ring.model, ring.shown, phi, gamma=GAMMA)
    acted, _ = fit(ring.model, ring.shown, ring.P @ phi, gamma=GAMMA)
    expected = (ring.P @ entered).ravel()
    assert np.abs(expected).max() > 0.01
    np.testing.assert_allclose(acted, expected, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("maximum", [HardMax(), SoftMax(0.7), PNorm(80.0)])
@pytest.mark.parametrize("gamma", [0.0, 0.6, 0.95])
def test_the_likelihood_and_its_gradient_agree_with_differences_and_with_states(
    random_model, maximum, gamma
):
    rng = np.random.default_rng(4)
    model = random_model(rng, n_states=12, n_actions=3)
    rows = rng.integers(model.n_pairs, size=9)
    shown = Demonstrations.from_labels(
        np.stack([model.pair_state[rows], model.pair_action[rows]], axis=1)
    )
    of_pairs, of_states = (
        PlannedLikelihood.build(model, shown, gamma, maximum, 1.7, pairs) for pairs in (True, False)
    )
    reward = rng.normal(size=model.n_pairs)
    numeric = approx_fprime(reward, lambda r: of_pairs.value_and_gradient(r)[0], 1e-6)
    near = {"rtol": 1e-3, "atol": 1e-4}
    np.testing.assert_allclose(of_pairs.value_and_gradient(reward)[1], numeric, **near)
    if isinstance(maximum, PNorm):  # which shifts rewards by the least of them
        return
    entered = rng.normal(size=12)
    value, gradient = of_pairs.value_and_gradient(model.P @ entered)
    expected = of_states.value_and_gradient(entered)
    assert value == pytest.approx(expected[0], abs=1e-9)
    np.testing.assert_allclose(model.P.T @ gradient, expected[1], atol=1e-8)


@pytest.mark.parametrize("gamma", [0.5, 1 - 1e-6])
def test_planning_for_pairs_is_exact_at_any_discount(random_model, gamma):
    rng = np.random.default_rng(5)
    model = random_model(rng)
    planner, reward = Planner(model, gamma, of_pairs=True), rng.normal(size=model.n_pairs)
    V, Q = value_iteration(model, model.table(reward, fill=0.0), gamma)
    scale = np.abs(V).max()
    np.testing.assert_allclose(planner.solve(reward), Q[model.mask], rtol=0, atol=1e-8 * scale)


def test_a_reward_of_pairs_is_kept_and_judged(ring, tmp_path):
    learnt = fit(ring, "planning", ring.features)
    save_reward(LearntReward.of(learnt, gamma=GAMMA), tmp_path / "r")
    read = load_reward(tmp_path / "r")
    np.testing.assert_array_equal(read.reward, learnt.reward)
    np.testing.assert_array_equal(read.q(ring.model), learnt.q)
    # By linear systems of the tables themselves.
    action, rows = learnt.q.argmax(axis=1), np.arange(N)
    value = lambda a: np.linalg.solve(np.eye(N) - GAMMA * ring.P[rows, a], ring.reward[rows, a])  # noqa: E731
    np.testing.assert_allclose(
        policy_value(ring.model, action, ring.reward, GAMMA), value(action), atol=1e-12
    )
    lazy = np.zeros(N, dtype=int)
    short = value(ring.best) - value(lazy)
    np.testing.assert_allclose(regret(ring.model, lazy, ring.reward, GAMMA), short, atol=1e-9)
    difference = expected_value_difference(ring.model, lazy, ring.reward, GAMMA, [0, 3])
    assert difference == pytest.approx(short[[0, 3]].mean())


def test_runs_of_states_alone_teach_a_reward_of_pairs(ring):
    runs = StateRuns.of([[0, 1, 2, 3, 4, 5, 6], [7, 6, 5, 6, 5]])
    rng = np.random.default_rng(0)
    learnt = learn_from_states("max_ent", ring.model, runs, ring.features, gamma=GAMMA, rng=rng)
    assert learnt.reward.shape == (N, 4)
    assert learnt.q[5].argmax() % 2 == 1  # onwards, as both runs did


@pytest.mark.parametrize("name", sorted(set(METHODS) - set(OF_PAIRS)))
def test_methods_that_learn_no_such_reward_say_so_before_they_look_at_anything(ring, name):
    with pytest.raises(InputError, match=rf"method: {name} learns no reward of pairs.*planning"):
        fit(ring, name, ring.features, shown="not looked at")


def test_what_learns_from_features_of_states_alone_refuses_those_of_pairs(ring):
    problem = LearningProblem(ring.model, ring.features, gamma=GAMMA)
    rng = np.random.default_rng(0)
    with pytest.raises(InputError, match=r"features: .* got features of pairs \[8, 4, 3\]"):
        active_fa_mlirl(problem, ring.shown, Teacher(None), rng=rng)
    for name in ("max_ent", "fa_mlirl"):
        with pytest.raises(InputError, match="features of pairs are for learn"):
            METHODS[name].step(Inputs(problem, ring.shown, rng))


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        ((N, 3, 2), r"numbers \[8, d\] wanted, or \[8, 4, d\] of pairs, got float64 \[8, 3, 2\]"),
        ((4, N, 2), r"got float64 \[4, 8, 2\]"),
        ((N, 4, 0), "at least one column"),
        ((N, 4, 2, 1), r"got float64 \[8, 4, 2, 1\]"),
    ],
)
def test_features_of_pairs_that_do_not_fit_are_refused(ring, shape, words):
    with pytest.raises(InputError, match=f"features: .*{words}|features: {words}"):
        fit(ring, "max_ent", np.zeros(shape))
    if shape[:2] != (N, 4):
        with pytest.raises(InputError, match="features: finite values"):
            max_ent(ring.model, ring.shown, np.zeros(shape), gamma=GAMMA)


def test_a_feature_that_is_no_number_is_refused_where_it_can_be_met(ring):
    features = ring.features.copy()
    features[3, 1, 0] = np.inf
    with pytest.raises(InputError, match="features: must be finite"):
        fit(ring, "birl", features)
    with pytest.raises(InputError, match=r"features: .* in state 3 for action 1"):
        max_ent(ring.model, ring.shown, features, gamma=GAMMA)
