"""Members that learnt from parts of the labels: what they agree about, and what they do not."""

import numpy as np
import pytest

from irl.demonstrations import Demonstrations
from irl.demonstrators import OracleDemonstrator
from irl.domains.gridworld import GridWorld
from irl.ensemble import ACCURACY, IN_A_ROW, KEPT, SUCCESS, EnsembleRule, Member, part_of, predicted
from irl.methods import learn
from irl.planning import value_iteration
from irl.posterior.predictions import Predicted
from irl.problem import LearningProblem

WORLD = GridWorld(7, (3, 3))
MODEL, GOAL = WORLD.model, np.array([WORLD.goal_state])
ORACLE = OracleDemonstrator(MODEL, GOAL, gamma=0.9)
Q = value_iteration(MODEL, ORACLE.state_reward, 0.9, terminal=GOAL)[1]
Q[GOAL] = np.where(MODEL.mask[GOAL], 0.0, -np.inf)
STATES = np.setdiff1d(np.arange(MODEL.n_states), GOAL)
STARTS = np.array([0, 6, 42, 48])


def told(own, others, judged=STATES):
    return predicted(MODEL, own, others, GOAL, STARTS, judged)


def of_values(q, beta=30.0):
    return Member(np.where(MODEL.mask, q, -np.inf), beta)


def test_members_that_know_the_way_let_pass_whatever_is_as_good():
    knows = of_values(Q)
    # Values that differ by next to nothing: each breaks ties in its own way.
    rng = np.random.default_rng(0)
    others = [of_values(Q + 1e-6 * rng.random(Q.shape)) for _ in range(3)]
    assert (others[0].action(MODEL) != others[1].action(MODEL)).any()
    assert told(knows, others) == Predicted(pytest.approx(1.0), 1.0)


def test_it_is_right_as_often_as_members_say_and_arrives_where_the_model_says():
    knows, stays = of_values(Q), of_values(-Q)
    doubted = told(knows, [knows, stays])
    assert doubted.success == pytest.approx(1.0)
    assert doubted.accuracy == pytest.approx(
        (1 + stays.lets_pass(STATES, knows.action(MODEL)[STATES]).mean()) / 2
    )
    assert told(stays, [stays]).success < 0.5
    assert predicted(MODEL, knows, [knows], GOAL[:0], STARTS, STATES).success == 0  # of no end


def test_an_action_is_let_pass_that_is_at_least_half_as_likely():
    q = np.where(MODEL.mask, 0.0, -np.inf)
    state = 24
    first, second, *_ = MODEL.actions_of(state).tolist()
    q[state, first] = 0.1
    for beta, passes in ((0.99 * np.log(2) / 0.1, True), (1.01 * np.log(2) / 0.1, False)):
        member = Member(q, beta)
        assert member.lets_pass(np.array([state]), np.array([second])) == passes
        assert member.lets_pass(np.array([state]), np.array([first]))


def test_a_part_keeps_as_many_labels_as_a_bootstrap_and_the_ends_of_what_is_left():
    runs = [Demonstrations.from_pairs([(3, 0), (3, 1)], k, end=24) for k in range(2000)]
    alone = Demonstrations.from_pairs([], 5000, end=24)
    shown, rng = Demonstrations.concatenate([*runs, alone]), np.random.default_rng(0)
    part = part_of(shown, rng)
    assert len(part) / len(shown) == pytest.approx(KEPT, abs=0.02)
    assert set(part.ends[:, 0]) == {*part.trajectory.tolist(), 5000}
    few = Demonstrations.from_pairs([(3, 0)], 0, end=24)
    assert all(len(part_of(few, rng)) == 1 for _ in range(20))
    assert not len(part_of(alone, rng))


def test_members_agree_the_more_the_more_was_shown():
    problem = LearningProblem(MODEL, WORLD.features.astype(np.float32), gamma=0.9)
    rng, agreed = np.random.default_rng(0), []
    for number in (3, 40):
        states = rng.choice(STATES, number, replace=False).tolist()
        answers = [
            Demonstrations.from_pairs([(s, ORACLE.label(s, rng))], k) for k, s in enumerate(states)
        ]
        ended = Demonstrations.from_pairs([], 100, end=WORLD.goal_state)
        shown = Demonstrations.concatenate([*answers, ended])

        def member(given):
            return Member(learn("behaviour_cloning", problem, given, rng=rng).q, 30.0)

        others = [member(part_of(shown, rng)) for _ in range(4)]
        agreed.append(told(member(shown), others).accuracy)
    assert agreed[0] < agreed[1]


def test_it_is_enough_when_predictions_were_good_twice_in_a_row():
    rule, good = EnsembleRule(), Predicted(SUCCESS, ACCURACY)
    said = [rule(each) for each in (good, Predicted(1.0, 0.5), good, Predicted(0.9, 1.0))]
    assert not any(said)
    assert [rule(good) for _ in range(IN_A_ROW)] == [False] * (IN_A_ROW - 1) + [True]
