import numpy as np
import pytest

from irl.advice import Advice
from irl.errors import InputError

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
    with pytest.raises(InputError, match=r"avoid.*mask, thesis"):
        advised().apply(Q, MASK, avoid="never")
