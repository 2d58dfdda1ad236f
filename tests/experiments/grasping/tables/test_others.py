"""Networks of other sizes, and moves in place of a transition model."""

import numpy as np
import pytest

from experiments.grasping.tables import clusters, larger, model_free, network
from experiments.grasping.tables.learners import OURS
from experiments.grasping.tables.lesson import shared_teacher
from experiments.kit.shipped_data import SHIPPED_TASK
from irl.mdp import TransitionModel

FOLDER = str(SHIPPED_TASK)
RING = TransitionModel.from_dense(
    np.array(
        [
            [[0.0, 0.25, 0.75], [0.0, 1.0, 0.0]],
            [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]],
            [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        ]
    )
)


def short(learner):
    few = learner.with_training(iterations=3).with_learning(demonstrations=20)
    return few.with_active(refine=few.learning.active.initial, hidden=(8,))


def test_moves_that_are_counted_tell_the_model():
    moves = model_free.wander(RING, np.array([0]), 30_000, np.random.default_rng(0))
    assert moves.shape == (30_000, 3)
    model = model_free.counted(RING, moves)
    assert (model.mask == RING.mask).all()
    np.testing.assert_allclose(model.P.toarray(), RING.P.toarray(), atol=0.02)
    first = moves[moves[:, 0] == 0]
    assert np.mean(first[:, 1] == 0) == pytest.approx(0.5, abs=0.02)


def test_what_was_never_tried_is_not_in_the_model():
    model = model_free.counted(RING, np.array([[0, 1, 1], [0, 1, 1]]))
    assert model.n_pairs == 1
    assert model.actions_of(0).tolist() == [1]


def test_a_lesson_from_moves_is_judged_in_the_true_world(monkeypatch):
    monkeypatch.setattr(model_free, "OURS", short(OURS))
    row = model_free.learnt_from_moves(FOLDER, (2000, 2, 0))
    assert 0.001 < row["pairs_seen"] < 2100 / shared_teacher(FOLDER).task.model.n_pairs
    assert 0 <= row["success_mdp"] <= 1
    # Where nothing was tried nothing is chosen, which is never right.
    assert row["accuracy_optimal_all"] < 0.1


def test_sizes_and_features_are_compared_with_the_demos():
    own = OURS.learning
    assert network.cases().count((own.features, own.active.hidden)) == 1
    assert {features for features, _ in network.cases()} == set(network.FEATURES)


def test_a_network_of_another_size_is_taught(monkeypatch):
    monkeypatch.setattr(network, "OURS", short(OURS))
    row = network.learnt_with(FOLDER, 20, ("thesis", 6, 4, 0))
    assert (row["features"], row["hidden"], row["labels"]) == ("thesis", [6, 4], 20)
    assert row["seconds"] > 0


def test_with_a_switch_the_goal_counts_in_one_position_alone(monkeypatch):
    task = shared_teacher(FOLDER).task
    problem, mind = larger.with_switch(task, 3)
    n, model = task.model.n_states, problem.model
    assert model.n_states == 3 * n
    assert model.n_pairs == 3 * (task.model.n_pairs + 432)
    state = int(task.start_states[0])
    press = task.model.n_actions
    after = [model.P[model.pair_index(state + p * n, press)].indices.tolist() for p in range(3)]
    assert after == [[state + n], [state + 2 * n], [state]]
    goal = int(task.goal_states[0])
    # At the goal with the switch at 1, two presses are all that is left to do.
    rng = np.random.default_rng(0)
    assert mind.trajectory(goal + n, rng) == [(goal + n, press), (goal + 2 * n, press)]
    monkeypatch.setattr(larger, "OURS", short(OURS))
    monkeypatch.setattr(larger, "SHARE", 0.001)
    row = larger.learnt_with_switch(FOLDER, (2, 0))
    assert (row["states"], row["labels"]) == (31968, 31)
    assert 0 <= row["success_mdp"] <= 1


def test_answers_about_clusters_that_were_found_exclude_and_never_mislead(monkeypatch):
    monkeypatch.setattr(clusters, "OURS", short(OURS).with_active(policy_update="greedy"))
    rows = clusters.answered(FOLDER, 20, (2, 20), (10,), (0,))
    told = {(row["drawn"], row["answers"]): row for row in rows}
    assert len(told) == len(rows) == 4 * 2
    assert told["the twenty of Table 5.4", 2]["clusters"] == 20
    for (drawn, number), row in told.items():
        assert 0 <= row["excluded"] < 1
        # What is excluded is never right.
        assert row["gain"] >= 0
        assert number == 2 or row["excluded"] >= told[drawn, 2]["excluded"]
