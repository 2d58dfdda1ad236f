import re
from dataclasses import replace

import numpy as np
import pytest

from irl.baselines.birl import SamplingConfig
from irl.demonstrations import Demonstrations
from irl.methods import learn
from irl.planning import transition_matrix
from irl.problem import LearningProblem
from irl.training_config import TrainingConfig
from tests.irl.method_worlds import GAMMA, World


@pytest.fixture(scope="module")
def worlds():
    return {n: World(n) for n in (5, 15)}


@pytest.mark.parametrize("name", ["linear_mlirl", "bellman_gradient", "planning"])
def test_methods_tell_their_progress_and_whether_they_converged(worlds, name):
    world, told = worlds[5], []
    problem = LearningProblem(world.model, gamma=GAMMA)

    def fit(**options):
        rng = np.random.default_rng(0)
        return learn(name, problem, world.walks, rng=rng, progress=told_of, **options)

    def told_of(done, value):
        told.append((done, value))

    short = fit(max_iterations=3)
    assert [done for done, _ in told] == [1, 2, 3]
    assert np.isfinite([value for _, value in told]).all()
    assert short.iterations == 3
    assert short.converged is False
    told.clear()
    whole = fit(tolerance=1e-2, max_iterations=2000)
    assert whole.converged is True
    assert whole.iterations == len(told) < 2000


def test_training_tells_its_progress_too(worlds):
    world, told = worlds[5], []
    problem = LearningProblem(world.model, world.grid.features, gamma=GAMMA)
    learn(
        "fa_mlirl",
        problem,
        world.walks,
        rng=np.random.default_rng(0),
        progress=lambda done, _: told.append(done),
        training=TrainingConfig(iterations=7),
        networks=2,
    )
    assert told == list(range(1, 15))


def test_birl_tells_whether_its_chains_agree(worlds):
    world, few = worlds[5], SamplingConfig(chains=4, burn_in=0, samples=4, thin=1)
    problem = LearningProblem(world.model, gamma=GAMMA)
    many = Demonstrations.concatenate(
        [replace(world.walks, trajectory=world.walks.trajectory + 4 * k) for k in range(50)]
    )
    learnt = learn("birl", problem, many, rng=np.random.default_rng(0), sampling=few)
    assert learnt.converged is False
    assert re.fullmatch(r"chains disagree: R̂ = [\d.]+, above 1.05; raise burn_in.*", learnt.note)
    # Where labels say next to nothing, every draw is one of the prior, and chains agree at once.
    idle = SamplingConfig(beta=1e-6, burn_in=50, samples=100, thin=2)
    learnt = learn("birl", problem, many, rng=np.random.default_rng(0), sampling=idle)
    assert (learnt.converged, learnt.note) == (True, "")


@pytest.mark.parametrize("name", ["max_ent", "behaviour_cloning"])
def test_quasi_newton_methods_tell_their_iterations(worlds, name):
    world, told = worlds[5], []
    problem = LearningProblem(world.model, gamma=GAMMA)

    def fit(**options):
        told.clear()
        return learn(
            name,
            problem,
            world.walks,
            rng=np.random.default_rng(0),
            progress=lambda *step: told.append(step),
            **options,
        )

    short = fit(max_iterations=3)
    assert [done for done, _ in told] == [1, 2, 3]
    assert (short.iterations, short.converged) == (3, False)
    whole = fit(tolerance=1e-4)
    assert (whole.iterations, whole.converged) == (len(told), True)
    values = [value for _, value in told]
    assert values == sorted(values)  # it climbs
    assert values[-1] < 0  # a log-likelihood, less the price


def test_a_reward_network_and_chains_tell_their_progress(worlds):
    world, told = worlds[5], []
    problem = LearningProblem(world.model, world.grid.features, gamma=GAMMA)
    given = {"rng": np.random.default_rng(0), "progress": lambda *step: told.append(step)}
    learnt = learn("deep_max_ent", problem, world.walks, iterations=4, **given)
    assert [done for done, _ in told] == [1, 2, 3, 4]
    assert (learnt.iterations, learnt.converged) == (4, None)
    told.clear()
    few = SamplingConfig(chains=2, burn_in=3, samples=4, thin=2)
    learnt = learn("birl", problem, world.walks, sampling=few, **given)
    assert [done for done, _ in told] == list(range(1, 9))
    assert max(value for _, value in told) < 0  # log-likelihoods
    assert learnt.iterations == 2 * (3 + 4 * 2)


def test_linear_programs_tell_how_they_ended(worlds):
    world, told = worlds[5], []
    problem = LearningProblem(world.model, world.grid.features, gamma=GAMMA)

    def fit(name, **options):
        told.clear()
        rng = np.random.default_rng(0)
        return learn(name, problem, world.walks, rng=rng, progress=told_of, **options)

    def told_of(done, value):
        told.append((done, value))

    once = fit("lp")
    assert (once.iterations, once.converged, told) == (1, True, [(1, 1.0)])  # explains it all
    one = fit("lp_advice", rounds=1)
    assert (one.iterations, one.converged) == (1, False)
    few = fit("lp_basis", bumps=4)
    assert [done for done, _ in told] == list(range(1, few.iterations + 1))
    assert few.converged is (told[-1][1] >= 0.95)
    explained = [value for _, value in told]
    assert explained == sorted(explained)  # the best so far


def test_a_program_with_advice_ends_where_another_round_changes_nothing(worlds):
    world, told = worlds[5], []
    model, best = world.model, world.Q.argmax(axis=1)
    state = np.flatnonzero(model.mask.any(axis=1))
    pairs = Demonstrations.from_pairs(np.stack([state, best[state]], axis=1))
    learnt = learn(
        "lp_advice",
        LearningProblem(model, gamma=GAMMA),
        replace(pairs, trajectory=np.arange(state.size)),
        rng=np.random.default_rng(0),
        progress=lambda *step: told.append(step),
    )
    assert learnt.converged is True
    assert [done for done, _ in told] == list(range(1, learnt.iterations + 1))
    # What the last program is worth, by (3.9): values of the demonstrated policy, solved densely.
    P = transition_matrix(model, np.where(model.mask.any(axis=1), best, -1)).toarray()
    V = np.linalg.solve(np.eye(model.n_states) - GAMMA * P, P @ learnt.reward)
    q = model.q_values(learnt.reward + GAMMA * V)
    other = np.where(np.arange(model.n_actions) == best[:, None], -np.inf, q)
    lead = (q[state, best[state]] - other[state].max(axis=1))[model.widths[state] > 1]
    assert told[-1][1] == pytest.approx(lead.sum() - np.abs(learnt.reward).sum(), abs=1e-6)


def test_a_network_tells_whether_it_settled_if_it_was_given_a_tolerance(worlds):
    world = worlds[5]
    problem = LearningProblem(world.model, world.grid.features, gamma=GAMMA)

    def converged(**options):
        training = TrainingConfig(iterations=250, **options)
        rng = np.random.default_rng(0)
        return learn("fa_mlirl", problem, world.walks, rng=rng, training=training).converged

    assert converged() is None
    assert converged(tolerance=1e-12) is False
    assert converged(tolerance=1.0) is True


def test_progress_can_end_the_learning(worlds):
    world = worlds[5]

    class EnoughError(Exception):
        pass

    def stop(done, _):
        if done == 2:
            raise EnoughError

    problem = LearningProblem(world.model, gamma=GAMMA)
    with pytest.raises(EnoughError):
        learn("planning", problem, world.walks, rng=np.random.default_rng(0), progress=stop)
