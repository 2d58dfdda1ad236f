import numpy as np
import pytest
import torch

from irl.bellman import BellmanTerm
from irl.domains.gridworld import GridWorld
from irl.errors import InputError
from irl.likelihood import LikelihoodProblem
from irl.training import TrainingConfig, train
from irl.vr_function import VRFunction

torch.set_num_threads(1)  # networks this small gain nothing from more

WORLD = GridWorld(5, (2, 2))


def run(callback=None, seed=0, **options):
    network = VRFunction(2, (8, 8), generator=torch.Generator().manual_seed(seed))
    problem = LikelihoodProblem.build(WORLD.model, *WORLD.demonstrations("diagonal"))
    config = TrainingConfig(**({"iterations": 200, "step": 0.01, "beta": 20.0} | options))
    bellman = BellmanTerm(WORLD.model, 0.9, batch=5) if config.bellman_weight else None
    rng = np.random.default_rng(seed)
    training = train(network, problem, WORLD.features, config, rng, callback, bellman)
    return network, training


@pytest.mark.parametrize("optimizer", ["adam", "sgd"])
@pytest.mark.parametrize("schedule", ["cosine", "none"])
def test_likelihood_rises(optimizer, schedule):
    _, training = run(optimizer=optimizer, schedule=schedule)
    assert training.log_likelihood[-1] > training.log_likelihood[0] + 0.05


@pytest.mark.parametrize("options", [{}, {"learn_beta": True, "bellman_weight": 0.1}])
def test_same_seed_same_bits(options):
    (one, first), (two, second) = run(**options), run(**options)
    assert torch.equal(one.parameters, two.parameters)
    assert np.array_equal(first.log_likelihood, second.log_likelihood)
    assert first.beta == second.beta
    assert first.step_reward == second.step_reward


def test_one_sgd_step_follows_the_gradient_of_the_mean_likelihood():
    network, _ = run(iterations=0)
    before = network.parameters.clone()
    at_all = network.at(WORLD.features)
    problem = LikelihoodProblem.build(WORLD.model, *WORLD.demonstrations("diagonal"))
    _, df, _ = problem.value_and_gradient(at_all.forward().numpy()[problem.states], 20.0)
    spread = np.zeros(WORLD.n_states)
    spread[problem.states] = df
    gradient = at_all.backward(torch.from_numpy(spread))
    after, _ = run(iterations=1, optimizer="sgd", schedule="none")
    torch.testing.assert_close(after.parameters, before + 0.01 * gradient, rtol=0, atol=1e-6)


def test_beta_stays_unless_it_is_learnt():
    assert run()[1].beta == pytest.approx(20.0, rel=1e-12)
    assert run(learn_beta=True)[1].beta != pytest.approx(20.0, rel=1e-3)


def test_bellman_term_makes_the_reward_more_even():
    batch = BellmanTerm(WORLD.model, 0.9, batch=99).draw(np.random.default_rng(0))

    def unevenness(network):
        rewards = batch.rewards(network.values(WORLD.features)[batch.states])
        return np.abs(rewards - np.median(rewards)).mean()

    assert unevenness(run(bellman_weight=10.0)[0]) < 0.8 * unevenness(run()[0])


def test_weight_decay_shrinks_the_weights():
    assert run(weight_decay=1.0)[0].parameters.norm() < run()[0].parameters.norm()


def test_tolerance_stops_early():
    _, training = run(iterations=5000, tolerance=1e-3, schedule="none")
    assert training.converged
    assert 100 < training.log_likelihood.size < 5000


def test_callback_counts_iterations():
    told = []
    _, training = run(callback=lambda *progress: told.append(progress), iterations=5)
    assert [done for done, _ in told] == [1, 2, 3, 4, 5]
    assert [value for _, value in told] == training.log_likelihood.tolist()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"optimizer": "rmsprop"}, "optimizer.*adam, sgd"),
        ({"schedule": "linear"}, "schedule.*cosine, none"),
        ({"step": 0.0}, "step"),
        ({"beta": float("nan")}, "beta"),
        ({"iterations": -1}, "iterations"),
        ({"bellman_weight": -1.0}, "bellman_weight"),
    ],
)
def test_bad_options_are_named(options, message):
    with pytest.raises(InputError, match=message):
        TrainingConfig(**options)


def test_bellman_weight_needs_its_term():
    network = VRFunction(2, (4,), generator=torch.Generator().manual_seed(0))
    problem = LikelihoodProblem.build(WORLD.model, *WORLD.demonstrations("diagonal"))
    config = TrainingConfig(bellman_weight=0.1)
    with pytest.raises(InputError, match="bellman_weight"):
        train(network, problem, WORLD.features, config, np.random.default_rng(0))


def test_divergence_is_told():
    with pytest.raises(InputError, match="diverged"):
        run(optimizer="sgd", schedule="none", step=1.0, weight_decay=1e6)
