import hashlib
import multiprocessing
import os
import signal
import time

import numpy as np
import pytest
import torch

from irl.bellman import BellmanTerm
from irl.checkpoint import Checkpoint
from irl.domains.gridworld import GridWorld
from irl.errors import InputError
from irl.likelihood import LikelihoodProblem
from irl.mdp import TransitionModel
from irl.training import train
from irl.training_config import TrainingConfig
from irl.vr_function import VRFunction

torch.set_num_threads(1)  # networks this small gain nothing from more

WORLD = GridWorld(5, (2, 2))


def run(
    callback=None, seed=0, checkpoint=None, kind="diagonal", scale=1.0, additive=False, **options
):
    generator = torch.Generator().manual_seed(seed)
    network = VRFunction(2, (8, 8), generator=generator, additive=additive)
    config = TrainingConfig(**({"iterations": 200, "step": 0.01, "beta": 20.0} | options))
    shown = WORLD.demonstrations(kind)
    problem = LikelihoodProblem.build(WORLD.model, *shown, cautious=config.cautious)
    batch, cautious = options.get("bellman_batch", 5), config.cautious
    term = BellmanTerm(WORLD.model, 0.9, batch=batch, cautious=cautious)
    bellman = term if config.bellman_weight else None
    rng = np.random.default_rng(seed)
    features = WORLD.features * scale
    training = train(network, problem, features, config, rng, callback, bellman, checkpoint)
    return network, training


def digest(network):
    return hashlib.sha256(network.parameters.numpy().tobytes()).hexdigest()


def stop_at(iteration):
    def callback(done, _):
        if done == iteration:
            raise KeyboardInterrupt

    return callback


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


SHORTCUT = [
    *[(s, 0, s + 1, 1.0) for s in range(4)],  # the sure way, a step at a time
    *[(s, 1, s + 2, 0.6) for s in range(3)],  # two steps at once, or back to the start
    *[(s, 1, 0, 0.4) for s in range(3)],
]


@pytest.mark.parametrize("weight", [0.0, 1.0])
def test_who_never_takes_a_chance_is_seen_to_dislike_them(weight):
    state, action, after, p = (np.array(column) for column in zip(*SHORTCUT, strict=True))
    model = TransitionModel.from_entries(5, 2, state, action, after, p)
    np.testing.assert_allclose(model.surprise[model.pair_action == 1], 0.4)
    assert not model.surprise[model.pair_action == 0].any()
    learnt = {}
    for learn in (False, True):
        network = VRFunction(5, (8,), generator=torch.Generator().manual_seed(0))
        config = TrainingConfig(
            iterations=300, step=3e-3, learn_caution=learn, bellman_weight=weight
        )
        sure = np.arange(3), np.zeros(3, dtype=np.int64)
        problem = LikelihoodProblem.build(model, *sure, cautious=learn)
        bellman = BellmanTerm(model, 0.9, batch=5, cautious=learn) if weight else None
        rng = np.random.default_rng(0)
        run = train(network, problem, np.eye(5), config, rng, bellman=bellman)
        learnt[learn] = run
        q = model.q_values(network.values(np.eye(5)), run.caution)
        assert (q[:3].argmax(axis=1) == 0).all()
    assert learnt[False].caution == 0
    assert learnt[True].caution > 0.1
    assert learnt[True].log_likelihood[-1] > learnt[False].log_likelihood[-1]


def test_a_penalty_on_all_states_draws_nothing_and_is_the_mean_over_batches():
    term = BellmanTerm(WORLD.model, 0.9, batch=10**6)
    rng = np.random.default_rng(0)
    before = rng.bit_generator.state
    assert term.draw(rng) is term.whole
    assert rng.bit_generator.state == before
    f = np.random.default_rng(1).uniform(-0.1, 0.1, WORLD.n_states)
    whole, *_ = term.whole.value_and_gradient(f[term.whole.states], 0.0)
    single = BellmanTerm(WORLD.model, 0.9, batch=1)
    each = {}
    while len(each) < WORLD.n_states:
        batch = single.draw(rng)
        each[batch.seen.states[0]], *_ = batch.value_and_gradient(f[batch.states], 0.0)
    assert whole == pytest.approx(np.mean(list(each.values())))


def test_bellman_term_makes_the_reward_more_even():
    batch = BellmanTerm(WORLD.model, 0.9, batch=99).draw(np.random.default_rng(0))

    def unevenness(network):
        rewards = batch.rewards(network.values(WORLD.features)[batch.states])
        return np.abs(rewards - np.median(rewards)).mean()

    assert unevenness(run(bellman_weight=10.0)[0]) < 0.8 * unevenness(run()[0])


def test_weight_decay_shrinks_the_weights():
    assert run(weight_decay=1.0)[0].parameters.norm() < run()[0].parameters.norm()


def test_tolerance_stops_where_two_windows_have_the_same_mean():
    _, training = run(iterations=5000, tolerance=1e-3, schedule="none")
    assert training.converged
    history = training.log_likelihood
    assert 200 < history.size < 5000
    means = np.convolve(history, np.full(100, 0.01), mode="valid")
    change = np.abs(means[100:] - means[:-100])
    assert change[-1] < 1e-3
    assert (change[:-1] >= 1e-3).all()


def test_without_tolerance_all_iterations_are_taken():
    _, training = run(iterations=500, step=1e-9)
    assert not training.converged
    assert training.log_likelihood.size == 500


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


EVERYTHING = {"learn_beta": True, "bellman_weight": 0.1}


