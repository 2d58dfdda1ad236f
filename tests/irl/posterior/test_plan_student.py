"""A VR network that learns from the posterior's plan."""

from dataclasses import replace

import numpy as np

from irl.collection import demonstrate_to_the_end
from irl.demonstrators import OracleDemonstrator
from irl.domains.gridworld import GridWorld
from irl.planning import policy_success
from irl.policy import Policy
from irl.posterior import GoalConfig, GoalLearner, taught
from irl.posterior.arriving import LEANINGS
from irl.posterior.plan_student import PlanStudentConfig, plan_labels, plan_values
from irl.problem import LearningProblem
from irl.training_config import TrainingConfig

N = 7
ROW, COLUMN = np.divmod(np.arange(N * N), N)
MODEL = GridWorld(N, (0, 0)).model
WALL = MODEL.P @ ((COLUMN == 3) & (ROW > 0)).astype(float)
GOAL = np.array([47])
CELLS = np.eye(N * N)


def learnt():
    oracle = OracleDemonstrator(
        MODEL, GOAL, gamma=0.95, action_cost=0.01 + 0.3 * WALL, tolerance=0.005
    )
    rng = np.random.default_rng(0)
    learner = GoalLearner(
        LearningProblem(MODEL, gamma=0.95, costs={"wall": WALL}),
        rng=rng,
        config=GoalConfig(rounds=2),
    )
    learner.learn(demonstrate_to_the_end(oracle, [42, 44], rng))
    return learner, oracle


def test_a_student_does_what_its_teacher_would_do():
    learner, oracle = learnt()
    student = taught(learner, CELLS, rng=np.random.default_rng(1))
    action = Policy.from_q(student.q, MODEL.mask).action
    away = ~oracle.terminal
    teacher = learner.q >= learner.q.max(axis=1, keepdims=True) - 0.005
    assert teacher[np.flatnonzero(away), action[away]].mean() >= 0.97
    np.testing.assert_allclose(policy_success(MODEL, action, GOAL, 20), 1)
    # A policy of the thesis' form: its values follow from f alone, and caution.
    expected = MODEL.table(MODEL.P @ student.f - student.caution * MODEL.surprise)
    np.testing.assert_allclose(student.q, expected)
    assert np.abs(student.f).max() < 1
    assert student.leaning == 0


def test_values_of_a_plan_lead_to_its_goal_and_rank_what_costs_nothing_as_it_does():
    learner, _ = learnt()
    value = plan_values(learner)
    assert value.argmax() == GOAL[0]
    action = Policy.from_q(MODEL.q_values(value, 0.0), MODEL.mask).action
    np.testing.assert_allclose(policy_success(MODEL, action, GOAL, 20), 1)
    q = MODEL.table(MODEL.P @ value)
    free = np.isfinite(learner.q) & (MODEL.table(WALL) == 0)
    np.testing.assert_allclose(np.ptp(q[free] - learner.q[free]), 0, atol=0.02)


def test_who_would_not_arrive_leans_on_its_teachers_values_as_little_as_does():
    learner, _ = learnt()
    untaught = PlanStudentConfig(training=TrainingConfig(iterations=1, beta=100.0))
    rng = np.random.default_rng(1)
    alone = taught(learner, CELLS, rng=rng, config=replace(untaught, leanings=(0.0,)))
    leaning = taught(learner, CELLS, rng=np.random.default_rng(1), config=untaught)
    success = [
        policy_success(MODEL, Policy.from_q(each.q, MODEL.mask).action, GOAL, 20).mean()
        for each in (alone, leaning)
    ]
    assert success[0] < 0.9 and success[1] > 0.99
    before = LEANINGS[LEANINGS.index(leaning.leaning) - 1]
    less = taught(
        learner,
        CELLS,
        rng=np.random.default_rng(1),
        config=replace(untaught, leanings=(before,)),
    )
    reached = policy_success(MODEL, Policy.from_q(less.q, MODEL.mask).action, GOAL, 20).mean()
    assert leaning.leaning > 0 and reached < success[1]
    np.testing.assert_allclose(leaning.f - alone.f, leaning.leaning * plan_values(learner))


def test_labels_are_shared_among_what_is_equally_good_and_none_is_given_at_the_goal():
    learner, _ = learnt()
    state, action, weight = plan_labels(learner)
    np.testing.assert_array_equal(np.unique(state), np.setdiff1d(np.arange(N * N), GOAL))
    np.testing.assert_allclose(np.bincount(state, weight)[np.unique(state)], 1)
    corner = state == 0
    best = np.flatnonzero(learner.q[0] >= learner.q[0].max() - 0.005)
    np.testing.assert_array_equal(action[corner], best)
    np.testing.assert_allclose(weight[corner], 1 / best.size)


def test_the_same_seed_gives_the_same_student():
    learner, _ = learnt()
    first, second = (taught(learner, CELLS, rng=np.random.default_rng(2)) for _ in range(2))
    assert first.q.tobytes() == second.q.tobytes()
