import numpy as np
import pytest

from irl.errors import InputError
from irl.mdp import TransitionModel

GOOD = {
    "state": np.array([1, 0, 0]),
    "action": np.array([0, 1, 1]),
    "next_state": np.array([1, 0, 1]),
    "probability": np.array([1.0, 0.25, 0.75]),
}


def test_rows_are_sorted_by_state_then_action_whatever_the_order():
    model = TransitionModel.from_entries(2, 2, **GOOD)
    assert model.pair_state.tolist() == [0, 1]
    assert model.pair_action.tolist() == [1, 0]
    np.testing.assert_array_equal(model.P.toarray(), [[0.25, 0.75], [0.0, 1.0]])
    np.testing.assert_array_equal(model.mask, [[False, True], [True, False]])
    assert model.first_pair.tolist() == [0, 1, 2]


def test_the_order_of_entries_makes_no_difference(random_model):
    whole = random_model(np.random.default_rng(5))
    entries = whole.P.tocoo()
    columns = whole.pair_state[entries.row], whole.pair_action[entries.row], entries.col
    for rng in (None, np.random.default_rng(0)):  # in order already, and shuffled
        order = np.arange(entries.nnz) if rng is None else rng.permutation(entries.nnz)
        again = TransitionModel.from_entries(
            30, 4, *(c[order] for c in columns), entries.data[order]
        )
        np.testing.assert_array_equal(again.pair_state, whole.pair_state)
        np.testing.assert_array_equal(again.pair_action, whole.pair_action)
        np.testing.assert_array_equal(again.P.toarray(), whole.P.toarray())
        assert again.P.has_canonical_format
        assert again.P.indices.dtype == np.int32


def test_the_model_does_not_share_its_probabilities_with_the_caller():
    p = np.ones(2)
    model = TransitionModel.from_entries(2, 1, np.arange(2), np.zeros(2, int), np.arange(2), p)
    p[:] = 0
    np.testing.assert_array_equal(model.P.toarray(), np.eye(2))


def test_entries_that_occur_twice_are_found_next_to_each_other_too():
    zero = np.zeros(2, dtype=int)
    with pytest.raises(InputError, match="occurs twice"):
        TransitionModel.from_entries(2, 2, zero, zero, zero, np.full(2, 0.5))


@pytest.mark.parametrize(
    ("field", "values", "words"),
    [
        ("state", [0, 0], "one length"),
        ("state", [0.0, 0.0, 1.0], "'state' must hold integers"),
        ("next_state", [0, 1, 2], "'next_state' must lie in 0…1"),
        ("action", [0, 1, -1], "'action' must lie in 0…1"),
        ("probability", [1.0, 0.5, np.nan], "'probability' must be finite"),
        ("probability", [1.0, 1.25, -0.25], "'probability' must be finite and above 0"),
        ("probability", [1.0, 0.25, 0.7], "state 0, action 1 is off by 0.05"),
        ("next_state", [1, 0, 0], "occurs twice"),
    ],
)
def test_bad_entries_are_named(field, values, words):
    with pytest.raises(InputError, match=words):
        TransitionModel.from_entries(2, 2, **(GOOD | {field: np.array(values)}))


def test_pair_index_finds_feasible_pairs_only(chain):
    rows = chain.pair_index(np.arange(4)[:, None], np.arange(2)[None, :])
    assert rows.tolist() == [[0, 1], [2, 3], [4, 5], [-1, -1]]
    assert chain.pair_index(np.array([0, 0]), np.array([-1, 2])).tolist() == [-1, -1]
    assert chain.actions_of(3).tolist() == []
    assert chain.actions_of(2).tolist() == [0, 1]


def test_q_values_are_expectations(chain):
    Q = chain.q_values(np.array([0.0, 1.0, 2.0, 3.0]))
    np.testing.assert_allclose(Q, [[0.0, 0.9], [0.0, 1.9], [1.0, 3.0], [-np.inf, -np.inf]])


def test_samples_follow_the_probabilities(chain):
    rng = np.random.default_rng(0)
    drawn = [chain.sample(0, 1, rng) for _ in range(2000)]
    assert set(drawn) == {0, 1}
    # Four standard errors of 2000 draws at 0.9.
    assert abs(np.mean(drawn) - 0.9) < 0.027


def test_sampling_an_infeasible_pair_names_the_feasible_actions(chain):
    with pytest.raises(InputError, match=r"action 2 .* state 1; valid: 0, 1"):
        chain.sample(1, 2, np.random.default_rng(0))


def test_reachable_follows_any_action(chain):
    assert chain.reachable(np.array([1])).tolist() == [True] * 4
    assert chain.reachable(np.array([3])).tolist() == [False, False, False, True]