def test_a_callback_that_raises_leaves_the_weights_of_the_iterations_done():
    network = VRFunction(2, (8, 8), generator=torch.Generator().manual_seed(0))
    problem = LikelihoodProblem.build(WORLD.model, *WORLD.demonstrations("diagonal"))
    config = TrainingConfig(iterations=200, step=0.01, beta=20.0, schedule="none")
    with pytest.raises(KeyboardInterrupt):
        rng = np.random.default_rng(0)
        train(network, problem, WORLD.features, config, rng, stop_at(17))
    assert digest(network) == digest(run(schedule="none", iterations=17)[0])


@pytest.mark.parametrize(
    "options",
    [
        {},
        EVERYTHING,
        {"optimizer": "sgd", "weight_decay": 0.1},
        {"additive": True},
        {"learn_caution": True, "bellman_weight": 0.1, "bellman_batch": 10**6},
        {"tolerance": 5e-3, "schedule": "none", "iterations": 2000},
    ],
)
def test_interrupted_training_ends_with_the_same_bits(tmp_path, options):
    network, expected = run(**options)
    checkpoint = Checkpoint(tmp_path / "run.safetensors", every=9)
    told = []
    for iteration in (5, 9, 100, 101, 155):
        with pytest.raises(KeyboardInterrupt):
            run(stop_at(iteration), checkpoint=checkpoint, **options)
    resumed, training = run(lambda done, _: told.append(done), checkpoint=checkpoint, **options)
    assert digest(resumed) == digest(network)
    np.testing.assert_array_equal(training.log_likelihood, expected.log_likelihood)
    assert (training.beta, training.step_reward) == (expected.beta, expected.step_reward)
    assert training.caution == expected.caution
    assert training.converged == expected.converged
    assert told == list(range(154, expected.log_likelihood.size + 1))  # 153 = 17 · 9 was saved


def test_finished_training_is_not_repeated_and_leaves_the_rng_where_it_would_be(tmp_path):
    checkpoint = Checkpoint(tmp_path / "run.safetensors", every=10**6)
    problem = LikelihoodProblem.build(WORLD.model, *WORLD.demonstrations("diagonal"))
    config = TrainingConfig(iterations=20, **EVERYTHING)
    bellman = BellmanTerm(WORLD.model, 0.9, batch=5)
    following = []
    for callback in (None, stop_at(1)):
        rng = np.random.default_rng(0)
        network = VRFunction(2, (4,), generator=torch.Generator().manual_seed(0))
        train(network, problem, WORLD.features, config, rng, callback, bellman, checkpoint)
        following.append((digest(network), rng.random()))
    assert following[0] == following[1]


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"step": 0.02}, r"config\.step \(0\.01 there, 0\.02 here\)"),
        ({"iterations": 300}, r"config\.iterations"),
        ({"seed": 1}, "initial_weights.*rng"),
        ({"kind": "border"}, "demonstrations"),
        ({"scale": 2.0}, "features"),
        ({"bellman_weight": 0.1}, r"bellman.*config\.bellman_weight"),
    ],
)
def test_a_checkpoint_of_other_training_is_refused(tmp_path, change, name):
    checkpoint = Checkpoint(tmp_path / "run.safetensors")
    run(checkpoint=checkpoint)
    with pytest.raises(InputError, match=rf"run\.safetensors: .*{name}"):
        run(checkpoint=checkpoint, **change)


def test_a_checkpoint_that_cannot_be_written_is_told_before_any_work(tmp_path):
    told = []
    with pytest.raises(FileNotFoundError, match="absent"):
        run(lambda *_: told.append(1), checkpoint=Checkpoint(tmp_path / "absent" / "run"))
    assert not told


def test_a_damaged_checkpoint_is_told_and_the_network_left_alone(tmp_path):
    path = tmp_path / "run.safetensors"
    run(checkpoint=Checkpoint(path))
    path.write_bytes(path.read_bytes()[:-1])
    network = VRFunction(2, (8, 8), generator=torch.Generator().manual_seed(0))
    before = digest(network)
    problem = LikelihoodProblem.build(WORLD.model, *WORLD.demonstrations("diagonal"))
    rng = np.random.default_rng(0)
    with pytest.raises(InputError, match=r"run\.safetensors"):
        train(
            *(network, problem, WORLD.features, TrainingConfig(), rng),
            checkpoint=Checkpoint(path),
        )
    assert digest(network) == before


def test_killed_training_ends_with_the_same_bits(tmp_path):
    checkpoint = Checkpoint(tmp_path / "run.safetensors", every=3)
    options = {"iterations": 600, **EVERYTHING}
    moments = np.random.default_rng(0)
    # Forked, so that nothing is imported anew.
    fork = multiprocessing.get_context("fork")
    for _ in range(4):
        before = checkpoint.path.read_bytes() if checkpoint.path.exists() else b""
        child = fork.Process(target=run, kwargs={"checkpoint": checkpoint, **options})
        child.start()
        while child.is_alive() and not (
            checkpoint.path.exists() and checkpoint.path.read_bytes() != before
        ):
            time.sleep(0.001)
        time.sleep(moments.uniform(0, 0.02))
        os.kill(child.pid, signal.SIGKILL)
        child.join(30)
        assert child.exitcode == -signal.SIGKILL
    resumed, training = run(checkpoint=checkpoint, **options)
    network, expected = run(**options)
    assert digest(resumed) == digest(network)
    np.testing.assert_array_equal(training.log_likelihood, expected.log_likelihood)
