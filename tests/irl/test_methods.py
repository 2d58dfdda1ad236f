import numpy as np
import pytest

from irl.advice import Advice
from irl.baselines.birl import SamplingConfig
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.method_inputs import Inputs
from irl.methods import METHODS, learn
from irl.problem import LearningProblem
from irl.training_config import TrainingConfig
from tests.irl.method_worlds import GAMMA, QUICK, World

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
