import numpy as np
import pytest

from irl.advice import Advice
from irl.errors import InputError
from irl.policy import Policy

INF = np.inf
Q = np.array([[0.5, -0.5, 0.1], [0.2, 0.3, -INF], [0.4, -INF, -INF]])
MASK = np.isfinite(Q)


def advised():
    return Advice.none(3, 3).add([0, 1, 2], preferred=[1], avoided=[0])


def test_hand_numbers():
    # Preferred: −0.5 + 0.1 and 0.3 + 0.06. State 2 has nothing but the avoided action.
    expected = [[-INF, -0.4, 0.1], [-INF, 0.36, -INF], [0.4, -INF, -INF]]
    np.testing.assert_allclose(advised().apply(Q, MASK), expected)


def test_thesis_constant():
    expected = [[-2, -0.4, 0.1], [-2, 0.36, -INF], [-2, -INF, -INF]]
    np.testing.assert_allclose(advised().apply(Q, MASK, avoid="thesis"), expected)


@pytest.mark.parametrize("avoid", ["mask", "thesis"])
def test_no_state_is_left_without_action_and_nothing_infeasible_returns(avoid):
    advice = Advice.none(3, 3).add([0, 1, 2], preferred=[], avoided=[0, 1, 2])
    out = advice.apply(np.where(MASK, Q, 7.0), MASK, avoid)
    assert np.isfinite(out).any(axis=1).all()
    assert (out[~MASK] == -INF).all()


def test_no_advice_changes_nothing_and_inputs_stay():
    q = Q.copy()
    np.testing.assert_array_equal(Advice.none(3, 3).apply(q, MASK), Q)
    advised().apply(q, MASK)
    np.testing.assert_array_equal(q, Q)


def test_the_later_answer_wins():
    first = advised()
    second = first.add([1], preferred=[0], avoided=[1])
    assert second.preferred.tolist() == [[0, 1, 0], [1, 0, 0], [0, 1, 0]]
    assert second.avoided.tolist() == [[1, 0, 0], [0, 1, 0], [1, 0, 0]]
    assert not (second.preferred & second.avoided).any()
    assert first.preferred[1].tolist() == [False, True, False]


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (([0], [1, 2], [2]), "action 2 is both"),
        (([3], [0], []), "states: must lie in 0…2"),
        (([0], [3], []), "preferred actions: must lie"),
        (([0], [], [-1]), "avoided actions: must lie"),
        (([0], [0.5], []), "integers"),
    ],
)
def test_bad_answers_are_named(answer, message):
    with pytest.raises(InputError, match=message):
        Advice.none(3, 3).add(*answer)


def test_unknown_mode_lists_the_known():
    with pytest.raises(InputError, match=r"avoid.*mask, doubt, thesis"):
        advised().apply(Q, MASK, avoid="never")


@pytest.mark.parametrize("avoid", ["mask", "thesis"])
@pytest.mark.parametrize("preferred", range(3))
def test_a_preferred_action_wins_ties(avoid, preferred):
    mask = np.ones((4, 3), dtype=bool)
    # Nothing to gain a share of, twice; level after the gain (0.5 + 0.1 = 0.6); and by far.
    q = np.array([[0.0, 0.0, 0.0], [5e-324] * 3, [0.6, 0.6, 0.6], [-7.0, -7.0, -7.0]])
    q[2, preferred] = 0.5
    advice = Advice.none(4, 3).add(range(4), preferred=[preferred], avoided=[])
    out = advice.apply(q, mask, avoid)
    assert out.argmax(axis=1).tolist() == [preferred] * 4
    assert Policy.from_q(out, mask).action.tolist() == [preferred] * 4
    np.testing.assert_allclose(out[2], 0.6, rtol=1e-15)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_an_avoided_action_is_never_the_best_whatever_the_scale(scale):
    q, mask = scale * np.array([[-3.0, -2.5, -4.0]]), np.ones((1, 3), dtype=bool)
    advice = Advice.none(1, 3).add([0], [], avoided=[1])
    for avoid in ("mask", "thesis"):
        out = advice.apply(q, mask, avoid)
        assert Policy.from_q(out, mask).action.tolist() == [0]
        np.testing.assert_array_equal(out[0, [0, 2]], q[0, [0, 2]])


def test_a_preference_does_not_revive_what_was_excluded():
    q, mask = np.array([[-INF, 0.5]]), np.ones((1, 2), dtype=bool)
    advice = Advice.none(1, 2).add([0], preferred=[0], avoided=[])
    np.testing.assert_array_equal(advice.apply(q, mask), q)
