import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from irl.domains.gridworld import GridWorld
from irl.errors import InputError
from irl.queries import (
    STATE_STRATEGIES,
    QueryContext,
    action_probabilities,
    candidate_states,
    diversified_entropy,
    entropy,
    margin,
    select_cluster,
    select_state,
    thesis_entropy,
    visitation_entropy,
)

WORLD = GridWorld(5, (2, 2))
CORNER, SIDE, INNER = 0, 2, 12


def context(q=None, demonstrated=(), candidates=None, starts=(0,), seed=0, beta=1.0):
    demonstrated = np.array(demonstrated, dtype=np.int64)
    q = np.zeros((25, 4)) if q is None else q
    return QueryContext(
        model=WORLD.model,
        q=np.where(WORLD.model.mask, q, -np.inf),
        features=WORLD.features,
        demonstrated=demonstrated,
        candidates=candidate_states(WORLD.model, demonstrated, candidates),
        beta=beta,
        start_states=np.array(starts),
        rng=np.random.default_rng(seed),
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


def test_thesis_entropy_counts_infeasible_actions_as_worth_0():
    q = np.full((25, 4), -50.0)
    scores = thesis_entropy(context(q))
    # Two feasible moves at a corner are drowned by the two infeasible ones.
    assert scores[CORNER] == pytest.approx(np.log(2))
    assert scores[SIDE] == pytest.approx(0, abs=1e-12)
    assert scores[INNER] == pytest.approx(np.log(4))


def test_margin_prefers_ties():
    q = np.zeros((25, 4))
    q[INNER] = [3, 0, 0, 0]
    scores = margin(context(q))
    assert scores[CORNER] == 0
    e = np.exp(3)
    assert scores[INNER] == pytest.approx((1 - e) / (e + 3))


def test_diversified_entropy_takes_the_farthest_of_the_uncertain():
    # All inner cells tie in the top tenth; the farthest of them from corner 0 is cell (3, 3).
    assert select_state("diversified_entropy", context(demonstrated=[0])) == WORLD.index(3, 3)
    scores = diversified_entropy(context())  # nothing demonstrated yet: all equally far
    assert np.isposinf(scores[INNER])


def test_visitation_entropy_asks_where_the_policy_goes():
    q = np.zeros((25, 4))
    q[:5, 0] = 30.0  # along the bottom row to the right, and to and fro at its end
    scores = visitation_entropy(context(q))
    assert scores[:5].sum() > scores[10:].max() > 0
    # With an even policy from the centre, all is symmetric in x and y.
    even = visitation_entropy(context(starts=[INNER])).reshape(5, 5)
    np.testing.assert_allclose(even, even.T)
    np.testing.assert_allclose(even, even[::-1, ::-1])


@pytest.mark.parametrize("strategy", STATE_STRATEGIES)
def test_every_strategy_asks_a_candidate_and_repeats_itself(strategy):
    allowed = np.array([3, 7, 8, 19])
    q = np.random.default_rng(1).normal(size=(25, 4))
    asked = {select_state(strategy, context(q, [7], allowed)) for _ in range(3)}
    assert len(asked) == 1
    assert asked <= {3, 8, 19}
    assert select_state(strategy, context(q, [7], np.array([7]))) is None


def test_states_without_actions_are_no_candidates(chain):
    assert candidate_states(chain, np.array([1])).tolist() == [0, 2]


def test_cluster_with_the_highest_mean_is_asked():
    clusters = {
        "corners": np.array([0, 4, 20, 24]),
        "inner": np.array([6, 7, 12]),
        "empty": np.zeros(0, dtype=int),
    }
    assert select_cluster("masked_entropy", context(), clusters) == "inner"
    assert select_cluster("masked_entropy", context(), clusters, {"inner"}) == "corners"
    assert select_cluster("masked_entropy", context(), clusters, {"inner", "corners"}) is None
    asked = {select_cluster("random", context(seed=s), clusters) for s in range(20)}
    assert asked == {"corners", "inner"}


def test_unknown_names_list_the_known():
    with pytest.raises(InputError, match=r"state_query.*margin"):
        select_state("entropy", context())
    with pytest.raises(InputError, match=r"cluster_query.*masked_entropy"):
        select_cluster("entropy", context(), {})
