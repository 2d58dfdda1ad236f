import subprocess
import sys

import numpy as np
import pytest

from irl.demonstrations import Demonstrations
from irl.errors import InputError
from irl.evaluation import policy_value
from irl.kept_arrays import write_arrays
from irl.mdp import TransitionModel
from irl.methods import learn
from irl.outcomes import (
    REWARD_VERSION,
    LearntReward,
    SoftPolicy,
    load_reward,
    load_soft_policy,
    save_reward,
    save_soft_policy,
)
from irl.tensor_file import from_bytes, to_bytes

HASH = "ab" * 32
TOLD = {"task_hash": HASH, "algorithm": "planning", "seed": 3}
Q = np.array([[0.5, -1.0, 9.0], [-np.inf, 0.2, 0.1], [-np.inf, -np.inf, 1.0], [3.0, 3.0, 3.0]])
MASK = np.array([[1, 1, 0], [1, 1, 1], [1, 1, 0], [0, 0, 0]], dtype=bool)


def test_a_learnt_reward_is_planned_with_elsewhere_as_where_it_was_learnt(chain, tmp_path):
    shown = Demonstrations.from_pairs([(0, 1), (1, 1)])
    learnt = learn("planning", chain, shown, gamma=0.9, rng=np.random.default_rng(0))
    save_reward(LearntReward.of(learnt, gamma=0.9, **TOLD), tmp_path / "r")
    read = load_reward(tmp_path / "r", HASH)
    np.testing.assert_array_equal(read.reward, learnt.reward)
    np.testing.assert_array_equal(read.q(chain), learnt.q)
    assert (read.gamma, read.task_hash, read.algorithm, read.seed) == (0.9, HASH, "planning", 3)
    assert [path.name for path in tmp_path.iterdir()] == ["r"]


def test_a_reward_for_acting_is_kept_and_planned_with(tmp_path):
    rng = np.random.default_rng(0)
    P, r = rng.dirichlet(np.ones(4), size=(4, 2)), rng.normal(size=(4, 2))
    save_reward(LearntReward(r, 0.8), tmp_path / "r")
    q = load_reward(tmp_path / "r").q(TransitionModel.from_dense(P))
    # Bellman's equation, from the table itself.
    np.testing.assert_allclose(q, r + 0.8 * P @ q.max(axis=1), atol=1e-8)


def test_a_method_without_a_reward_has_none_to_keep(chain):
    shown = Demonstrations.from_pairs([(0, 1), (1, 1)])
    learnt = learn("behaviour_cloning", chain, shown, gamma=0.9, rng=np.random.default_rng(0))
    with pytest.raises(InputError, match="learns no reward"):
        LearntReward.of(learnt, gamma=0.9)


@pytest.mark.parametrize(
    ("reward", "gamma", "words"),
    [
        (np.zeros((2, 2, 2)), 0.9, "reward: finite numbers"),
        ([0, np.nan], 0.9, "reward: finite numbers"),
        ([0, 1], 1.0, "gamma: must be"),
    ],
)
def test_a_reward_that_cannot_be_is_refused(reward, gamma, words):
    with pytest.raises(InputError, match=words):
        LearntReward(np.asarray(reward), gamma)


def test_choices_by_chance_are_boltzmanns_over_what_can_be_done():
    for beta in (0.0, 1.0, 4.0, 1e6):
        found = SoftPolicy.from_q(Q, MASK, beta=beta).probability
        odds = np.exp(-min(beta * 1.5, 700))
        np.testing.assert_allclose(found[0], [1 / (1 + odds), odds / (1 + odds), 0], atol=1e-15)
        assert found[1, 0] == 0  # avoided
        assert found[1, 2] / found[1, 1] == pytest.approx(np.exp(-0.1 * min(beta, 7000)))
        assert found[2].tolist() == [0.5, 0.5, 0]  # all avoided
        assert not found[3].any()
    shifted = SoftPolicy.from_q(Q + 1e4, MASK).probability
    np.testing.assert_allclose(shifted, SoftPolicy.from_q(Q, MASK).probability, atol=1e-11)


@pytest.mark.parametrize(
    ("q", "mask", "beta", "words"),
    [
        (Q, MASK, -1.0, "beta: must be"),
        (Q, MASK, np.nan, "beta: must be"),
        (Q, MASK.T, 1.0, "of one shape wanted"),
        (Q, MASK.astype(int), 1.0, "a mask of one shape wanted, .* int64"),
        (np.where(MASK, np.nan, 0), MASK, 1.0, r"q\[0, 0\]: is nan for a feasible pair"),
        (np.where(MASK, np.inf, 0), MASK, 1.0, r"q\[0, 0\]: is inf"),
    ],
)
def test_what_gives_no_choices_is_refused(q, mask, beta, words):
    with pytest.raises(InputError, match=words):
        SoftPolicy.from_q(q, mask, beta=beta)


