"""What the planning learner makes of few labels."""

import json

import numpy as np
import pytest

from experiments.grasping.hidden.planning import learnt_from, summarised
from experiments.grasping.teacher import TeacherConfig
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK


def test_one_trajectory_teaches_the_way_from_everywhere():
    task = load_robot_task(SHIPPED_TASK)
    learnt, pruned = learnt_from(task, TeacherConfig(), 2, np.random.default_rng(100))
    assert 2 <= learnt["labels"] <= 7
    assert pruned["rewarded"] == 1 < learnt["rewarded"]
    assert min(learnt["success_mdp"], pruned["success_mdp"]) >= 0.99
    # Four labels do not tell how sure the demonstrator wants to be of the way; caution does.
    assert min(learnt["accuracy_optimal_all"], pruned["accuracy_optimal_all"]) >= 0.97


@pytest.mark.soak
def test_seeds_are_tabulated(command, tmp_path):
    options = ("--seeds", 1, "--labels", 0, "--seed", 100, "--out", tmp_path)
    done = command("grasping", "planning", *options)
    assert done.returncode == 0, done.stderr
    assert "accuracy" in done.stdout
    assert not (tmp_path / "measured.json").exists()
    result = json.loads((tmp_path / "result.json").read_text())
    assert [row["reward"] for row in result["rows"]] == ["as learnt", "pruned"]
    assert len(result["summary"]) == 2


def test_seeds_are_summarised_by_reward_and_noise():
    row = {"labels": 5, "success_mdp": 1.0, "seconds": 2.0}
    rows = [
        {**row, "reward": "pruned", "label_noise": 0.0, "accuracy_optimal_all": 0.9},
        {**row, "reward": "pruned", "label_noise": 0.0, "accuracy_optimal_all": 1.0},
        {**row, "reward": "pruned", "label_noise": 0.3, "accuracy_optimal_all": 0.5},
    ]
    clean, noisy = summarised(rows)
    assert (clean["seeds"], clean["accuracy_optimal_all"]["mean"]) == (2, 0.95)
    assert clean["accuracy_optimal_all"]["least"] == 0.9
    assert noisy["accuracy_optimal_all"]["mean"] == 0.5
