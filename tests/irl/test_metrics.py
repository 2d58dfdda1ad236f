import numpy as np
import pytest

from irl.demonstrators import OracleDemonstrator
from irl.errors import InputError
from irl.metrics import (
    Share,
    accuracy_on_unseen,
    accuracy_optimal,
    accuracy_strict,
    bootstrap_interval,
    success_mdp,
    unseen_states,
    wilson_interval,
)

OPTIMAL = np.array([[True, True], [False, True], [True, False], [False, False]])


def test_strict_accuracy_counts_the_demonstrated_action_only():
    share = accuracy_strict(np.array([1, 1, 1, -1]), np.array([0, 1, 2]), np.array([0, 1, 0]))
    assert (share.successes, share.trials) == (1, 3)


def test_optimal_accuracy_counts_every_co_optimal_action_and_never_minus_one():
    share = accuracy_optimal(np.array([1, 1, 1, -1]), np.arange(4), OPTIMAL)
    assert (share.successes, share.trials) == (2, 4)
    all_good = np.ones((4, 2), dtype=bool)
    assert accuracy_optimal(np.full(4, -1), np.arange(4), all_good).successes == 0


def test_share_without_trials_is_nan():
    assert np.isnan(Share(0, 0).value)
    assert Share(1, 4).value == 0.25


def test_wilson_interval_has_its_textbook_values():
    # Newcombe (1998), Table I, method 3: 81 of 263, 15 of 148, 0 of 20, 1 of 29.
    for successes, trials, low, high in (
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ):
        assert wilson_interval(successes, trials) == pytest.approx((low, high), abs=5e-5)
    assert wilson_interval(20, 20)[1] == 1.0
    assert Share(15, 148).interval == wilson_interval(15, 148)


@pytest.mark.parametrize(("successes", "trials"), [(1, 0), (0, 0), (3, 2), (-1, 2)])
def test_wilson_refuses_what_is_not_a_share(successes, trials):
    with pytest.raises(InputError, match="not a share"):
        wilson_interval(successes, trials)


def test_bootstrap_covers_the_mean_and_repeats_with_its_seed():
    values = np.random.default_rng(0).normal(3.0, 1.0, size=200)
    low, high = bootstrap_interval(values, np.random.default_rng(1))
    assert (low, high) == bootstrap_interval(values, np.random.default_rng(1))
    half = 1.96 * values.std() / np.sqrt(200)
    assert low == pytest.approx(values.mean() - half, abs=0.02)
    assert high == pytest.approx(values.mean() + half, abs=0.02)
    assert bootstrap_interval(np.full(5, 0.5), np.random.default_rng(0)) == (0.5, 0.5)


@pytest.mark.parametrize("values", [[], [np.nan], [[1.0]]])
def test_bootstrap_refuses_no_values(values):
    with pytest.raises(InputError, match="finite values"):
        bootstrap_interval(np.array(values), np.random.default_rng(0))


def test_unseen_states_are_reachable_unlabelled_and_alive(chain):
    ended = np.array([False, False, False, True])
    assert unseen_states(chain, np.array([0]), np.array([1]), ended).tolist() == [0, 2]
    nothing = np.zeros(0, dtype=int)
    assert unseen_states(chain, np.array([3]), nothing, ended).tolist() == []
    assert unseen_states(chain, np.array([0]), nothing, np.array([2])).tolist() == [0, 1]


def test_success_is_the_mean_over_starts(chain):
    policy = np.array([1, 1, 1, -1])
    value = success_mdp(chain, policy, np.array([3]), np.array([1, 2]), horizon=2)
    assert value == pytest.approx((0.9 + 1) / 2)
    assert success_mdp(chain, policy, np.array([3]), np.array([0])) > 0.999999
    with pytest.raises(InputError, match="start state"):
        success_mdp(chain, policy, np.array([3]), np.zeros(0, dtype=int))


def test_accuracy_on_unseen_states_is_that_over_the_states_it_names(chain):
    oracle = OracleDemonstrator(chain, np.array([3]))
    starts, right = np.array([0]), np.array([1, 1, 1, -1])
    wrong_in_0 = np.array([0, 1, 1, -1])
    assert accuracy_on_unseen(right, np.array([1]), oracle, starts) == Share(2, 2)
    assert accuracy_on_unseen(wrong_in_0, np.array([1]), oracle, starts) == Share(1, 2)
    assert accuracy_on_unseen(wrong_in_0, np.array([0]), oracle, starts) == Share(2, 2)