def test_a_soft_policy_comes_back_and_is_worth_the_same(chain, tmp_path):
    rng = np.random.default_rng(0)
    policy = SoftPolicy.from_q(rng.normal(size=chain.mask.shape), chain.mask, beta=2.0, **TOLD)
    save_soft_policy(policy, tmp_path / "p")
    read = load_soft_policy(tmp_path / "p", HASH)
    np.testing.assert_array_equal(read.probability, policy.probability)
    assert (read.task_hash, read.algorithm, read.seed) == (HASH, "planning", 3)
    R = rng.normal(size=chain.n_states)
    value = policy_value(chain, read.probability, R, 0.9)
    np.testing.assert_array_equal(value, policy_value(chain, policy.probability, R, 0.9))


@pytest.mark.parametrize("row", [[0.5, 0.4], [1.5, -0.5], [np.nan, 1.0], [np.inf, 0.0]])
def test_rows_that_are_no_probabilities_are_named(row):
    with pytest.raises(InputError, match="probability: row 1 must hold probabilities"):
        SoftPolicy(np.array([[1.0, 0.0], row]))


def test_the_safetensors_library_reads_them(tmp_path):
    library = pytest.importorskip("safetensors.numpy")
    save_reward(LearntReward(np.arange(3), 0.9), tmp_path / "r")
    assert library.load_file(tmp_path / "r")["reward"].tolist() == [0, 1, 2]


def test_equal_rewards_give_equal_bytes_in_every_process(tmp_path):
    code = (
        "import sys, numpy as np; from irl.outcomes import *;"
        "save_reward(LearntReward(np.arange(3), 0.9, 't', 'a', 1), sys.argv[1])"
    )
    for name in "12":
        subprocess.run([sys.executable, "-c", code, str(tmp_path / name)], check=True)
    assert (tmp_path / "1").read_bytes() == (tmp_path / "2").read_bytes()


KINDS = {
    "reward": (
        lambda path: save_reward(LearntReward(np.arange(3), 0.9, **TOLD), path),
        load_reward,
    ),
    "probability": (
        lambda path: save_soft_policy(SoftPolicy(np.eye(3), **TOLD), path),
        load_soft_policy,
    ),
}


@pytest.mark.parametrize("array", KINDS)
def test_damage_and_another_task_are_refused_in_one_line(tmp_path, array):
    save, load = KINDS[array]
    path = tmp_path / "kept"
    with pytest.raises(InputError, match="kept: no such file"):
        load(path)
    save(path)
    whole = path.read_bytes()
    arrays, told = from_bytes(whole)

    def refused(words, data, task_hash=HASH):
        path.write_bytes(data)
        with pytest.raises(InputError, match=rf"kept: .*{words}") as refusal:
            load(path, task_hash)
        assert "\n" not in str(refusal.value)

    for end in (0, 5, 40, -1):
        refused("not a readable", whole[:end])
    refused("another task", whole, "cd" * 32)
    refused("'kind' is 'cake'; valid: ", to_bytes(arrays, told | {"kind": "cake"}))
    refused("'schema_version' is '9'", to_bytes(arrays, told | {"schema_version": "9"}))
    refused("'digest' is not", to_bytes(arrays, told | {"seed": "4"}))
    refused("'digest' is not", to_bytes({array: arrays[array] * 0}, told))
    missing = {name: text for name, text in told.items() if name != "seed"}
    refused("'seed' is missing", to_bytes(arrays, missing))
    other = load_reward if load is load_soft_policy else load_soft_policy
    path.write_bytes(whole)
    with pytest.raises(InputError, match="field 'kind'"):
        other(path)
    assert len(getattr(load(path, HASH), array)) == 3


@pytest.mark.parametrize(
    ("arrays", "changes", "words"),
    [
        ({"other": np.zeros(2)}, {}, "one array 'reward' of float64 wanted, got {'other'"),
        ({"reward": np.zeros(2, np.float32)}, {}, "float64 wanted, got {'reward': 'float32'}"),
        ({"reward": np.full(2, np.nan)}, {}, "reward: finite numbers"),
        ({"reward": np.zeros(2)}, {"gamma": "nan"}, "gamma: must be"),
        ({"reward": np.zeros(2)}, {"gamma": "x"}, "'gamma' must be a number, is 'x'"),
        ({"reward": np.zeros(2)}, {"caution": "-1"}, "caution: must be ≥ 0"),
        ({"reward": np.zeros(2)}, {"caution": ""}, "'caution' must be a number, is ''"),
        ({"reward": np.zeros(2)}, {"seed": "1.5"}, "'seed' must be a number, is '1.5'"),
    ],
)
def test_a_file_with_a_right_digest_is_still_checked(tmp_path, arrays, changes, words):
    told = {name: str(value) for name, value in TOLD.items()} | {"gamma": "0.9"} | changes
    told = {"caution": "0"} | told
    write_arrays(tmp_path / "kept", "reward", arrays, told, REWARD_VERSION)
    with pytest.raises(InputError, match=rf"kept: .*{words}"):
        load_reward(tmp_path / "kept")
