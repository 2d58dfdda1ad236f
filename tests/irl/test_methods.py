import re
from dataclasses import replace

import numpy as np
import pytest

from irl.advice import Advice
from irl.baselines.birl import SamplingConfig
from irl.demonstrations import Demonstrations
from irl.domains.gridworld import GridWorld, goal_cell
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.method_inputs import Inputs
from irl.methods import METHODS, learn
from irl.planning import transition_matrix, value_iteration
from irl.problem import LearningProblem
from irl.training_config import TrainingConfig

GAMMA = 0.9
KEYS = {
    "fa_mlirl",
    "max_ent",
    "deep_max_ent",
    "bellman_gradient",
    "linear_mlirl",
    "lp",
    "lp_advice",
    "lp_basis",
    "birl",
    "behaviour_cloning",
    "planning",
    "goal_posterior",
}
QUICK = {
    "bellman_gradient": {"max_iterations": 20},
    "linear_mlirl": {"max_iterations": 20},
    "deep_max_ent": {"iterations": 100},
    "birl": {"sampling": SamplingConfig(chains=2, burn_in=100, samples=50, thin=2)},
}


class World:
    """A grid whose centre pays 1 whenever it is entered, and a walk from each corner."""

    def __init__(self, n: int) -> None:
        self.grid = GridWorld(n, goal_cell(n, "centre"))
        self.model = self.grid.model
        self.reward = np.eye(self.grid.n_states)[self.grid.goal_state]
        self.V, self.Q = value_iteration(self.model, self.reward, GAMMA)
        self.walks = Demonstrations.from_trajectories(self.grid.trajectories("diagonal"))

    def demonstrations(self, name: str) -> Demonstrations:
        """Four walks suffice, except for a posterior mean over 225 rewards."""
        if name != "birl" or self.grid.n == 5:
            return self.walks
        rng, after, runs = np.random.default_rng(0), self.model.P.indices, []
        for cell in range(self.grid.n_states):
            state, pairs = cell, []
            while state != self.grid.goal_state:
                best = np.flatnonzero(self.Q[state] > self.Q[state].max() - 1e-9)
                pairs.append((state, int(rng.choice(best))))
                state = int(after[self.model.pair_index(*pairs[-1])])
            runs.append(pairs)
        return Demonstrations.from_trajectories(runs)

    def options(self, name: str) -> dict:
        """What a method needs besides: (3.9) lives on advice, (3.12) on its basis functions."""
        if name == "lp_advice":
            worse = self.model.mask & (self.Q.max(axis=1, keepdims=True) - 1e-9 > self.Q)
            return {"advice": Advice(np.zeros_like(worse), worse), "hardness": 0.01}
        if name == "lp_basis":
            return {"basis": np.hstack([self.reward[:, None], self.grid.features])}
        return QUICK.get(name, {})

    def value_share(self, q: np.ndarray) -> float:
        """What the policy earns under the hidden reward, over the optimum, from every cell."""
        P = transition_matrix(self.model, q.argmax(axis=1)).toarray()
        earned = np.linalg.solve(np.eye(len(P)) - GAMMA * P, P @ self.reward)
        return earned.sum() / self.V.sum()


@pytest.fixture(scope="module")
def worlds():
    return {n: World(n) for n in (5, 15)}


def test_every_key_of_the_design_is_there():
    assert set(METHODS) == KEYS


@pytest.mark.parametrize("n", [5, 15])
@pytest.mark.parametrize("name", sorted(KEYS))
def test_every_method_recovers_the_grid(worlds, name, n):
    world = worlds[n]
    learnt = learn(
        name,
        world.model,
        world.demonstrations(name),
        world.grid.features,
        gamma=GAMMA,
        rng=np.random.default_rng(0),
        **world.options(name),
    )
    assert learnt.q.dtype == np.float64
    np.testing.assert_array_equal(np.isfinite(learnt.q), world.model.mask)
    assert (learnt.reward is None) == (name == "behaviour_cloning")
    assert learnt.seconds > 0
    assert learnt.iterations is None or learnt.iterations > 0
    assert world.value_share(learnt.q) >= 0.99


