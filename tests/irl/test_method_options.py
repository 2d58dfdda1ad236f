"""Options of methods: settings within settings, and what no method can use."""

import numpy as np
import pytest

from irl.active import ActiveConfig
from irl.baselines.birl import SamplingConfig
from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.mdp import TransitionModel
from irl.methods import METHODS, learn
from irl.training_config import TrainingConfig

N = 5


@pytest.fixture
def fit():
    """Learn to go right in a corridor of five states."""
    to = np.clip(np.arange(N)[:, None] + [-1, 1], 0, N - 1)
    model = TransitionModel.from_dense(np.eye(N)[to])
    shown = Demonstrations.from_pairs([(0, 1), (1, 1), (2, 1), (3, 1)])

    def fit(name, **options):
        rng = np.random.default_rng(0)
        return learn(name, model, shown, np.eye(N), gamma=0.9, rng=rng, **options)

    return fit


@pytest.mark.parametrize(
    ("name", "option", "fields", "whole"),
    [
        (
            "birl",
            "sampling",
            {"chains": 2, "burn_in": 5, "samples": 4},
            SamplingConfig(chains=2, burn_in=5, samples=4),
        ),
        # Of fields that are not given the defaults hold, as where the settings come whole.
        ("fa_mlirl", "training", {"iterations": 7}, TrainingConfig(iterations=7)),
    ],
)
def test_settings_within_settings_may_come_as_a_dict(fit, name, option, fields, whole):
    by_name, as_one = fit(name, **{option: fields}), fit(name, **{option: whole})
    np.testing.assert_array_equal(by_name.q, as_one.q)
    assert by_name.iterations == as_one.iterations


def test_so_they_may_in_active_learning():
    config = ActiveConfig(initial={"iterations": 3})
    assert config.initial == TrainingConfig(iterations=3)
    with pytest.raises(InputError, match=r"^refine: iterations: must be ≥ 0, is -3$"):
        ActiveConfig(refine={"iterations": -3})


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("birl", {"sampling": {"chain": 2}}, "sampling: unknown name 'chain'; valid: beta, "),
        ("birl", {"sampling": {"chains": 0}}, "sampling: chains: must be ≥ 2 and ≤ 1000, is 0"),
        ("birl", {"sampling": 5}, "sampling: SamplingConfig wanted, or a dict of its fields"),
        ("birl", {"start": "x"}, "start: real numbers wanted"),
        ("birl", {"start": np.zeros(3)}, r"start: finite numbers \[4, 5\] wanted, got \[3\]"),
        ("fa_mlirl", {"training": "x"}, "training: TrainingConfig wanted, or a dict"),
        ("fa_mlirl", {"training": {"step": -1}}, "training: step: must be > 0"),
        ("fa_mlirl", {"hidden": 5}, "hidden: several numbers wanted, is 5"),
        ("fa_mlirl", {"hidden": ("a",)}, "hidden: a whole number wanted, is 'a'"),
        ("fa_mlirl", {"networks": 10**12}, "networks: must be ≥ 1 and ≤ 1000"),
        ("fa_mlirl", {"device": "gpu"}, "device: unknown name 'gpu'"),
        ("lp", {"r_max": 1e300}, "r_max: must be > 0 and ≤ 1e\\+09"),
        ("lp_advice", {"hardness": "x"}, "hardness: real numbers wanted"),
        ("lp_basis", {"basis": "x"}, "features: real numbers wanted"),
        ("lp_basis", {"basis": np.zeros((N, 0))}, r"features: finite values \[5, d\] wanted"),
        ("lp_basis", {"states": [0, 99]}, "states: must lie in 0…4, is 99 in row 1"),
        ("lp_basis", {"states": [0.5]}, "states: integers .* wanted"),
        ("lp_basis", {"elsewhere": np.zeros((2, 2))}, r"elsewhere: probabilities \[5, 2\] wanted"),
        ("linear_mlirl", {"beta": 1e308}, "beta: must be > 0 and ≤ 1e\\+09"),
        ("bellman_gradient", {"sharpness": 1e308}, "sharpness: must be > 0 and ≤ 1e\\+09"),
    ],
)
def test_what_is_none_of_an_option_is_refused_by_name(fit, name, options, words):
    with pytest.raises(InputError, match=f"^{words}"):
        fit(name, **options)


@pytest.mark.parametrize("name", METHODS)
def test_progress_that_cannot_be_told_is_refused_before_the_work(fit, name):
    with pytest.raises(InputError, match=r"^progress: a function wanted, got int"):
        fit(name, progress=5)


@pytest.mark.parametrize("name", ["lp", "lp_advice"])
@pytest.mark.parametrize("unit", [1e-9, 1e9])
def test_a_reward_in_any_unit_is_as_many_times_the_one_in_1(fit, name, unit):
    np.testing.assert_allclose(fit(name, r_max=unit).reward, unit * fit(name).reward, rtol=1e-9)
