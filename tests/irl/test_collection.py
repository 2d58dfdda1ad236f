import numpy as np
import pytest

from irl.collection import (
    by_trusted_rules,
    demonstrate,
    held_out,
    initial_demonstrations,
    mislabel,
    recorded_runs,
    runs_from,
)
from irl.demonstrations import Demonstrations
from irl.demonstrators import OracleDemonstrator, RecordedDemonstrator
from irl.errors import InputError
from irl.generalisation import Generalisation
from irl.teacher import Teacher


@pytest.fixture
def oracle(random_model):
    model = random_model(np.random.default_rng(2), n_states=200, n_actions=4)
    return OracleDemonstrator(model, np.array([0]))


@pytest.fixture
def neighbours(oracle):
    """Pairs with the same action in five successive states follow from each other."""
    model = oracle.model
    return Generalisation(
        model.pair_state,
        model.pair_action,
        (model.pair_state // 5 * 4 + model.pair_action).astype(np.int32),
        np.zeros(model.n_pairs, dtype=np.uint8),
        ["neighbours"],
    )


def test_one_trajectory_is_shown_from_each_start(oracle):
    starts = [7, 150, 7]
    shown = demonstrate(oracle, starts, np.random.default_rng(3), max_steps=4)
    rng = np.random.default_rng(3)
    for k, start in enumerate(starts):
        run = shown.select(shown.trajectory == k)
        assert run.pairs == oracle.trajectory(start, rng, 4)
        assert run.step.tolist() == list(range(len(run)))


def test_starts_are_drawn_on_the_way(oracle):
    def starts(rng):
        for _ in range(3):
            yield rng.integers(200)

    rng = np.random.default_rng(5)
    shown = demonstrate(oracle, starts(rng), rng)
    again = np.random.default_rng(5)
    expected = [oracle.trajectory(int(again.integers(200)), again) for _ in range(3)]
    assert shown.pairs == [pair for run in expected for pair in run]


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_so_many_labels_are_wrong_as_asked_for(oracle, share):
    model = oracle.model
    wrong = model.mask & ~oracle.optimal_actions
    shown = demonstrate(oracle, range(0, 200, 2), np.random.default_rng(1))
    before = shown.action.copy()
    noisy = mislabel(shown, wrong, share, np.random.default_rng(2))
    changed = noisy.action != before
    fallible = wrong[shown.state].any(axis=1)
    assert 0 < fallible.sum() < len(shown)
    assert changed.sum() == round(share * fallible.sum())
    assert wrong[noisy.state[changed], noisy.action[changed]].all()
    assert (shown.action == before).all()
    assert noisy.state.tolist() == shown.state.tolist()


def test_a_share_of_wrong_labels_is_a_share(oracle):
    shown = Demonstrations.empty()
    with pytest.raises(InputError, match="share of wrong labels"):
        mislabel(shown, oracle.model.mask, 1.2, np.random.default_rng(0))


@pytest.mark.parametrize("count", [1, 60, 61, 62, 63, 100])
def test_exactly_the_number_wanted_is_demonstrated(oracle, neighbours, count):
    rng = np.random.default_rng(count)
    starts = np.arange(200)
    shown = initial_demonstrations(Teacher(oracle, generalisation=neighbours), starts, count, rng)
    assert shown.n_states_demonstrated == count
    shown.check(oracle.model)
    direct = shown.select(~shown.generalised)
    assert oracle.optimal_actions[direct.state, direct.action].all()


def test_surplus_is_dropped_from_the_last_generalised(oracle, neighbours):
    def collect(count):
        teacher = Teacher(oracle, generalisation=neighbours, rules=["neighbours"])
        return initial_demonstrations(teacher, np.arange(200), count, np.random.default_rng(0))

    more, fewer = collect(62), collect(61)
    assert set(fewer.pairs) <= set(more.pairs)
    assert fewer.select(~fewer.generalised).pairs == more.select(~more.generalised).pairs


def test_it_says_so_when_trajectories_run_dry(oracle):
    # From the goal there is nothing to show.
    goal, rng = np.array([0]), np.random.default_rng(0)
    with pytest.raises(InputError, match=r"3 states wanted, .* reach only 0"):
        initial_demonstrations(Teacher(oracle), goal, 3, rng)
    with pytest.raises(InputError, match=r"3 states wanted, .* reach only 0"):
        held_out(oracle, np.array([1]), goal, rng, n=3)


def test_held_out_shares_no_state_with_the_training_set(oracle, neighbours):
    rng = np.random.default_rng(0)
    starts = np.arange(200)
    training = initial_demonstrations(Teacher(oracle, generalisation=neighbours), starts, 80, rng)
    test = held_out(oracle, training.state, starts, rng, n=50)
    assert len(test) == test.n_states_demonstrated == 50
    assert not np.isin(test.state, training.state).any()
    assert oracle.optimal_actions[test.state, test.action].all()


def test_collections_repeat_with_their_seed(oracle, neighbours):
    teacher = Teacher(oracle, generalisation=neighbours)
    a, b = (
        initial_demonstrations(teacher, np.arange(200), 70, np.random.default_rng(4))
        for _ in range(2)
    )
    assert a.pairs == b.pairs
    assert isinstance(a, Demonstrations)


@pytest.mark.parametrize("count", [1, 40, 5000])
def test_every_label_counts_as_often_as_it_was_recorded(oracle, neighbours, count):
    shown = demonstrate(oracle, range(0, 200, 5), np.random.default_rng(1))
    teacher = Teacher(RecordedDemonstrator(shown), generalisation=neighbours, rules=[])
    runs = recorded_runs(shown, np.random.default_rng(0))
    first, *_ = by_trusted_rules(teacher, runs, count, 0.0)
    assert first.n_states_demonstrated == min(count, shown.n_states_demonstrated)
    moments = list(zip(first.trajectory, first.step, first.state, first.action, strict=True))
    assert len(set(moments)) == len(moments)
    recorded = zip(shown.trajectory, shown.step, shown.state, shown.action, strict=True)
    assert set(moments) <= set(recorded)
    assert (len(first) == len(shown)) == (count == 5000)


def test_a_slip_in_a_recording_weighs_once_however_many_states_lead_to_it(oracle):
    """State 1 was answered twice with 0 and once, where a run ended, with 1."""
    runs = [[(s, 0) for s in range(10, 30)] + [(1, 1)], [(1, 0)], [(1, 0)]]
    shown = Demonstrations.from_trajectories(runs)
    teacher = Teacher(RecordedDemonstrator(shown))
    runs = recorded_runs(shown, np.random.default_rng(0))
    every, *_ = by_trusted_rules(teacher, runs, 99, 0.0)
    assert every.counted.policy(200)[1] == 0


@pytest.mark.parametrize("count", [1, 60, 100])
def test_rules_are_used_as_far_as_runs_bear_them_out(oracle, neighbours, count):
    """A neighbour's best action is mostly another one, as runs through both tell."""
    labels = {}
    for least in (0.0, 0.95):
        rng = np.random.default_rng(2)
        runs = runs_from(oracle, np.arange(200), rng)
        teacher = Teacher(oracle, generalisation=neighbours)
        labels[least], trusting, trust = by_trusted_rules(teacher, runs, count, least)
        assert labels[least].n_states_demonstrated == count
        assert set(trusting.rules) <= set(neighbours.rule_names)
        for name in neighbours.rule_names:
            assert (name in trusting.rules) == (trust[name]["on the way"].share >= least)
    for derived in (labels[0.95].select(labels[0.95].generalised),):
        assert oracle.optimal_actions[derived.state, derived.action].all()


def test_trust_ends_when_runs_run_dry(oracle):
    runs = runs_from(oracle, np.array([0]), np.random.default_rng(0))
    with pytest.raises(InputError, match=r"3 states wanted, .* reach only 0"):
        by_trusted_rules(Teacher(oracle), runs, 3, 0.95)
