"""The command without physics: every start, by table and forecast, counted and in rows."""

import csv
from pathlib import Path

import numpy as np
import pytest

from diagrams.policy_controller import Verdict
from experiments.kit.command import Output
from experiments.kit.robot_task import load_robot_task
from experiments.kit.shipped_data import SHIPPED_TASK
from experiments.simulate.story import COLUMNS, Config, main
from irl.errors import InputError
from irl.policy import Policy, save_policy
from models.task.spaces import Action, Kind, State

ACTIONS = Path(__file__).parents[2] / "data" / "demo_actions.npz"


@pytest.fixture(scope="module")
def policy_file(tmp_path_factory):
    task = load_robot_task(SHIPPED_TASK)
    action = np.load(ACTIONS)["action"].astype(np.int64)
    q = np.where(task.model.mask, 0.0, -np.inf).astype(np.float32)
    some = np.flatnonzero(action >= 0)
    q[some, action[some]] = 1.0
    q[State(2, 0, 10).index, Action(Kind.DROP).index] = 2.0  # at the goal
    path = tmp_path_factory.mktemp("policy") / "policy.safetensors"
    save_policy(Policy(action, q, task_hash=task.task_hash), path)
    return path


def play(policy_file, folder, **options):
    config = Config(policy=policy_file, out=folder, physics=False, **options)
    return main(config, Output(folder, config))


def test_all_starts_are_played_and_each_leaves_a_row(policy_file, tmp_path):
    result = play(policy_file, tmp_path, starts="all", decision="table", seed=5)
    rows = list(csv.DictReader((tmp_path / "episodes.csv").open()))
    assert result["trials"] == len(rows) == 431
    assert tuple(rows[0]) == COLUMNS
    assert result["successes"] == sum(row["success"] == "1" for row in rows)
    assert 390 <= result["successes"] < 431
    assert result["failures"] == {Verdict.OUT_OF_ACTIONS: 431 - result["successes"]}
    assert (result["decision"], result["goals"], result["physics"]) == ("table", None, False)


@pytest.mark.parametrize("goals", ["task", "learner"])
def test_results_say_which_goals_the_forecast_went_by(policy_file, tmp_path, goals):
    result = play(policy_file, tmp_path, starts=40, goals=goals)
    assert (result["decision"], result["goals"]) == ("forecast", goals)
    assert result["trials"] == 40
    rows = list(csv.DictReader((tmp_path / "episodes.csv").open()))
    assert [len(row["chosen_by"].split()) for row in rows] == [int(row["actions"]) for row in rows]
    assert result["successes"] == 40
    assert result["decision_cpu_ms"]["mean"] < 10.0


def test_what_has_no_motions_is_not_exported(policy_file, tmp_path):
    with pytest.raises(InputError, match="--export"):
        play(policy_file, tmp_path, export=tmp_path / "motions")