@pytest.mark.parametrize("name", ["fa_mlirl", "deep_max_ent", "birl"])
def test_same_seed_same_values(worlds, name):
    world = worlds[5]
    quick = QUICK | {
        "fa_mlirl": {"training": TrainingConfig(iterations=50)},
        "birl": {"sampling": SamplingConfig(chains=2, burn_in=20, samples=10, thin=1)},
    }
    a, b = (
        learn(
            name,
            world.model,
            world.walks,
            world.grid.features,
            gamma=GAMMA,
            rng=np.random.default_rng(3),
            **quick.get(name, {}),
        ).q
        for _ in range(2)
    )
    np.testing.assert_array_equal(a, b)


def test_advice_is_heeded_afterwards(worlds):
    world = worlds[5]
    best = int(world.Q[0].argmax())
    advice = Advice.none(world.grid.n_states, 4).add([0], [], [best])
    arguments = (world.model, world.walks, world.grid.features)
    learnt = learn("planning", *arguments, gamma=GAMMA, rng=np.random.default_rng(0), advice=advice)
    assert learnt.q[0, best] == -np.inf
    assert learnt.q[0].argmax() != best


@pytest.mark.parametrize(
    "name", sorted(name for name, method in METHODS.items() if method.iterate is not None)
)
def test_iterations_can_be_taken_one_by_one(worlds, name):
    world = worlds[5]
    problem = LearningProblem(world.model, world.grid.features, gamma=GAMMA)
    step = METHODS[name].step(Inputs(problem, world.walks, np.random.default_rng(0)))
    for _ in range(3):
        step()


def test_linear_programs_have_no_iterations(worlds):
    world = worlds[5]
    with pytest.raises(InputError, match=r"does not iterate.*planning"):
        given = Inputs(
            LearningProblem(world.model, gamma=GAMMA), world.walks, np.random.default_rng(0)
        )
        METHODS["lp"].step(given)


def test_bad_arguments_are_named(worlds):
    world = worlds[5]
    rng = np.random.default_rng(0)
    with pytest.raises(InputError, match=r"method.*planning"):
        learn("magic", world.model, world.walks, gamma=GAMMA, rng=rng)
    with pytest.raises(InputError, match="features"):
        learn("fa_mlirl", world.model, world.walks, gamma=GAMMA, rng=rng)
    for name in KEYS - {"lp_advice"}:
        with pytest.raises(InputError, match="at least one"):
            learn(
                name,
                world.model,
                Demonstrations.empty(),
                world.grid.features,
                gamma=GAMMA,
                rng=rng,
            )


def test_a_learning_problem_and_its_parts_are_the_same(worlds):
    world = worlds[5]
    problem = LearningProblem(world.model, world.grid.features, gamma=GAMMA)
    quick = {"training": TrainingConfig(iterations=20)}
    whole = learn("fa_mlirl", problem, world.walks, rng=np.random.default_rng(0), **quick)
    parts = learn(
        "fa_mlirl",
        world.model,
        world.walks,
        world.grid.features,
        gamma=GAMMA,
        rng=np.random.default_rng(0),
        **quick,
    )
    assert whole.q.tobytes() == parts.q.tobytes()


def test_a_value_known_beforehand_is_kept_and_learnt_around(worlds):
    world = worlds[5]
    problem = LearningProblem(world.model, world.grid.features, gamma=GAMMA, fixed_vr={3: 0.25})
    quick = {"training": TrainingConfig(iterations=20)}
    known = learn("fa_mlirl", problem, world.walks, rng=np.random.default_rng(0), **quick)
    (rows,) = np.nonzero(world.model.P[:, [3]].toarray().ravel() == 1)
    assert rows.size
    pairs = world.model.pair_state[rows], world.model.pair_action[rows]
    assert (known.q[pairs] == 0.25).all()


