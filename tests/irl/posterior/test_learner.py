"""A room in which one may go straight through mud: does the learner find goal, region and cost?"""

from dataclasses import replace

import numpy as np
import pytest

from irl.collection import demonstrate_to_the_end
from irl.demonstrations import Demonstrations
from irl.demonstrators import OracleDemonstrator
from irl.domains.gridworld import GridWorld
from irl.errors import InputError
from irl.methods import learn
from irl.metrics import accuracy_on_unseen, success_mdp
from irl.posterior.arriving import SHORT
from irl.posterior.belief import SIZES
from irl.posterior.enough import UNSURE, EnoughRule, claim
from irl.posterior.goals import beyond, propose, regions
from irl.posterior.learner import AGREE, SURE, GoalConfig, GoalLearner
from irl.posterior.predictions import action_values
from irl.posterior.questions import information_gain
from irl.problem import LearningProblem

N = 9
ROW, COLUMN = np.divmod(np.arange(N * N), N)
MUD = (COLUMN == 4) & (ROW < 7)


def room(goal, mud_cost):
    """The problem, and who demonstrates in it."""
    model = GridWorld(N, (0, 0)).model
    mud = model.P @ MUD.astype(float)
    problem = LearningProblem(
        model, gamma=0.95, costs={"mud": mud}, factors={"row": ROW, "column": COLUMN}
    )
    oracle = OracleDemonstrator(
        model, np.flatnonzero(goal), gamma=0.95, action_cost=0.01 + mud_cost * mud, tolerance=0.005
    )
    return problem, oracle


def judged(problem, oracle, q, shown):
    """Accuracy over unseen states, and success from everywhere."""
    everywhere = np.arange(N * N)
    action = q.argmax(axis=1)
    accuracy = accuracy_on_unseen(action, shown.state, oracle, everywhere).value
    return accuracy, success_mdp(problem.model, action, oracle.goal_states, everywhere)


def asked(problem, oracle, start, questions, seed=0):
    """One run from ``start``, and answers to questions."""
    rng = np.random.default_rng(seed)
    shown = demonstrate_to_the_end(oracle, [start], rng)
    learner = GoalLearner(problem, rng=rng, config=GoalConfig(rounds=4))
    learner.learn(shown)
    for k in range(questions):
        state = learner.question()
        done = oracle.terminal[state]
        answer = Demonstrations.from_pairs(
            [] if done else [(state, oracle.label(state, rng))], 10 + k, end=state if done else None
        )
        shown = Demonstrations.concatenate([shown, answer])
        learner.learn(shown, rounds=1)
    return learner


@pytest.mark.parametrize("goal", [ROW * N + COLUMN == 60, COLUMN == 8], ids=["state", "region"])
@pytest.mark.parametrize("mud_cost", [0.0, 0.2])
def test_goal_and_cost_are_found_from_one_run_and_eight_answers(goal, mud_cost):
    problem, oracle = room(goal, mud_cost)
    learner = asked(problem, oracle, start=0, questions=8)
    accuracy, success = judged(problem, oracle, learner.q, learner.shown)
    assert success == 1.0
    assert accuracy >= 0.97
    assert learner.predicted.success > 0.99
    assert learner.predicted.accuracy > 0.9
    assert learner.ends_agree >= AGREE


def test_an_end_that_is_recorded_is_where_the_learner_goes():
    problem, oracle = room(ROW * N + COLUMN == 60, 0.2)
    shown = demonstrate_to_the_end(oracle, [0], np.random.default_rng(0))
    learnt = learn("goal_posterior", problem, shown, rng=np.random.default_rng(0))
    assert judged(problem, oracle, learnt.q, shown)[1] == 1.0
    assert learnt.reward.argmax() == 60
    assert learnt.converged
    np.testing.assert_array_equal(np.isfinite(learnt.q), problem.model.mask)


def test_wrong_labels_are_taken_for_what_they_are():
    problem, oracle = room(ROW * N + COLUMN == 60, 0.0)
    careless = replace(oracle, label_noise=0.3)
    rng = np.random.default_rng(1)
    shown = demonstrate_to_the_end(careless, rng.choice(N * N, 6), rng)
    learnt = learn("goal_posterior", problem, shown, rng=rng)
    assert judged(problem, oracle, learnt.q, shown)[1] == 1.0


def test_it_refuses_to_be_sure_where_runs_end_elsewhere_than_its_plans():
    problem, oracle = room(np.isin(np.arange(N * N), [0, 80]), 0.0)
    learner = GoalLearner(problem, rng=np.random.default_rng(0), config=GoalConfig(rounds=2))
    runs = demonstrate_to_the_end(oracle, [20, 60], np.random.default_rng(0))
    learner.learn(runs)
    assert learner.ends_agree >= AGREE  # either of the two is among the proposals
    learner.belief.goals = [replace(g, member=g.member & (ROW < 1)) for g in learner.belief.goals]
    learner.learn(runs, rounds=0)
    assert learner.ends_agree < AGREE


def test_regions_are_named_by_what_their_states_have_in_common():
    found = regions(60, {"row": ROW, "column": COLUMN})
    assert {goal.name: int(goal.member.sum()) for goal in found} == {
        "state 60": 1,
        "row 6": N,
        "column 6": N,
    }
    both = propose(np.array([3, 60]), np.array([5]), {}, N * N)
    assert [g.name for g in both] == ["state 3", "state 60", "state 5", "state 3 or state 60"]


