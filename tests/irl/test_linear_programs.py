import numpy as np
import pytest

from irl.demonstrations import Demonstrations
from irl.domains.gridworld import GridWorld
from irl.mdp import TransitionModel
from irl.methods import learn
from irl.planning import value_iteration

GAMMA = 0.9


def fit(name, model, demonstrations, **options):
    features = np.linspace(0, 1, model.n_states)[:, None]
    rng = np.random.default_rng(0)
    return learn(name, model, demonstrations, features, gamma=GAMMA, rng=rng, **options)


@pytest.fixture
def corridor():
    """From 0 to 3, one way in each; 4 is a choice between 0 and 3 that nobody was shown."""
    state, action = np.array([0, 1, 2, 4, 4]), np.array([1, 0, 1, 0, 1])
    return TransitionModel.from_entries(5, 2, state, action, np.array([1, 2, 3, 0, 3]), np.ones(5))


@pytest.mark.parametrize("name", ["lp", "lp_basis"])
def test_demonstrations_without_a_choice_show_no_preference(corridor, name):
    learnt = fit(name, corridor, Demonstrations.from_pairs([(0, 1), (1, 0), (2, 1)]))
    assert learnt.no_preference
    np.testing.assert_array_equal(learnt.reward, np.zeros(5))
    np.testing.assert_array_equal(learnt.q, np.where(corridor.mask, 0.0, -np.inf))
    assert learnt.note == "no preference: R = 0; no demonstrated state offers a choice of actions"
    assert not learnt.lower


def test_a_few_bumps_show_no_preference_either(corridor):
    learnt = fit("lp_basis", corridor, Demonstrations.from_pairs([(0, 1), (1, 0)]), bumps=2)
    assert learnt.no_preference


@pytest.mark.parametrize("name", ["lp", "lp_basis"])
def test_choices_that_contradict_one_another_are_named(name):
    ends = TransitionModel.from_entries(
        4, 2, np.repeat([0, 1], 2), np.tile([0, 1], 2), np.tile([2, 3], 2), np.ones(4)
    )
    learnt = fit(
        name,
        ends,
        Demonstrations.from_labels([(0, 0), (1, 1)]),
        **{"lp": {"l1": 0.0}}.get(name, {}),
    )
    assert learnt.no_preference
    assert learnt.note.endswith("no reward puts the demonstrated actions above the others")


def test_a_penalty_that_is_too_high_is_named_and_a_lower_one_given():
    # From 0, action 0 enters 1 and action 1 enters 2; both end. A reward r in 1 and −r in 2 has
    # the margin 2 r and the price 2 r l1: it pays below 1.
    ends = TransitionModel.from_entries(
        3, 2, np.array([0, 0]), np.array([0, 1]), np.array([1, 2]), np.ones(2)
    )
    shown = Demonstrations.from_pairs([(0, 0)])
    learnt = fit("lp", ends, shown, l1=3.0)
    assert learnt.no_preference
    assert learnt.note == "no preference: R = 0 is best at l1 = 3; lower l1 below 1"
    assert learnt.lower == {"l1": pytest.approx(0.5)}
    again = fit("lp", ends, shown, **learnt.lower)
    assert not again.no_preference
    np.testing.assert_allclose(again.reward, [0, 1, -1], atol=1e-6)
    assert again.note == ""
    assert not again.lower


def test_other_methods_name_their_penalty():
    grid = GridWorld(5, (3, 1))
    shown = Demonstrations.from_trajectories(grid.trajectories("diagonal"))
    learnt = fit("planning", grid.model, shown, sparsity=1.0)
    assert learnt.no_preference
    assert learnt.note == "no preference: R = 0; lower sparsity"
    np.testing.assert_array_equal(learnt.q, np.where(grid.model.mask, 0.0, -np.inf))


@pytest.mark.parametrize("options", [{"name": "lp", "l1": 0.0}, {"name": "lp_basis"}])
@pytest.mark.parametrize("step", [1, 2])
def test_margins_that_are_not_met_are_counted(options, step):
    # Half of the cells are planned for, or none; no reward explains choices drawn by lot.
    grid = GridWorld(7, (5, 2))
    rng = np.random.default_rng(2)
    cells = range(0, grid.n_states, step)
    pairs = [(s, int(rng.choice(grid.model.actions_of(s)))) for s in cells]
    learnt = fit(model=grid.model, demonstrations=Demonstrations.from_labels(pairs), **options)
    assert not learnt.no_preference
    _, Q = value_iteration(grid.model, learnt.reward, GAMMA)
    better = level = 0
    for s, a in pairs:
        other = max(Q[s, b] for b in grid.model.actions_of(s) if b != a)
        better += other > Q[s, a] + 1e-6
        level += abs(other - Q[s, a]) <= 1e-6
    counts = ((better, "better"), (level, "as good"))
    told = [f"in {count} another action is {words}" for count, words in counts if count]
    assert told
    assert learnt.note == (
        f"margins not met: of {len(pairs)} demonstrated states, {', '.join(told)}"
    )
