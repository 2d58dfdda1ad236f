"""What a policy is compared with, whether its demonstrator has habits or none."""

import numpy as np
import pytest

from experiments.grasping.assessment import assess
from experiments.grasping.hidden.costs import costs
from experiments.grasping.teacher import GraspTeacher, TeacherConfig
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK
from irl.demonstrations import Demonstrations

NOTHING = Demonstrations.empty()


@pytest.fixture(scope="module")
def task():
    return load_robot_task(SHIPPED_TASK)


@pytest.fixture(scope="module")
def teachers(task):
    return {ties: GraspTeacher(task, TeacherConfig(ties=ties)) for ties in ("random", "habit")}


def judged(task, oracle, action):
    return assess(task, oracle, action, NOTHING, np.random.default_rng(0))


def test_a_perfect_policy_has_all_that_can_be_expected(task, teachers):
    oracle = teachers["random"].oracle
    best = oracle.optimal_actions
    action = np.where(best.any(axis=1), best.argmax(axis=1), -1)
    told = judged(task, oracle, action)
    assert told.strict_of_ceiling == told.accuracy_optimal_all.value == 1.0
    assert 0.4 < told.accuracy_strict_ceiling < 0.7
    assert told.success_mdp > 0.99


def test_a_habit_shows_one_of_the_equally_good_actions(task, teachers):
    plain, oracle = teachers["random"].oracle, teachers["habit"].oracle
    assert (oracle.optimal_actions == plain.optimal_actions).all()
    turn = task.model.table(costs(task.model)["turn"], fill=np.inf)
    rng = np.random.default_rng(0)
    some = rng.choice(np.flatnonzero(plain.optimal_actions.sum(axis=1) > 2), 50, replace=False)
    for state in some:
        (action,) = {oracle.label(state, rng) for _ in range(3)}
        equal = np.flatnonzero(plain.optimal_actions[state])
        assert action in equal
        assert turn[state, action] == turn[state, equal].min()
    assert judged(task, oracle, oracle.preferred).accuracy_strict.value == 1.0
    assert judged(task, oracle, oracle.preferred).accuracy_strict_ceiling == 1.0
    other = np.where(plain.optimal_actions.any(axis=1), plain.optimal_actions.argmax(axis=1), -1)
    told = judged(task, oracle, other)
    assert told.accuracy_optimal_all.value == 1.0 > told.strict_of_ceiling
