import numpy as np
import pytest
from scipy.optimize import approx_fprime

from irl.advice import Advice
from irl.baselines.action_advice import (
    AdviceConfig,
    AdviceLikelihood,
    AdvisedLearner,
    learn,
    uncertainty,
)
from irl.baselines.sparse_planning import SparseConfig, sparse_planning
from irl.demonstrations import Demonstrations
from irl.domains.gridworld import DOWN, RIGHT, UP, GridWorld
from irl.errors import InputError
from irl.experts import ClusterAdvice
from irl.uncertainty import action_probabilities


@pytest.fixture
def fork():
    """A 5 × 5 grid, and one demonstration of two moves, which ends in its middle."""
    grid = GridWorld(5, (2, 2))
    return grid, Demonstrations.from_pairs([(grid.index(0, 2), RIGHT), (grid.index(1, 2), RIGHT)])


def nothing(model):
    return Advice.none(model.n_states, model.n_actions)


def test_advice_moves_the_policy_where_demonstrations_are_silent(fork):
    grid, shown = fork
    right_half = np.flatnonzero(grid.cells[:, 0] > 2)
    inner = right_half[(grid.cells[right_half, 1] > 0) & (grid.cells[right_half, 1] < 4)]
    for wanted, other in ((UP, DOWN), (DOWN, UP)):
        advice = nothing(grid.model).add(inner, [wanted], [other])
        before = learn(grid.model, shown, nothing(grid.model), gamma=0.9).q
        after = learn(grid.model, shown, advice, gamma=0.9).q
        assert (before[inner].argmax(axis=1) == wanted).mean() < 1
        assert (after[inner].argmax(axis=1) == wanted).all()
        # What was demonstrated still holds.
        assert (after[shown.state].argmax(axis=1) == shown.action).all()


def test_avoided_actions_become_unlikely(fork):
    grid, shown = fork
    inner = np.flatnonzero(((grid.cells > 0) & (grid.cells < 4)).all(axis=1))
    unseen = np.setdiff1d(inner, shown.state)
    advice = nothing(grid.model).add(unseen, [], [UP])

    def share(advice):
        return action_probabilities(learn(grid.model, shown, advice, gamma=0.9).q, 1.0)[unseen, UP]

    assert share(advice).mean() < 0.5 * share(nothing(grid.model)).mean()


def test_without_advice_it_is_sparse_planning(fork):
    grid, shown = fork
    reward, _ = sparse_planning(grid.model, shown, gamma=0.9, config=SparseConfig(tolerance=1e-7))
    result = learn(
        grid.model, shown, nothing(grid.model), gamma=0.9, config=AdviceConfig(tolerance=1e-7)
    )
    np.testing.assert_allclose(result.reward, reward, atol=1e-3)


def test_advice_of_one_action_is_a_demonstration(chain):
    told = nothing(chain).add([0, 1, 2], [1], [])
    value, _ = AdviceLikelihood.build(chain, told).of_values(np.array([0.3, 0.1, -0.2, 0.9]))
    Q = chain.q_values(np.array([0.3, 0.1, -0.2, 0.9]))[:3]
    log_pi = Q - np.log(np.exp(Q).sum(axis=1, keepdims=True))
    assert value == pytest.approx(log_pi[:, 1].mean())


def test_advice_gradient_agrees_with_finite_differences(random_model):
    rng = np.random.default_rng(8)
    model = random_model(rng, n_states=12, n_actions=4)
    preferred = rng.random(model.mask.shape) < 0.3
    avoided = ~preferred & (rng.random(model.mask.shape) < 0.4)
    advised = AdviceLikelihood.build(model, Advice(preferred, avoided))
    f = rng.normal(size=12)
    numeric = approx_fprime(f, lambda f: advised.of_values(f)[0], 1e-7)
    np.testing.assert_allclose(advised.of_values(f)[1], numeric, atol=1e-6)


def test_advice_that_says_nothing_is_passed_over(chain):
    for preferred, avoided in (([0, 1], []), ([], [0, 1]), ([], [])):
        advised = AdviceLikelihood.build(
            chain, nothing(chain).add([0, 1, 2, 3], preferred, avoided)
        )
        value, gradient = advised.of_values(np.ones(4))
        assert value == 0.0
        assert not gradient.any()


def test_uncertainty_mixes_what_was_shown_and_what_was_learnt(chain):
    shown = Demonstrations.from_pairs([(0, 1), (0, 1)])
    q = np.array([[0.0, 0.0], [0.0, 50.0], [0.0, 0.0], [-np.inf, -np.inf]])
    shown_once_of_four = -(0.25 * np.log(0.25) + 0.75 * np.log(0.75))
    both = np.log(2)
    for weight in (0.0, 0.5, 1.0):
        expected = weight * np.array([shown_once_of_four, both, both, 0.0])
        expected += (1 - weight) * np.array([both, 0.0, both, 0.0])
        np.testing.assert_allclose(uncertainty(chain, shown, q, weight), expected, atol=1e-12)


def test_answers_make_certain(fork):
    grid, shown = fork
    cluster = np.flatnonzero(grid.cells[:, 0] == 3)
    learner = AdvisedLearner(grid.model, shown, gamma=0.9)
    before = learner.uncertainty[cluster].mean()
    learner.take(cluster, ClusterAdvice(frozenset({RIGHT})))
    assert learner.uncertainty[cluster].mean() < before
    assert (learner.policy[cluster] == RIGHT).all()


def test_a_learner_goes_on_from_what_it_knew(fork):
    grid, shown = fork
    answers = [(np.array([0, 1]), UP), (np.array([20, 21]), DOWN)]
    learner, advice = AdvisedLearner(grid.model, shown, gamma=0.9), nothing(grid.model)
    expected = learn(grid.model, shown, advice, gamma=0.9)
    for states, action in answers:
        learner.take(states, ClusterAdvice(frozenset({action})))
        advice = advice.add(states, [action], [])
        expected = learn(grid.model, shown, advice, gamma=0.9, start=expected.reward)
    np.testing.assert_array_equal(learner.result.q, expected.q)


def test_bad_arguments_are_named(chain):
    walk = Demonstrations.from_pairs([(0, 1), (1, 1)])
    with pytest.raises(InputError, match="at least one"):
        learn(chain, Demonstrations.empty(), nothing(chain), gamma=0.9)
    with pytest.raises(InputError, match="advice_weight"):
        AdviceConfig(advice_weight=-1.0)
    with pytest.raises(InputError, match="advice"):
        learn(chain, walk, Advice.none(5, 2), gamma=0.9)
    with pytest.raises(InputError, match="demonstration_weight"):
        uncertainty(chain, walk, np.zeros((4, 2)), 1.5)
