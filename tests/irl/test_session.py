"""Algorithm 4.1 led from outside: the same labels, questions and policies as the loop's own."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from irl.active import ActiveConfig, active_fa_mlirl
from irl.demonstrations import Demonstrations
from irl.demonstrators import OracleDemonstrator
from irl.domains.gridworld import GridWorld
from irl.errors import InputError
from irl.experts import ClusterAdvice
from irl.lesson_events import (
    DONE,
    Advised,
    Answered,
    Edit,
    Excluded,
    Imported,
    Skipped,
    Undo,
)
from irl.lesson_taught import to_rows
from irl.policy import Policy
from irl.posterior.enough import EnoughRule
from irl.posterior.learner import GoalLearner
from irl.problem import LearningProblem
from irl.session import policy_hash
from irl.session_begin import begin_session
from irl.student import Order, Student, StudentConfig, Subject
from irl.teacher import Teacher

torch.set_num_threads(1)

WORLD = GridWorld(7, (3, 3))
X, Y = WORLD.cells.T
PROBLEM = LearningProblem(
    WORLD.model,
    WORLD.features.astype(np.float32),
    gamma=0.9,
    clusters={"left": np.flatnonzero(X < 3), "top": np.arange(42, 49)},
    factors={"x": X, "y": Y},
)
ORACLE = OracleDemonstrator(WORLD.model, np.array([WORLD.goal_state]), gamma=0.9)
SHORT = {
    "initial": {"iterations": 80, "step": 0.01, "beta": 70.0},
    "refine": {"iterations": 20, "step": 0.01, "beta": 70.0},
    "hidden": [16],
    "query_beta": 70.0,
}
SUBJECT = Subject(PROBLEM, "a task")
FIRST = Demonstrations.from_pairs(WORLD.trajectories("diagonal")[0])
METHODS = ("fa_mlirl", "goal_posterior", "planning", "behaviour_cloning")


def config(method: str) -> StudentConfig:
    return StudentConfig(method, queue=1, options=SHORT if method == "fa_mlirl" else {})


class OneByOne:
    """Says what to do in a state, and no more; remembers what it was asked."""

    def __init__(self):
        self.asked = []

    def label(self, state, rng):
        return int(np.flatnonzero(ORACLE.optimal_actions[state])[0])

    def trajectory(self, state, rng, max_steps=50):
        self.asked.append(state)
        return [] if ORACLE.terminal[state] else [(state, self.label(state, rng))]


def answered(session, state: int) -> Answered:
    action = DONE if ORACLE.terminal[state] else OneByOne().label(state, None)
    highest = max([99, *(e.trajectory for e in session.taught.answers.values())])
    return Answered(state, action, highest + 1, 0)


def test_a_session_led_from_outside_asks_and_learns_as_the_loop_does():
    teacher = OneByOne()
    settings = ActiveConfig(**SHORT, budget=8, cluster_query="none")
    result = active_fa_mlirl(
        PROBLEM, FIRST, Teacher(teacher), settings, rng=np.random.default_rng(4)
    )
    wanted = policy_hash(Policy.from_q(result.q, WORLD.model.mask, task_hash="a task"))

    session = begin_session(SUBJECT, replace(config("fa_mlirl"), seed=4), FIRST)
    session.refit()
    asked = []
    for _ in range(8):
        (question,) = session.propose(1)
        asked.append(question.state)
        session.apply([answered(session, question.state)])
        session.refit()
    assert asked == teacher.asked
    assert policy_hash(session.policy(task_hash="a task")) == wanted


def test_advice_counts_as_it_does_in_the_loop():
    class Adviser:
        def advise(self, cluster, states):
            return ClusterAdvice(frozenset({0}), frozenset({2}))

    settings = ActiveConfig(**SHORT, budget=2)
    teacher = Teacher(OneByOne(), Adviser())
    result = active_fa_mlirl(PROBLEM, FIRST, teacher, settings, rng=np.random.default_rng(4))
    session = begin_session(SUBJECT, replace(config("fa_mlirl"), seed=4), FIRST)
    session.refit()
    for _ in range(2):
        (question,) = session.propose(1)
        session.apply([answered(session, question.state)])
        session.apply([Advised(session.propose_cluster(), "", [0], [2])])
        session.refit()
    assert np.array_equal(session.q, result.q)


@pytest.mark.parametrize("method", METHODS)
def test_what_was_taken_back_leaves_no_trace_in_what_is_learnt_from(method):
    said = [
        Answered(8, 0, 100, 0),
        Advised("left ∩ top", "", [0], [2]),
        Answered(9, 1, 101, 0),
        Edit(3, {"action": 3}),
        Skipped(11),
        Undo(5),
        Answered(10, 1, 102, 0),
        Undo(7),
        Excluded(1, [[0, 0]]),
    ]
    left = [Answered(8, 0, 100, 0), Advised("left ∩ top", "", [0], [2]), Answered(9, 3, 101, 0)]
    long, short = (begin_session(SUBJECT, config(method), FIRST) for _ in range(2))
    for event in said:
        long.apply([event])
    short.apply(left)
    assert long.state.labels.pairs == short.state.labels.pairs
    assert long.state.asked == short.state.asked
    assert np.array_equal(long.state.advice.avoided, short.state.advice.avoided)
    assert sorted(long.known) == sorted(short.known)
    for session in (long, short):
        session.refit()
    assert policy_hash(long.policy()) == policy_hash(short.policy())
    assert "left ∩ top" in long.state.clusters


@pytest.mark.parametrize("method", METHODS)
def test_any_method_of_the_registry_learns_asks_and_is_sure_of_something(method):
    session = begin_session(SUBJECT, replace(config(method), queue=4), FIRST)
    with pytest.raises(InputError, match="nothing was learnt"):
        session.policy()
    session.refit()
    questions = session.propose(4)
    assert len({q.state for q in questions}) == 4
    assert not {q.state for q in questions} & set(FIRST.state.tolist())
    sure = session.sure(WORLD.model.acting)
    assert ((sure >= 0) & (sure <= 1 + 1e-9)).all()
    assert session.policy().algorithm == method
    assert not session.enough().enough and session.enough().reason
    assert session.enough().stands_in == (method != "goal_posterior")


@pytest.mark.parametrize("method", ["planning", "behaviour_cloning", "fa_mlirl"])
def test_it_says_how_often_it_comes_to_where_runs_ended(method):
    session = begin_session(SUBJECT, config(method), FIRST)
    session.refit()
    assert "reached" not in session.enough().figures  # nobody said that a run ended anywhere
    session.apply([Answered(WORLD.goal_state, DONE, 50, 0)])
    session.refit()
    action = session.policy().action
    chain = np.zeros((49, 49))
    for state in range(49):
        if state == WORLD.goal_state or action[state] < 0:
            chain[state, state] = 1.0
        else:
            pair = int(WORLD.model.pair_index(state, int(action[state])))
            chain[state] = WORLD.model.P[[pair]].toarray()[0]
    after = np.linalg.matrix_power(chain, 20)[:, WORLD.goal_state]
    wanted = after[PROBLEM.start_states].mean()
    assert session.enough().figures["reached"] == pytest.approx(wanted, abs=1e-12)


def test_a_state_put_aside_is_not_asked_about():
    for method in METHODS:
        first = begin_session(SUBJECT, config(method), FIRST)
        second = begin_session(SUBJECT, config(method), FIRST)
        first.refit()
        (question,) = first.propose(1)
        second.apply([Skipped(question.state)])
        second.refit()
        assert question.state not in [q.state for q in second.propose(40)]


def test_the_posterior_is_led_as_its_own_rule_leads_it():
    learner, rule = GoalLearner(PROBLEM, rng=np.random.default_rng(0)), EnoughRule()
    session = begin_session(SUBJECT, config("goal_posterior"), FIRST)
    learner.learn(FIRST)
    session.refit()
    for k in range(25):
        over = rule(learner)
        assert session.enough().enough == over
        if over:
            break
        state, (question,) = rule.question(learner), session.propose(1)
        assert question.state == state
        action = DONE if ORACLE.terminal[state] else OneByOne().label(state, None)
        proposed = rule.proposal(learner, state)
        if proposed is not None and ORACLE.optimal_actions[state, proposed]:
            action = proposed
        end = state if action == DONE else None
        pairs = [] if action == DONE else [(state, action)]
        rule.take(learner, Demonstrations.from_pairs(pairs, 100 + k, "human", end))
        session.apply(
            [Answered(state, action, 100 + k, 0, question.proposed, purpose=question.purpose)]
        )
        session.refit()
        assert np.array_equal(session.q, learner.q)
    assert over and len(session.learner.audit.passed) >= 12


def test_a_test_that_was_taken_back_begins_again():
    session = begin_session(SUBJECT, config("goal_posterior"), FIRST)
    session.apply([Answered(17, 1, 100, 0), Answered(WORLD.goal_state, DONE, 100, 1)])
    number = 2
    for _ in range(30):
        session.refit()
        (question,) = session.propose(1)
        number += 1
        session.apply(
            [
                Answered(
                    question.state,
                    question.proposed,
                    100 + number,
                    0,
                    question.proposed,
                    purpose=question.purpose,
                )
            ]
        )
        if question.purpose == "audit":
            break
    session.refit()
    assert len(session.learner.audit.passed) == 1
    session.apply([Undo(number)])
    session.refit()
    assert not session.learner.audit.passed
    given = [*session.learner.shown.state.tolist(), *session.learner.held_out.state.tolist()]
    assert question.state not in given


def test_what_came_from_a_file_is_learnt_from():
    rows, ends = to_rows(FIRST)
    session = begin_session(SUBJECT, config("planning"), Demonstrations.empty())
    session.apply([Imported("d.csv", rows, ends, [["left", "", [0], [2]]], [])])
    other = begin_session(SUBJECT, config("planning"), FIRST)
    other.apply([Advised("left", "", [0], [2])])
    for each in (session, other):
        each.refit()
    assert policy_hash(session.policy()) == policy_hash(other.policy())


def test_rounds_give_the_same_however_the_events_come_in():
    events = [Answered(s, 0, 100 + s, 0) for s in range(0, 40, 7)]
    one = Student(SUBJECT, config("fa_mlirl"), FIRST)
    two = Student(SUBJECT, config("fa_mlirl"), FIRST)
    one.learn(Order(0, True, events[:2]))
    first = one.learn(Order(1, False, events))
    two.learn(Order(0, True, events[:2]))
    second = two.learn(Order(1, False, events))
    assert first.policy_hash == second.policy_hash and first.questions == second.questions
    anew = two.learn(Order(2, True, events))
    assert anew.policy_hash != first.policy_hash  # another beginning, another summit
    again = Student(SUBJECT, config("fa_mlirl"), FIRST).learn(Order(2, True, events))
    assert again.policy_hash == anew.policy_hash


def test_a_round_that_cannot_be_done_says_why():
    student = Student(SUBJECT, config("goal_posterior"), Demonstrations.empty())
    learnt = student.learn(Order(0, True, []))
    assert learnt.policy is None and "at least one pair" in learnt.error
    with pytest.raises(InputError, match="unknown name 'no'"):
        begin_session(SUBJECT, config("no"), FIRST)
    with pytest.raises(InputError, match="no rule"):
        begin_session(SUBJECT, replace(config("planning"), rules=("none",)), FIRST)


def test_what_it_takes_for_a_goal_it_asks_about_first():
    ended = Demonstrations.from_pairs(FIRST.pairs, 0, end=WORLD.goal_state)
    session = begin_session(SUBJECT, config("goal_posterior"), ended)
    session.refit()
    learner = session.learner
    belief, names = learner.belief, [goal.name for goal in learner.belief.goals]
    belief.log_likelihood[belief.goal == names.index("y 3")] += 50  # as if that were sure
    for name in ("_acting", "action", "predicted", "ends_agree"):
        vars(learner).pop(name, None)
    first, *others = session.propose(3)
    assert (first.strategy, first.proposed) == ("goal", DONE)
    assert Y[first.state] == 3
    assert first.state != WORLD.goal_state
    assert {q.strategy for q in others} == {"information"}
    assert len({first.state, *(q.state for q in others)}) == 3
    session.apply([Skipped(first.state)])
    (second,) = session.propose(1)
    assert second.state != first.state
