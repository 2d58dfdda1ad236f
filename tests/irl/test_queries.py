from dataclasses import dataclass, replace

import numpy as np
import pytest

from irl.cluster_queries import CLUSTER_STRATEGIES, select_cluster, select_part
from irl.domains.gridworld import GridWorld
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.queries import (
    COMMITTEE_STRATEGIES,
    STATE_STRATEGIES,
    QueryContext,
    candidate_states,
    diversified_entropy,
    information_value,
    margin,
    select_states,
    thesis_entropy,
    visitation_entropy,
)
from irl.uncertainty import entropy

WORLD = GridWorld(5, (2, 2))
CORNER, SIDE, INNER = 0, 2, 12


def context(
    q=None, demonstrated=(), candidates=None, starts=(0,), seed=0, beta=1.0, spread=1.0, world=WORLD
):
    """What is known; the committee's members lie around ``q`` at random, ``spread`` away."""
    demonstrated = np.array(demonstrated, dtype=np.int64)
    shape = world.model.mask.shape
    q = np.zeros(shape) if q is None else q
    members = q + spread * np.random.default_rng(9).normal(size=(3, *shape))
    return QueryContext(
        model=world.model,
        q=np.where(world.model.mask, q, -np.inf),
        features=world.features,
        demonstrated=demonstrated,
        candidates=candidate_states(world.model, demonstrated, candidates),
        beta=beta,
        start_states=np.array(starts),
        rng=np.random.default_rng(seed),
        committee_q=np.where(world.model.mask, members, -np.inf),
    )


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
    assert select_states("diversified_entropy", context(demonstrated=[0])) == [WORLD.index(3, 3)]
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
    asked = {int(select_states(strategy, context(q, [7], allowed))[0]) for _ in range(3)}
    assert len(asked) == 1
    assert asked <= {3, 8, 19}
    assert select_states(strategy, context(q, [7], np.array([7]))).size == 0


@dataclass
class Line:
    """The chain, whose last state has nothing to do; by default left is infeasible too."""

    model: TransitionModel
    features: np.ndarray


@pytest.mark.parametrize("strategy", STATE_STRATEGIES)
def test_single_actions_and_states_without_any_do_no_harm(strategy, chain):
    forced = TransitionModel.from_entries(
        4, 2, np.array([0, 1, 2, 2]), np.array([1, 0, 0, 1]), np.array([1, 2, 3, 0]), np.ones(4)
    )
    for model in (chain, forced):
        asked = context(world=Line(model, np.eye(4)), beta=30.0)
        with np.errstate(all="raise"):
            assert set(select_states(strategy, asked, 9).tolist()) == {0, 1, 2}
    one_action = TransitionModel.from_entries(
        2, 1, np.array([0, 1]), np.zeros(2, int), np.array([1, 0]), np.ones(2)
    )
    assert select_states(strategy, context(world=Line(one_action, np.zeros((2, 1))))) in (0, 1)


@pytest.mark.parametrize("strategy", STATE_STRATEGIES)
@pytest.mark.parametrize("count", [1, 2, 7, 19, 100])
def test_a_batch_begins_with_the_single_query_and_asks_no_state_twice(strategy, count):
    q = np.random.default_rng(1).normal(size=(25, 4))
    known = [0, 1, 2, 3, 4, 5]
    batch = select_states(strategy, context(q, known), count).tolist()
    assert batch[:1] == select_states(strategy, context(q, known)).tolist()
    assert len(batch) == len(set(batch)) == min(count, 19)
    assert not set(batch) & set(known)
    assert batch == select_states(strategy, context(q, known), count).tolist()


def test_a_batch_is_spread_over_the_best():
    world = GridWorld(21, (10, 10))
    q = np.tile([15.0, 10.0, 5.0, 0.0], (441, 1))
    doubtful = np.flatnonzero((world.cells[:, 0] > 12) & (world.cells[:, 1] > 12))
    q[doubtful] = 0.0
    batch = select_states("margin", context(q, world=world), 5)
    assert np.isin(batch, doubtful).all()  # 64 states tie, and fill the best 50
    apart = np.linalg.norm(world.cells[batch][:, None] - world.cells[batch], axis=2)
    drawn = np.random.default_rng(0).choice(doubtful, (200, 5))
    typical = np.median([np.linalg.norm(world.cells[d][0] - world.cells[d][1]) for d in drawn])
    assert apart[~np.eye(5, dtype=bool)].min() >= typical / 2 > 0
    # 20 of the best 200 crowd out nothing when there are only 20 candidates at all.
    assert select_states("margin", context(q, candidates=doubtful[:5], world=world), 20).size == 5


def test_half_of_a_batch_is_asked_where_the_policy_goes_and_half_apart():
    q = np.random.default_rng(1).normal(size=(25, 4))
    known = context(q, [7])
    for asked, count, visited in ((0, 6, 3), (0, 5, 3), (3, 5, 2), (0, 1, 1), (1, 1, 0)):
        batch = select_states("visited_and_diverse", replace(known, asked=asked), count).tolist()
        assert len(batch) == count
        on_the_way = select_states("visitation_entropy", context(q, [7]), max(visited, 1)).tolist()
        assert batch[:visited] == on_the_way[:visited]


