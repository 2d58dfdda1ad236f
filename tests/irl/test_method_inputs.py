import numpy as np
import pytest

from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.method_inputs import (
    inverse_temperature,
    labelled_policy,
    walk_ends,
    walks,
)


def test_gaps_part_walks():
    pieces = Demonstrations.concatenate(
        [
            Demonstrations.from_pairs([(0, 1), (1, 1), (2, 1), (3, 0)], trajectory=4),
            Demonstrations.from_pairs([(2, 0)], trajectory=4, source="generalised"),
            Demonstrations.from_pairs([(0, 0)], trajectory=1),
        ]
    )
    kept = pieces.select(np.array([3, 0, 1, 4, 5]))  # step 2 is missing
    found = walks(kept)
    assert found.state.tolist() == [0, 0, 1, 3]
    assert found.trajectory.tolist() == [0, 1, 1, 2]
    assert len(walks(Demonstrations.empty())) == 0


def test_unlabelled_states_end_a_run(chain):
    policy = labelled_policy(chain, Demonstrations.from_labels([(0, 1), (2, 0), (0, 0)]))
    assert policy.tolist() == [1, -1, 0, -1]


def test_inverse_temperature_grows_with_the_longest_walk():
    one = Demonstrations.from_pairs([(0, 1)])
    assert inverse_temperature(one) == 30.0
    long = Demonstrations.from_pairs([(s, 1) for s in range(12)], trajectory=1)
    assert inverse_temperature(Demonstrations.concatenate([one, long])) == 120.0


def test_missing_inputs_are_named(chain):
    with pytest.raises(InputError, match="at least one"):
        labelled_policy(chain, Demonstrations.empty())
    with pytest.raises(InputError, match="not feasible"):
        labelled_policy(chain, Demonstrations.from_pairs([(3, 0)]))


def test_walks_end_where_their_last_move_leads(chain):
    runs = [[(0, 1), (1, 1)], [(0, 1), (1, 1)], [(1, 0)]]
    shown = walks(Demonstrations.from_trajectories(runs))
    after = [int(chain.P[chain.pair_index(*pair)].toarray().argmax()) for pair in ((1, 1), (1, 0))]
    assert walk_ends(chain, shown).tolist() == after
    assert walk_ends(chain, walks(Demonstrations.empty())).size == 0
