import numpy as np
import pytest

from experiments.grasping.hidden.costs import costs, factors, nameless_cost
from experiments.grasping.hidden.drawn import RANGES, TILT, HabitualDemonstrator, draw, with_noise
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK
from models.task.spaces import N_FREE, Kind, decode_actions, decode_states


@pytest.fixture(scope="module")
def task():
    return load_robot_task(SHIPPED_TASK)


@pytest.fixture(scope="module")
def rewards(task):
    return draw(task, [2, 7, 9, 14], seed=5)


def test_rewards_are_of_the_kinds_and_sizes_that_are_stated(rewards):
    assert [r.kind for r in rewards] == ["region", "region", "held", "free"]
    assert [r.goal_states.size > 1 for r in rewards] == [True, True, False, False]
    assert (rewards[2].goal_states >= N_FREE).all()
    assert (rewards[3].goal_states < N_FREE).all()
    for reward in rewards:
        assert ("tilt" in reward.sizes) == (reward.number == 7)
        for name, size in reward.sizes.items():
            low, high = RANGES.get(name, TILT)
            assert low <= size <= high
        assert 0 < reward.moved <= 1


def test_a_reward_depends_on_seed_and_number_alone(task, rewards):
    (again,) = draw(task, [9], seed=5)
    assert again.told == rewards[2].told
    np.testing.assert_array_equal(again.oracle.optimal_actions, rewards[2].oracle.optimal_actions)
    assert draw(task, [9], seed=6)[0].told != again.told


def test_a_habit_is_one_of_the_co_optimal_actions_and_always_the_same(rewards):
    oracle = rewards[1].oracle
    assert isinstance(oracle, HabitualDemonstrator)
    states = np.flatnonzero(oracle.optimal_actions.any(axis=1))[::500]
    rng = np.random.default_rng(0)
    for s in states.tolist():
        labels = {oracle.label(s, rng) for _ in range(3)}
        assert len(labels) == 1
        assert oracle.optimal_actions[s, labels.pop()]


def test_noise_gives_wrong_labels_as_often_as_asked_for(rewards):
    reward = with_noise(rewards[1], 0.3)
    rng, oracle = np.random.default_rng(0), reward.oracle
    states = rng.choice(np.flatnonzero(oracle.optimal_actions.any(axis=1)), 600)
    wrong = [not oracle.optimal_actions[s, oracle.label(int(s), rng)] for s in states]
    assert 0.22 < np.mean(wrong) < 0.38


def test_costs_are_what_their_names_say(task):
    model, named = task.model, costs(task.model)
    kind, target = decode_actions(model.pair_action)
    state = decode_states(model.pair_state)
    for name, cost in named.items():
        assert cost.shape == (model.n_pairs,), name
        assert cost.min() == 0, name
        assert 0.5 < cost.max() <= 1 + 1e-12, name
    assert set(kind[named["motion"] > 0]) == {Kind.TRANSLATE}
    assert set(kind[named["turn"] > 0]) == {Kind.ROTATE}
    lower = (kind == Kind.TRANSLATE) & (target % 2 == 0) & (state.position != target)
    assert named["layer"][lower].max() < 0.5 < named["layer"][kind == Kind.TRANSLATE].max()
    assert not (named["grip"] * nameless_cost(model)).any()
    # From one end of the grid to the other, and a quarter turn about the vertical.
    far = (kind == Kind.TRANSLATE) & (state.position == 0) & (target == 17)
    np.testing.assert_allclose(named["motion"][far], 1.0)
    quarter = (kind == Kind.ROTATE) & (state.gripper == 10) & (target == 12)
    np.testing.assert_allclose(named["turn"][quarter], 0.5)


def test_factors_tell_states_apart():
    table = np.column_stack(list(factors().values()))
    assert len(np.unique(table, axis=0)) == len(table)
    assert (table[-1] == -1).all()
