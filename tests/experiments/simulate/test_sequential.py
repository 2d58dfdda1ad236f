"""The sequential test: its evidence by quadrature, its mistakes by simulation."""

import numpy as np
import pytest
from scipy.integrate import quad

from experiments.simulate.sequential import Duel, log_evidence


@pytest.mark.parametrize(("wins", "losses"), [(0, 0), (1, 0), (0, 1), (5, 2), (3, 9), (40, 12)])
def test_evidence_is_the_mean_stake_over_all_shares(wins, losses):
    value, _ = quad(lambda p: 2 * (2 * p) ** wins * (2 - 2 * p) ** losses, 0.5, 1.0)
    assert np.exp(log_evidence(wins, losses)) == pytest.approx(value, rel=1e-6)


def test_sides_that_are_equal_are_seldom_told_apart_however_long_one_looks():
    rng = np.random.default_rng(0)
    wrong = 0
    for _ in range(400):
        duel = Duel()
        for winner in rng.choice([-1, 1], 300):
            duel = duel.after(int(winner))
        wrong += duel.confidence >= 0.95
    # 5 % at most, here with room for chance.
    assert wrong <= 30


def test_a_side_that_wins_is_found_soon_and_even_pairs_say_nothing():
    duel = Duel()
    for _ in range(20):
        duel = duel.after(0)
    assert (duel.confidence, duel.ahead, duel.even) == (0.0, 0, 20)
    count = 0
    while duel.confidence < 0.95:
        duel, count = duel.after(-1), count + 1
    assert duel.ahead == -1
    assert 6 <= count <= 10
