from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irl.clusters import found, intersection, with_intersections
from irl.demonstrators import OracleDemonstrator
from irl.domains.gridworld import DOWN, LEFT, RIGHT, UP, GridWorld
from irl.errors import InputError
from irl.experts import OracleExpert

CLUSTERS = {"a": np.array([0, 1, 2, 3]), "b": np.array([5, 3, 2]), "c": np.array([3, 2, 9])}
MANY = st.lists(st.sets(st.integers(0, 7)), max_size=5).map(
    lambda sets: {f"c{k}": np.array(sorted(s), dtype=np.int64) for k, s in enumerate(sets)}
)


@given(clusters=MANY, depth=st.integers(0, 3), smallest=st.integers(1, 4))
def test_closure_holds_every_distinct_intersection_once(clusters, depth, smallest):
    found = with_intersections(clusters, depth, smallest)
    given_sets = {frozenset(states.tolist()) for states in clusters.values()}
    new = [frozenset(found[name].tolist()) for name in found if name not in clusters]
    by_hand = {
        frozenset.intersection(*(frozenset(clusters[name].tolist()) for name in names))
        for size in range(2, depth + 2)
        for names in combinations(clusters, size)
    }
    assert len(set(new)) == len(new)
    assert set(new) == {s for s in by_hand if len(s) >= smallest} - given_sets
    assert list(found)[: len(clusters)] == list(clusters)
    assert all(found[name] is clusters[name] for name in clusters)
    for name, states in found.items():
        assert np.array_equal(np.unique(states), intersection(clusters, name))
        assert name.count("∩") <= depth


def test_names_and_sizes():
    assert list(with_intersections(CLUSTERS, 0)) == ["a", "b", "c"]
    found = with_intersections(CLUSTERS, 1)
    # a ∩ c and b ∩ c hold the same states as a ∩ b.
    assert list(found) == ["a", "b", "c", "a ∩ b"]
    assert found["a ∩ b"].tolist() == [2, 3]
    assert list(with_intersections(CLUSTERS, 5, smallest=3)) == ["a", "b", "c"]
    assert with_intersections({}, 2) == {}


def test_an_intersection_is_symmetric_and_idempotent():
    assert intersection(CLUSTERS, "b ∩ a").tolist() == intersection(CLUSTERS, "a ∩ b").tolist()
    assert intersection(CLUSTERS, "b ∩ b").tolist() == [2, 3, 5]
    assert intersection(CLUSTERS, "b").tolist() == [2, 3, 5]


def test_bad_input_is_named():
    with pytest.raises(InputError, match=r"cluster.*'d'.*a, b, c"):
        intersection(CLUSTERS, "a ∩ d")
    with pytest.raises(InputError, match="depth"):
        with_intersections(CLUSTERS, -1)
    with pytest.raises(InputError, match="smallest"):
        with_intersections(CLUSTERS, 1, 0)


def test_the_oracle_knows_more_of_an_intersection_than_of_its_parts():
    world = GridWorld(7, (3, 3))
    expert = OracleExpert(OracleDemonstrator(world.model, np.array([24])), np.arange(49))
    x, y = world.cells.T
    clusters = with_intersections(
        {"left": np.flatnonzero(x < 3), "low": np.flatnonzero(y < 3)}, depth=1
    )
    both = expert.advise("left ∩ low", clusters["left ∩ low"])
    assert both.preferred == {RIGHT, UP}
    assert both.avoided == {LEFT, DOWN}
    assert expert.advise("left", clusters["left"]).preferred == {RIGHT}


def test_clusters_are_found_where_rows_lie_together():
    rng = np.random.default_rng(0)
    middle = np.array([[0.0, 0.0, 0.0], [50.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    rows = np.repeat(middle, 20, axis=0) + 0.01 * rng.standard_normal((60, 3)) * [1, 0.02, 0]
    rows[:, 2] = -np.inf
    clusters = found(rows, 3, rng)
    assert sorted(states.tolist() for states in clusters.values()) == [
        list(range(20 * k, 20 * k + 20)) for k in range(3)
    ]
    again = found(rows, 3, np.random.default_rng(5))
    same = found(rows, 3, np.random.default_rng(5))
    assert all(np.array_equal(again[name], same[name]) for name in again)


def test_as_many_clusters_as_states_at_most():
    with pytest.raises(InputError, match="number"):
        found(np.zeros((3, 2)), 4, np.random.default_rng(0))