def test_half_a_problem_is_refused(worlds):
    world, rng = worlds[5], np.random.default_rng(0)
    problem = LearningProblem(world.model, gamma=GAMMA)
    with pytest.raises(InputError, match=r"gamma.*wanted"):
        learn("planning", world.model, world.walks, rng=rng)
    with pytest.raises(InputError, match="one of both"):
        learn("planning", problem, world.walks, gamma=0.5, rng=rng)
    with pytest.raises(InputError, match="one of both"):
        learn("planning", problem, world.walks, world.grid.features, rng=rng)


def glued_walks(world, rng, parts=3):
    """Walks cut in pieces and joined in another order, as a file without run numbers gives them."""
    pieces = [world.walks.select(world.walks.trajectory == k).pairs for k in range(4)]
    rng.shuffle(pieces)
    return Demonstrations.from_pairs([pair for piece in pieces for pair in piece])


@pytest.mark.parametrize("name", ["max_ent", "fa_mlirl", "behaviour_cloning"])
def test_runs_glued_together_are_refused_and_parted_on_request(worlds, name):
    world, rng = worlds[5], np.random.default_rng(0)
    glued = glued_walks(world, rng)
    problem = LearningProblem(world.model, world.grid.features, gamma=GAMMA)
    with pytest.raises(InputError, match=r"demonstrations: trajectory 0, step \d+: action"):
        learn(name, problem, glued, rng=rng)
    parted, places = glued.parted(world.model)
    assert places == 3
    learnt = learn(name, problem, parted, rng=np.random.default_rng(0))
    assert world.value_share(learnt.q) >= 0.99


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


@pytest.mark.parametrize("name", sorted(KEYS))
def test_what_is_no_option_of_a_method_is_named_with_those_that_are(worlds, name):
    world = worlds[5]
    with pytest.raises(InputError, match=rf"{name}: option: unknown name 'sparsty'; valid: \w+"):
        learn(name, world.model, world.walks, gamma=GAMMA, rng=np.random.default_rng(0), sparsty=1)


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("planning", {"sparsity": "a"}, "sparsity: a number wanted, is 'a'"),
        ("planning", {"max_iterations": 2.5}, "max_iterations: a whole number wanted, is 2.5"),
        ("lp_basis", {"bumps": 2.5}, "bumps: a whole number wanted"),
        ("fa_mlirl", {"networks": 1.5}, "networks: a whole number wanted"),
        ("deep_max_ent", {"hidden": 8}, "hidden: several numbers wanted, is 8"),
        ("deep_max_ent", {"hidden": (10**12,)}, "hidden: must be ≥ 1 and ≤ 10000"),
        ("planning", {"gamma": "0.9"}, "gamma: a number wanted, is '0.9'"),
        ("planning", {"gamma": [0.9]}, "gamma: a number wanted"),
        ("planning", {"rng": 0}, "rng: numpy.random.default_rng"),
        ("planning", {"rng": None}, "rng: numpy.random.default_rng"),
        ("planning", {"advice": "left"}, "advice: Advice wanted, got str"),
        ("deep_max_ent", {"features": np.full((25, 1), 1e39)}, "features: must be of a size near"),
    ],
)
def test_an_option_of_a_wrong_kind_is_refused_by_name(worlds, name, options, words):
    world = worlds[5]
    given = {"gamma": GAMMA, "rng": np.random.default_rng(0), "features": world.grid.features}
    with pytest.raises(InputError, match=words):
        learn(name, world.model, world.walks, **(given | options))


@pytest.mark.parametrize("name", sorted(KEYS))
def test_demonstrations_without_a_choice_teach_nothing_and_it_is_said(name):
    model = TransitionModel.from_dense(np.roll(np.eye(4), 1, axis=1)[:, None, :])
    shown = Demonstrations.from_labels([(0, 0), (2, 0)])
    rng = np.random.default_rng(0)
    learnt = learn(name, model, shown, np.eye(4), gamma=GAMMA, rng=rng, **QUICK.get(name, {}))
    assert "no demonstrated state offers a choice of actions" in learnt.note
