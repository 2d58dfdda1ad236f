import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from irl.pairs import pair_key, split_key

pairs = st.lists(st.tuples(st.integers(0, 2**31 - 1), st.integers(0, 54)), min_size=1)


@given(pairs)
def test_a_key_gives_its_pair_back_and_sorts_as_pairs_do(some):
    state, action = np.array(sorted(some), dtype=np.int32).T
    key = pair_key(state, action, 55)
    assert key.dtype == np.int64
    assert (np.diff(key) >= 0).all()
    back = split_key(key, 55)
    assert (back[0] == state).all()
    assert (back[1] == action).all()


def test_shapes_broadcast_and_narrow_integers_do_not_overflow():
    key = pair_key(np.int32([[40_000_000], [1]]), np.arange(2, dtype=np.int8), 100)
    assert key.tolist() == [[4_000_000_000, 4_000_000_001], [100, 101]]
