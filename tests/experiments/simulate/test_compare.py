"""Two policies compared without physics: the better is found, early, on any number of workers."""

import numpy as np
import pytest

from experiments.kit.command import Output
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.simulate.compare import Config, main
from irl.policy import Policy, load_policy, save_policy


@pytest.fixture(scope="module")
def worse_file(policy_file, tmp_path_factory):
    """The same policy, but for a third of the states, where it does just anything."""
    task = load_robot_task(SHIPPED_TASK)
    policy = load_policy(policy_file, task.task_hash, task.model.mask)
    q, rng = policy.q.copy(), np.random.default_rng(0)
    for state in range(0, 15984, 3):
        feasible = np.flatnonzero(task.model.mask[state])
        if feasible.size:
            q[state, rng.choice(feasible)] = 10.0
    path = tmp_path_factory.mktemp("worse") / "policy.safetensors"
    save_policy(Policy.from_q(q, task.model.mask, task_hash=task.task_hash), path)
    return path


def compare(a, b, folder, **options):
    config = Config(a, b, out=folder, physics=False, decision="table", starts=200, **options)
    return main(config, Output(folder, config))


def test_the_better_policy_is_found_early_and_either_way_round(policy_file, worse_file, tmp_path):
    first = compare(policy_file, worse_file, tmp_path / "1")
    second = compare(worse_file, policy_file, tmp_path / "2")
    assert (first["better"], second["better"]) == ("a", "b")
    assert first["pairs"] == second["pairs"] < 60
    assert first["confidence"] >= 0.95
    assert first["success"]["a"] > first["success"]["b"] == 0


def test_a_policy_is_not_better_than_itself(policy_file, tmp_path):
    result = compare(policy_file, policy_file, tmp_path)
    assert (result["better"], result["pairs"]) == (None, 200)
    assert result["confidence"] == 0.0 and result["success"]["even"] == 200


def test_the_answer_does_not_depend_on_the_number_of_workers(policy_file, worse_file, tmp_path):
    one = compare(policy_file, worse_file, tmp_path / "1")
    two = compare(policy_file, worse_file, tmp_path / "2", workers=2)
    for result in (one, two):
        for side in "ab":
            assert np.isfinite(result[side].pop("decision_cpu_ms")["mean"])
    assert one == two