def test_visits_stop_where_demonstrators_ended():
    q = np.tile([5.0, 0.0, 0.0, 0.0], (25, 1))
    on = visitation_entropy(context(q, beta=1.0)).reshape(5, 5)
    end = int(np.argsort(visitation_entropy(context(q)))[-2])
    stopped = visitation_entropy(replace(context(q), ends=np.array([CORNER]))).reshape(5, 5)
    assert (on.ravel() > 1e-4).sum() > 1
    assert np.flatnonzero(stopped.ravel() > 1e-4).tolist() == [CORNER]
    assert end != CORNER


def test_random_batches_are_uniform():
    counts = np.zeros(25)
    for seed in range(600):
        counts[select_states("random", context(seed=seed), 5)] += 1
    # Each state: 120 times, standard deviation 9.8.
    assert np.abs(counts - 120).max() < 5 * 9.8


def test_committee_strategies_need_a_committee_and_ignore_one_that_agrees():
    for strategy in COMMITTEE_STRATEGIES:
        with pytest.raises(InputError, match=f"{strategy}.*committee"):
            select_states(strategy, replace(context(), committee_q=None))
        scores = STATE_STRATEGIES[strategy](context(spread=0.0))
        assert scores[np.isfinite(scores)] == pytest.approx(0.0, abs=1e-12)
    assert STATE_STRATEGIES.keys() > COMMITTEE_STRATEGIES
    for strategy in STATE_STRATEGIES.keys() - COMMITTEE_STRATEGIES:
        assert select_states(strategy, replace(context(), committee_q=None)).size == 1


def test_value_of_information_asks_what_settles_decisions_on_the_way():
    """Two members agree but for states A and B; doubt about B goes with the fork's decision."""
    q = np.zeros((25, 4))
    q[:, 0] = 4.0
    asked = context(q, starts=[INNER], spread=0.0, beta=1.0)
    members = np.stack([asked.committee_q[0], asked.committee_q[0], *[asked.committee_q[0]] * 2])
    # Members 0, 1 | 2, 3 differ at B (8) and the fork (12); 0, 2 | 1, 3 at A (16) alone, where
    # an answer tells as much about the member, and no decision depends on it.
    members[:2, 8, 1] = members[:2, INNER, 1] = 8.0
    members[::2, 16, 1] = 8.0
    asked = replace(asked, committee_q=members, candidates=np.array([8, 16]))
    information = STATE_STRATEGIES["bald"](asked)
    assert information[8] == pytest.approx(information[16])
    # Nobody comes near A.
    asked = replace(asked, q=np.where(np.arange(4) == 1, 50.0, asked.q))
    scores = information_value(asked)
    assert scores[8] > 100 * scores[16] >= 0


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
    split = context(spread=0.0)
    split.committee_q[1, 0, 0] = 3.0
    assert select_cluster("bald", split, clusters) == "corners"


@pytest.mark.parametrize("strategy", CLUSTER_STRATEGIES)
def test_every_cluster_strategy_ends_with_none(strategy):
    assert select_cluster(strategy, context(), {"a": np.arange(3)}) == "a"
    assert select_cluster(strategy, context(), {"a": np.arange(3)}, {"a"}) is None
    assert select_cluster(strategy, context(), {}) is None


def test_unknown_names_list_the_known():
    with pytest.raises(InputError, match=r"state_query.*margin"):
        select_states("entropy", context())
    with pytest.raises(InputError, match=r"cluster_query.*masked_entropy"):
        select_cluster("entropy", context(), {})
    with pytest.raises(InputError, match=r"batch.*≥ 1"):
        select_states("margin", context(), 0)


def test_the_part_of_highest_mean_uncertainty_is_asked_about():
    partition = np.array([0, 0, 1, 2, 2, -1])
    uncertainty = np.array([1.0, 0.0, 0.6, 0.9, 0.3, 9.0])
    rng, none = np.random.default_rng(0), np.zeros(0, dtype=int)
    found = {select_part(partition, none, uncertainty, rng) for _ in range(50)}
    assert found == {1, 2}  # equal means, drawn evenly; the state outside does not count
    assert select_part(partition, np.array([1, 2]), uncertainty, rng) == 0
    assert select_part(partition, np.array([0, 1, 2]), uncertainty, rng) is None
    assert {select_part(partition, none, None, rng) for _ in range(50)} == {0, 1, 2}


def test_of_single_states_the_part_is_the_state_that_entropy_asks_about():
    q = np.random.default_rng(1).normal(size=(25, 4))
    at = context(q, [7])
    partition = np.where(np.isin(np.arange(25), at.candidates), np.arange(25), -1)
    state = select_part(partition, np.zeros(0, dtype=int), entropy(at.q), np.random.default_rng(0))
    assert [state] == select_states("masked_entropy", at).tolist()
