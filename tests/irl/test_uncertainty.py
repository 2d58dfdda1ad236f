import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from irl.uncertainty import (
    action_probabilities,
    entropy,
    mutual_information,
    shannon_entropy,
    value_of_information,
    vote_entropy,
)

VALUES = arrays(np.float64, (4, 6, 5), elements=st.floats(-1, 1))
FEASIBLE = arrays(np.bool_, (6, 5)).map(
    lambda mask: mask | (np.arange(5) == mask.argmax(1)[:, None])
)


@given(
    q=arrays(np.float64, (6, 5), elements=st.floats(-1, 1)),
    feasible=arrays(np.bool_, (6, 5)),
    beta=st.floats(0.01, 1000),
)
def test_entropy_lies_between_0_and_the_log_of_the_feasible_actions(q, feasible, beta):
    masked = np.where(feasible, q, -np.inf)
    e = entropy(masked, beta)
    assert (e >= 0).all()
    assert (e <= np.log(np.maximum(feasible.sum(axis=1), 1)) + 1e-12).all()
    p = action_probabilities(masked, beta)
    np.testing.assert_allclose(p.sum(axis=1), feasible.any(axis=1))
    assert (p[~feasible] == 0).all()


def test_entropy_by_hand():
    q = np.array([[0, 0, -np.inf], [np.log(3), 0, -np.inf], [5, -np.inf, -np.inf]])
    by_hand = [np.log(2), -(0.75 * np.log(0.75) + 0.25 * np.log(0.25)), 0]
    np.testing.assert_allclose(entropy(q), by_hand)
    np.testing.assert_allclose(entropy(q, beta=1e9), [np.log(2), 0, 0], atol=1e-12)


@given(q=VALUES, feasible=FEASIBLE, beta=st.floats(0.01, 100))
def test_mutual_information_lies_between_0_and_both_entropies(q, feasible, beta):
    p = action_probabilities(np.where(feasible, q, -np.inf), beta)
    information = mutual_information(p)
    assert (information >= 0).all()
    assert (information <= shannon_entropy(p.mean(axis=0)) + 1e-12).all()
    assert (information <= np.log(4) + 1e-12).all()
    np.testing.assert_allclose(information, mutual_information(p[[2, 0, 3, 1]]), atol=1e-12)
    agreed = np.broadcast_to(p[:1], p.shape)
    np.testing.assert_allclose(mutual_information(agreed), 0, atol=1e-12)


@given(q=VALUES, beta=st.floats(0.01, 100))
def test_mutual_information_is_symmetric(q, beta):
    """The same from the action's side: entropy of the member, less what the action leaves."""
    joint = action_probabilities(q, beta) / len(q)
    marginal = joint.sum(axis=0)
    left = (marginal * shannon_entropy(np.moveaxis(joint / marginal, 0, -1))).sum(axis=-1)
    np.testing.assert_allclose(mutual_information(joint * len(q)), np.log(len(q)) - left, atol=1e-9)


def test_members_that_are_sure_of_different_actions_tell_everything():
    sure = np.eye(3)[:, None]
    assert mutual_information(sure) == pytest.approx(np.log(3))
    noise = np.full((3, 1, 3), 1 / 3)  # doubt that all share is not worth a question
    assert mutual_information(noise) == pytest.approx(0, abs=1e-15)


def test_votes_by_hand():
    q = np.zeros((4, 3, 2))
    q[:, 0, 1] = [1, -1, 2, -5]
    q[:, 1, 1] = [1, 1, 1, -1]
    q[:, 2] = -np.inf
    by_hand = [np.log(2), -(0.75 * np.log(0.75) + 0.25 * np.log(0.25)), 0]
    np.testing.assert_allclose(vote_entropy(q), by_hand)


WEIGHT = arrays(np.float64, 6, elements=st.floats(0, 1))


def value_by_bayes(p, q, weight):
    """Howard's definition, answer by answer, with the posterior written out."""
    _, n_candidates, n_actions = p.shape
    without = weight @ q.mean(axis=0).max(axis=1)
    gains = np.zeros(n_candidates)
    for c in range(n_candidates):
        for a in range(n_actions):
            chance = p[:, c, a].mean()
            if chance > 0:
                posterior = p[:, c, a] / p[:, c, a].sum()
                gains[c] += chance * (weight @ np.tensordot(posterior, q, 1).max(axis=1))
    return gains - without


@given(answers=VALUES, q=VALUES, feasible=FEASIBLE, weight=WEIGHT, beta=st.floats(0.01, 30))
def test_value_of_information_is_howards_and_never_negative(answers, q, feasible, weight, beta):
    p = action_probabilities(np.where(feasible, answers, -np.inf), beta)
    q = np.where(feasible, q, -np.inf)
    value = value_of_information(p, q, weight)
    assert (value >= 0).all()
    np.testing.assert_allclose(value, value_by_bayes(p, q, weight), atol=1e-9)
    # Knowing the member outright is worth at least as much as any answer.
    all_known = weight @ (q.max(axis=2).mean(axis=0) - q.mean(axis=0).max(axis=1))
    assert (value <= all_known + 1e-9).all()
    # A member's value of a state, apart from the action, is nobody's decision.
    shifted = q + np.arange(4)[:, None, None] * np.arange(6)[:, None]
    np.testing.assert_allclose(value_of_information(p, shifted, weight), value, atol=1e-9)


@given(q=VALUES, weight=WEIGHT)
def test_certain_answers_are_worth_nothing(q, weight):
    certain = np.zeros((4, 2, 5))
    certain[:, 0, 3] = certain[:, 1, 0] = 1.0
    np.testing.assert_allclose(value_of_information(certain, q, weight), 0, atol=1e-12)
    # Nor are any, where all would decide alike.
    q = np.where(np.arange(5) == 2, 3.0, q)
    p = action_probabilities(np.random.default_rng(0).normal(size=(4, 2, 5)), 5.0)
    np.testing.assert_allclose(value_of_information(p, q, weight), 0, atol=1e-12)


def test_value_of_information_by_hand():
    """Two members, sure of themselves: the answer tells which is right, and which way to go."""
    p = np.eye(2)[:, None]
    q = np.array([[[1.0, 0.0]], [[0.0, 1.0]]])
    assert value_of_information(p, q, np.array([3.0])) == pytest.approx(3 * (1 - 0.5))
