"""What is said of the learner's own proposals: neither labels nor nothing."""

from itertools import product

import numpy as np
import pytest

from irl.demonstrations import SOURCES, Demonstrations
from irl.domains.gridworld import GridWorld
from irl.posterior.evidence import ALIKE, BETAS, EPSILONS, Evidence
from irl.posterior.verdicts import Verdicts

N = 5
MODEL = GridWorld(N, (0, 0)).model
NO_GOAL = np.zeros((MODEL.n_states, 1), dtype=bool)
RUN = 7


def answered(state, action, run=RUN):
    return Demonstrations.from_pairs([(state, action)], run)


def said(q, shown, proposals, goals=NO_GOAL, costs=None):
    """``[betas, epsilons]`` of one hypothesis."""
    evidence = Evidence.of(MODEL, shown, costs, proposals)
    return evidence.log_likelihood(q[evidence.pairs, None], goals)[0]


def values(seed=0):
    """Action values with many ties."""
    return np.random.default_rng(seed).integers(0, 3, MODEL.n_pairs) * 0.02


@pytest.mark.parametrize("state", [6, 12, 24])
def test_a_proposal_is_let_pass_or_not(state):
    q = values()
    for proposed in MODEL.actions_of(state).tolist():
        passed = said(q, answered(state, proposed), {RUN: proposed})
        best = q[MODEL.pair_index(state, MODEL.actions_of(state))].max()
        short = best - q[MODEL.pair_index(state, proposed)]
        for (b, beta), (e, epsilon) in product(enumerate(BETAS), enumerate(EPSILONS)):
            good = 1.0 if short <= ALIKE else np.exp(-beta * short)
            wanted = (1 - epsilon) * good + epsilon / 2
            assert np.exp(passed[b, e]) == pytest.approx(wanted)
        # It is refused with the rest of the probability, and what is done instead is a label.
        other = next(a for a in MODEL.actions_of(state).tolist() if a != proposed)
        refused = said(q, answered(state, other), {RUN: proposed})
        label = said(q, answered(state, other), {})
        np.testing.assert_allclose(np.exp(refused - label) + np.exp(passed), 1.0)


def test_what_was_let_pass_is_no_preference_and_what_was_refused_is_no_equal():
    state = 12
    indifferent, choosy = np.zeros(MODEL.n_pairs), np.zeros(MODEL.n_pairs)
    first, second, *_ = MODEL.actions_of(state).tolist()
    choosy[MODEL.pair_index(state, first)] = 0.1
    sharp = (-1, 0)  # large β, small ε
    let_pass, refused = answered(state, first), answered(state, first)
    ratio = said(choosy, let_pass, {RUN: first}) - said(indifferent, let_pass, {RUN: first})
    assert ratio[sharp] == pytest.approx(0)  # as a label it would be log 4
    assert (said(choosy, let_pass, {}) - said(indifferent, let_pass, {}))[sharp] > 1
    ratio = said(choosy, refused, {RUN: second}) - said(indifferent, refused, {RUN: second})
    assert ratio[sharp] > 5


def test_nobody_goes_on_at_a_goal_where_runs_end():
    goals, state = NO_GOAL.copy(), 12
    goals[state] = True
    ended = Demonstrations.from_pairs([], 8, end=0)
    goals[0] = True
    action = int(MODEL.actions_of(state)[0])
    shown, q = Demonstrations.concatenate([answered(state, action), ended]), values()
    here = said(q, shown, {RUN: action}, goals)
    goals[state] = False
    elsewhere = said(q, shown, {RUN: action}, goals)
    np.testing.assert_allclose(elsewhere - here, -np.log(0.01))


def test_labels_and_verdicts_are_told_apart():
    follows = answered(3, 0)
    follows = Demonstrations(
        follows.trajectory,
        follows.step,
        follows.state,
        follows.action,
        np.full(1, SOURCES.index("generalised"), dtype=np.uint8),
    )
    shown = Demonstrations.concatenate(
        [answered(12, 1, 1), answered(12, 1, 2), answered(12, 2, 3), follows]
    )
    labels, verdicts = Verdicts.apart(shown, {2: 1, 3: 1, RUN: 0, 99: 0})
    assert labels.pairs == [(12, 1), (12, 2), (3, 0)]
    assert verdicts.state.tolist() == [12, 12]
    assert verdicts.action.tolist() == [1, 1]
    assert verdicts.passed.tolist() == [True, False]
    labels, verdicts = Verdicts.apart(shown, {})
    assert len(labels) == len(shown)
    assert not verdicts.state.size
