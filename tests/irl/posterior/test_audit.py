"""Trials held out: does a learner notice that what it is shown has a reason without a name?"""

from dataclasses import replace
from itertools import count

import numpy as np
import pytest

from irl.collection import demonstrate_to_the_end
from irl.demonstrations import Demonstrations
from irl.demonstrators import OracleDemonstrator
from irl.domains.gridworld import GridWorld
from irl.errors import InputError
from irl.posterior.audit import LENGTHS, Audit
from irl.posterior.audit_states import audit_parts
from irl.posterior.enough import LEARNT, REACHES, UNTRIED, EnoughRule, claim
from irl.posterior.learner import GoalConfig, GoalLearner
from irl.posterior.predictions import votes
from irl.problem import LearningProblem

N = 9
ROW, COLUMN = np.divmod(np.arange(N * N), N)
MODEL = GridWorld(N, (0, 0)).model
MUD = MODEL.P @ ((ROW % 2 == 1) & (COLUMN > 0)).astype(float)
GOAL = np.array([60])
FIRST, SECOND, *_ = LENGTHS


def lesson(named, seed=0, most=30):
    """A lesson by the rule, about somebody who minds mud; the learner knows of mud if ``named``."""
    rng = np.random.default_rng(seed)
    oracle = OracleDemonstrator(
        MODEL,
        GOAL,
        gamma=0.95,
        action_cost=0.01 + 0.3 * MUD,
        tolerance=0.005,
    )
    problem = LearningProblem(MODEL, gamma=0.95, costs={"mud": MUD} if named else {})
    learner = GoalLearner(problem, rng=rng, config=GoalConfig(rounds=2))
    learner.learn(demonstrate_to_the_end(oracle, [8], rng))
    rule, asked = EnoughRule(), []
    for k in range(most):
        if rule(learner):
            break
        state = rule.question(learner)
        asked.append(state)
        done = oracle.terminal[state]
        proposed = rule.proposal(learner, state)
        will_do = proposed is not None and oracle.optimal_actions[state, proposed]
        pairs = [] if done else [(state, proposed if will_do else oracle.label(state, rng))]
        answer = Demonstrations.from_pairs(pairs, 10 + k, end=state if done else None)
        rule.take(learner, answer)
    return learner, oracle, asked


@pytest.mark.parametrize("seed", range(4))
def test_a_cost_with_a_name_is_learnt_and_one_without_is_not_claimed_to_be(seed):
    learner, oracle, asked = lesson(named=True, seed=seed)
    assert claim(learner) == LEARNT
    right = oracle.optimal_actions[np.arange(N * N), learner.q.argmax(axis=1)]
    assert right[~oracle.terminal].mean() >= 0.95
    assert len(asked) == len(set(asked)) < 30
    assert claim(lesson(named=False, seed=seed)[0]) == REACHES


def test_answers_are_learnt_from_only_when_the_audit_is_over():
    learner, _, _ = lesson(named=True, most=0)
    labels = len(learner.shown)
    before = learner.q.tobytes()
    for k in range(FIRST):
        assert learner.q.tobytes() == before
        assert claim(learner) != LEARNT
        assert len(learner.held_out) == k
        state = learner.audit_question()
        assert state not in learner.shown.state
        action = learner.proposal(state)
        assert learner.q[state, action] >= learner.q[state].max() - 0.0025
        learner.compare(Demonstrations.from_pairs([(state, action)], 20 + k))
    assert learner.audit.confirmed
    assert len(learner.shown) == labels + FIRST
    assert not len(learner.held_out)


def test_an_action_is_right_as_often_as_the_hypotheses_say():
    learner, _, _ = lesson(named=True, most=3)
    chosen, weight = learner.belief.likely()
    states = np.array([8, 0, 40])
    q = [MODEL.table(learner.belief.values_of(chosen[[k]])[:, 0]) for k in range(chosen.size)]
    for action in range(4):
        there = states[MODEL.mask[states, action]]
        short = np.array([table[there].max(axis=1) - table[there, action] for table in q])
        expected = weight @ (short <= 0.005)
        each = votes(learner.belief, there, np.full(there.size, action))
        np.testing.assert_allclose(each, expected)
    assert learner.proposal(60) is None


def test_what_is_proposed_is_drawn_from_what_seems_equally_good():
    learner, _, _ = lesson(named=False, most=0)
    best = learner.q.max(axis=1, keepdims=True) - 0.0025 <= learner.q
    proposed = {}
    while len(proposed) < 40:
        state = learner.audit_question()
        proposed[state] = learner.proposal(state)
    states = np.array([s for s in proposed if proposed[s] is not None])
    actions = np.array([proposed[s] for s in states])
    assert best[states, actions].all()
    several = best[states].sum(axis=1) > 1
    assert 0.2 < (actions != learner.action[states])[several].mean() < 0.8