def test_an_answer_tells_most_where_hypotheses_differ():
    problem, oracle = room(ROW * N + COLUMN == 60, 0.2)
    learner = asked(problem, oracle, start=54, questions=0)
    gain = information_gain(learner.belief, np.arange(N * N))
    assert (gain > -1e-6).all()
    beyond_mud, at_goal = gain[N * 3 + 3], gain[60 + 1]
    assert beyond_mud > at_goal  # whether mud matters shows before it


def test_same_seed_same_belief():
    problem, oracle = room(COLUMN == 8, 0.2)
    a, b = (asked(problem, oracle, 0, 3) for _ in range(2))
    assert a.q.tobytes() == b.q.tobytes()
    assert a.question() == b.question()


def test_nothing_shown_is_refused():
    problem, _ = room(COLUMN == 8, 0.0)
    with pytest.raises(InputError, match="at least one"):
        GoalLearner(problem, rng=np.random.default_rng(0)).learn(Demonstrations.empty())


@pytest.mark.parametrize(
    ("field", "value", "told"),
    [
        ("costs", {"mud": np.zeros(3)}, "costs: 'mud'"),
        ("costs", {"mud": "much"}, "costs: 'mud'"),
        ("factors", {"row": ROW[:4]}, "factors: 'row'"),
        ("factors", {"row": ROW / 2}, "factors: 'row'"),
    ],
)
def test_costs_and_factors_that_fit_nothing_are_refused(field, value, told):
    problem, _ = room(COLUMN == 8, 0.0)
    with pytest.raises(InputError, match=told):
        replace(problem, **{field: value})


def test_every_size_in_the_range_is_within_a_fifth_of_one_that_is_tried():
    true = np.geomspace(0.01, 0.64, 500)
    nearest = np.abs(np.log(true[:, None] / SIZES[1:])).min(axis=1)
    assert nearest.max() < np.log(1.2)


@pytest.mark.parametrize("goal", [14, 35, 56, 70])
def test_as_long_as_the_goal_is_not_sure_it_goes_where_every_goal_is(goal, monkeypatch):
    """One action is not enough to tell a place from its colour, which others have too."""
    colour = np.random.default_rng(0).integers(0, 6, N * N)
    problem, oracle = room(np.arange(N * N) == goal, 0.0)
    problem = replace(problem, factors={"colour": colour})
    shown = demonstrate_to_the_end(oracle, [goal - 1], np.random.default_rng(0))
    learner = GoalLearner(problem, rng=np.random.default_rng(0), config=GoalConfig(rounds=1))
    learner.learn(shown)
    assert learner.predicted.success > 1.0 - SHORT
    assert np.flatnonzero(learner.arrived).tolist() == [goal]
    assert judged(problem, oracle, learner.q, shown)[1] == 1.0
    of_colour = replace(oracle, goal_states=np.flatnonzero(colour == colour[goal]))
    assert judged(problem, of_colour, learner.q, shown)[1] == 1.0

    monkeypatch.setattr("irl.posterior.learner.SURE", 0.0)  # mean values as they are
    learner.learn(shown, rounds=0)
    assert learner.predicted.success < 0.9
    assert judged(problem, oracle, learner.q, shown)[1] < 0.9


def test_one_whose_goal_is_sure_acts_by_its_mean_values():
    problem, oracle = room(ROW * N + COLUMN == 60, 0.2)
    learner = asked(problem, oracle, start=0, questions=8)
    assert learner.predicted.success >= SURE
    np.testing.assert_array_equal(learner.q, action_values(learner.belief))


def test_what_is_taken_for_a_goal_is_tried_where_it_is_least_like_what_was_shown():
    factors = {"row": ROW, "column": COLUMN}
    goals = propose(np.array([60]), np.zeros(0, dtype=np.int64), factors, N * N)
    end, everywhere = np.array([60]), np.arange(N * N)
    right = COLUMN[60] == COLUMN
    asked = beyond(goals, end, right, everywhere)
    assert right[asked]
    assert asked != 60
    # It, too, ended a run: nothing but the column holds both.
    goals += propose(np.array([60, asked]), np.zeros(0, dtype=np.int64), factors, N * N)
    assert beyond(goals, np.array([60, asked]), right, everywhere) is None
    assert beyond(goals, end, everywhere == 60, everywhere) is None
    assert beyond(goals, end, right, np.flatnonzero(~right)) is None
    assert beyond([], end, right, everywhere) is None


def test_a_region_is_not_claimed_before_it_was_tried():
    problem, oracle = room(ROW * N + COLUMN == 60, 0.0)
    shown = demonstrate_to_the_end(oracle, [0], np.random.default_rng(0))
    learner = GoalLearner(problem, rng=np.random.default_rng(0), config=GoalConfig(rounds=0))
    learner.learn(shown)
    belief, rule = learner.belief, EnoughRule()
    region = next(k for k, goal in enumerate(belief.goals) if goal.name == f"column {COLUMN[60]}")
    belief.log_likelihood[belief.goal == region] += 50  # as if that were nearly sure
    assert learner.arrived.sum() == N
    assert learner.predicted.success > SURE
    assert claim(learner) == UNSURE
    state = rule.question(learner)
    assert learner.arrived[state]
    assert state != 60
    learner.skipped = np.array([state])
    assert rule.question(learner) != state
    learner.skipped = np.flatnonzero(COLUMN[60] == COLUMN)
    assert learner.untried_goal is None  # what nobody may be asked about is not tried
    learner.skipped = np.zeros(0, dtype=np.int64)
    going_on = Demonstrations.from_pairs(
        [(state, oracle.label(state, np.random.default_rng(0)))], 9
    )
    rule.take(learner, going_on)
    assert np.flatnonzero(learner.arrived).tolist() == [60]