def test_reachable_agrees_with_matrix_powers(random_model):
    model = random_model(np.random.default_rng(3), n_states=12, n_actions=2)
    step = np.eye(12, dtype=int)
    for s, row in zip(model.pair_state, model.P.toarray(), strict=True):
        step[s] |= row > 0
    closure = np.linalg.matrix_power(step.astype(object), 12) > 0
    for start in range(12):
        np.testing.assert_array_equal(model.reachable(np.array([start])), closure[start])


def test_a_model_without_pairs_is_possible():
    none = np.zeros(0, dtype=int)
    model = TransitionModel.from_entries(3, 2, none, none, none, np.zeros(0))
    assert model.n_pairs == 0
    assert model.pair_index(np.array([0, 1]), np.array([0, 1])).tolist() == [-1, -1]


def dense(model):
    """P[s, a, s'] of a sparse model, 0 where a pair is infeasible."""
    table = np.zeros((model.n_states, model.n_actions, model.n_states))
    table[model.pair_state, model.pair_action] = model.P.toarray()
    return table


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_dense_table_is_the_model_it_was_made_of(random_model, dtype):
    model = random_model(np.random.default_rng(3))
    again = TransitionModel.from_dense(dense(model).astype(dtype))
    np.testing.assert_array_equal(again.pair_state, model.pair_state)
    np.testing.assert_array_equal(again.pair_action, model.pair_action)
    np.testing.assert_array_equal(again.P.indices, model.P.indices)
    np.testing.assert_allclose(again.P.data, model.P.data, rtol=1e-6)
    np.testing.assert_allclose(again.P.sum(axis=1), 1.0, atol=1e-15)


def test_a_deterministic_table_may_be_of_integers():
    table = np.zeros((3, 2, 3), dtype=int)
    table[[0, 1], 0, [1, 2]] = 1  # state 2 has no action, and action 1 cannot be done
    model = TransitionModel.from_dense(table)
    assert model.mask.tolist() == [[True, False], [True, False], [False, False]]


def test_a_mask_leaves_pairs_out_whatever_their_rows_say(chain):
    table = dense(chain)
    mask = chain.mask.copy()
    mask[0, 1] = False
    table[0, 1] = 7e-7  # as some libraries fill what cannot be done
    assert TransitionModel.from_dense(table, mask).mask.tolist() == mask.tolist()


@pytest.mark.parametrize(
    ("change", "mask", "message"),
    [
        ((0, 1, 1, 0.8), None, r"P\[0, 1\] sums to 0\.9, not to 1 within 1e-06"),
        ((0, 1, 1, -0.1), None, r"P\[0, 1, 1\] is -0\.1, not a probability"),
        ((0, 1, 1, np.nan), None, r"P\[0, 1, 1\] is nan"),
        ((0, 1, 1, 0.9), np.ones((4, 2), bool), r"P\[3, 0\] sums to 0"),
        ((0, 1, 1, 0.9), np.ones((4, 2)), r"mask: bool \[4, 2\] wanted, got float64"),
    ],
)
def test_a_row_that_is_no_distribution_is_named(chain, change, mask, message):
    table = dense(chain)
    *place, value = change
    table[tuple(place)] = value
    with pytest.raises(InputError, match=message):
        TransitionModel.from_dense(table, mask)


@pytest.mark.parametrize("shape", [(4, 4), (4, 2, 3), (2, 4, 4)])
def test_a_table_of_another_order_is_refused(shape):
    with pytest.raises(InputError, match=r"P\[s, a, s'\] of shape"):
        TransitionModel.from_dense(np.zeros(shape))


@pytest.mark.parametrize("tolerance", [-1, np.nan, np.inf, 1.0])
def test_a_tolerance_that_says_nothing_is_refused(tolerance):
    with pytest.raises(InputError, match=r"tolerance: must be ≥ 0 and ≤ 0\.1"):
        TransitionModel.from_dense(np.eye(2)[:, None, :], tolerance=tolerance)


def test_a_table_with_a_mask_over_it_is_refused():
    table = np.ma.array(np.eye(2)[:, None, :], mask=np.eye(2)[:, None, :] > 0)
    with pytest.raises(InputError, match="transitions: 2 entries are masked"):
        TransitionModel.from_dense(table)


def test_pairs_that_lead_alike_have_one_distribution():
    """By action 0 from everywhere to state 2, by action 1 to a state of one's own."""
    P = np.zeros((3, 2, 3))
    P[:, 0, 2] = 1
    P[range(3), 1] = [[0.5, 0.5, 0], [0.25, 0.75, 0], [0.5, 0.5, 0]]
    model = TransitionModel.from_dense(P, P.sum(axis=2) > 0)
    first, kind = model.outcomes
    assert first.size == 3
    assert kind[[0, 2, 4]].tolist() == [kind[0]] * 3
    assert kind[1] == kind[5] != kind[3]
    np.testing.assert_array_equal(model.P[first][kind].toarray(), model.P.toarray())