def audited(*passed):
    audit = Audit()
    for state, given in enumerate(passed):
        for answer in given:
            audit.compare(state, answer)
    return audit


def test_what_was_corrected_is_asked_for_again():
    slip = audited(*[[True]] * (FIRST - 1), [False])
    assert slip.again == FIRST - 1
    assert not slip.confirmed
    slip.compare(FIRST - 1, True)
    assert slip.again is None
    assert slip.confirmed
    assert not slip.contradicted


def test_one_contradiction_is_enough_and_makes_the_next_audit_longer():
    failed = audited(*[[True]] * max(LENGTHS), [False, False])
    assert failed.contradicted
    assert not failed.confirmed
    learner, _, _ = lesson(named=True, most=0)
    state = learner.audit_question()
    wrong = next(a for a in MODEL.actions_of(state) if a != learner.proposal(state))
    answer = Demonstrations.from_pairs([(state, int(wrong))], 20)
    learner.compare(answer)
    proposed = learner.proposal(state)
    assert learner.audit_question() == state
    assert learner.proposal(state) == proposed
    labels = len(learner.shown)
    learner.compare(replace(answer, trajectory=answer.trajectory + 1))
    assert (learner.mistaken, learner.audit) == (1, Audit(SECOND))
    assert len(learner.shown) == labels + 2


def test_whoever_was_contradicted_more_often_is_tested_longer():
    lengths = [Audit.after(mistaken).wanted for mistaken in range(5)]
    assert lengths == sorted(lengths)
    assert lengths[0] == Audit().wanted == FIRST < lengths[1] < lengths[2] == lengths[-1]


def test_only_an_audit_that_confirms_makes_good_for_one_that_contradicted():
    learner, _, _ = lesson(named=True)
    assert claim(learner) == LEARNT
    learner.audit = Audit()
    assert claim(learner) == UNTRIED
    learner.mistaken = 1
    assert claim(learner) == REACHES
    learner.audit = audited(*[[True]] * FIRST)
    assert claim(learner) == LEARNT


def test_when_all_was_asked_there_is_no_question():
    learner, oracle, _ = lesson(named=True, most=0)
    rng, acting = np.random.default_rng(0), np.setdiff1d(np.arange(N * N), GOAL)
    pairs = [(int(s), oracle.label(int(s), rng)) for s in acting]
    each = [Demonstrations.from_pairs([pair], 30 + k) for k, pair in enumerate(pairs)]
    ended = Demonstrations.from_pairs([], 20, end=int(GOAL[0]))
    learner.learn(Demonstrations.concatenate([*each, ended]), rounds=0)
    for ask in (learner.question, learner.audit_question):
        with pytest.raises(InputError, match="candidates: every state"):
            ask()


@pytest.mark.parametrize("seed", range(5))
def test_an_audit_comes_to_every_kind_of_action(seed):
    """Half of what it would do is wrong: twelve states by chance alone might not come to it."""
    learner, _, _ = lesson(named=True, most=0, seed=seed)
    ends = learner.shown.ends[:, 2]
    states = np.setdiff1d(learner.candidates, [*learner.shown.state, *ends])
    part = audit_parts(learner.problem, states, learner.action[states], ends, FIRST)
    asked = []
    for k in range(FIRST):
        state = learner.audit_question()
        asked.append(state)
        action = learner.proposal(state)
        pairs, end = ([], state) if action is None else ([(state, action)], None)
        learner.compare(Demonstrations.from_pairs(pairs, 20 + k, end=end))
    assert sorted(part[np.isin(states, asked)]) == list(range(FIRST))


@pytest.mark.parametrize("seed", range(6))
def test_who_takes_too_little_for_the_goal_is_contradicted_just_beside_it(seed):
    """The demonstrator lets everything pass but in a column of 25, for which there is no factor."""
    n = 25
    row, column = np.divmod(np.arange(n * n), n)
    model, wanted = GridWorld(n, (0, 0)).model, column == 6
    rng = np.random.default_rng(seed)
    oracle = OracleDemonstrator(model, np.flatnonzero(wanted), gamma=0.95, tolerance=0.005)
    features = np.column_stack([row, column]) / n
    problem = LearningProblem(model, features, gamma=0.95, factors={"row": row})
    learner = GoalLearner(problem, rng=rng, config=GoalConfig(rounds=1))
    learner.learn(demonstrate_to_the_end(oracle, [8], rng))
    numbers = count(20)
    while not (learner.audit.confirmed or learner.mistaken):
        state, run = learner.audit_question(), next(numbers)
        proposed = None if wanted[state] else learner.proposal(state)
        pairs = [] if proposed is None else [(state, proposed)]
        end = state if proposed is None else None
        learner.compare(Demonstrations.from_pairs(pairs, run, end=end))
    assert learner.mistaken == 1
    assert (learner.shown.ends[:, 2] % n == 6).all()
