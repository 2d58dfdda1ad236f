import importlib
import inspect
import json
from pathlib import Path

import numpy as np
import pytest

from experiments import own_task, toy_text
from experiments.own_task import workshop
from irl.policy import load_policy
from irl.task_data import EVIDENCE, load_task

ROOT = Path(__file__).resolve().parents[2]


def test_the_page_shows_this_very_task():
    assert inspect.getsource(workshop) in (ROOT / "experiments/own_task.md").read_text(
        encoding="utf-8"
    )


def test_what_the_machine_can_do():
    task = workshop(parts=3, worn_out=2)
    actions = [row["name"] for row in task.actions]
    for s, row in enumerate(task.states):
        feasible = {actions[a] for a in task.model.actions_of(s)}
        if row["made"] == "3":
            assert feasible == {"rest"}
        elif row["wear"] == "2":
            assert feasible == {"service"}
        else:
            assert feasible == {"fast", "slow"} | ({"service"} if row["wear"] != "0" else set())
    # Fast from a new machine: part and wear are independent.
    row = task.model.P[int(task.model.pair_index(0, 0))].toarray().ravel()
    made = np.array([int(state["made"]) for state in task.states])
    wear = np.array([int(state["wear"]) for state in task.states])
    assert row @ made == pytest.approx(0.9)
    assert row @ wear == pytest.approx(0.6)
    assert row @ (made * wear) == pytest.approx(0.9 * 0.6)
    assert {EVIDENCE[k] for k in task.transitions.evidence} == {"estimated"}


def test_the_command_learns_and_leaves_task_and_policies(tmp_path, command):
    done = command("own_task", "--methods", "lp", "behaviour_cloning", "--out", tmp_path / "a")
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "a/result.json").read_text())
    for picture in ("methods.png", "states.png"):
        assert (tmp_path / "a" / picture).read_bytes().startswith(b"\x89PNG")
    task = load_task(tmp_path / "a/task")
    assert [row["method"] for row in result["rows"]] == ["lp", "behaviour_cloning"]
    for row in result["rows"]:
        load_policy(tmp_path / f"a/{row['method']}.safetensors", task.task_hash)
        assert 0.8 < row["success_mdp"] <= 1
        assert row["method"] in done.stdout
    reward, copy = result["rows"]
    assert copy["accuracy_optimal_all"] > 0.8
    # Where the paces change a reward is planned for anew, and copied choices stay as they are.
    assert reward["success_changed"] > 0.9
    assert copy["success_changed"] < 0.1
    assert copy["success_mdp"] > reward["success_mdp"]
    assert 0.94 < result["success_mdp_oracle"] < 0.96


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("own_task", ("--methods", "magic"), "--methods: unknown name 'magic'"),
        ("own_task", ("--trajectories", 0), "--trajectories: must be ≥ 1"),
        ("toy_text", ("--environments", "Chess-v0"), "--environments: unknown name 'Chess-v0'"),
        ("toy_text", ("--episodes", 0), "--episodes: must be ≥ 1"),
    ],
)
def test_mistakes_cost_one_line(refused, name, options, words):
    if name == "toy_text":
        pytest.importorskip("gymnasium")
    assert words in refused(importlib.import_module(f"experiments.{name}"), *options)


def test_a_gymnasium_without_one_of_the_worlds_is_named(refused, monkeypatch):
    gymnasium = pytest.importorskip("gymnasium")
    monkeypatch.delitem(gymnasium.registry, "Taxi-v4")
    told = refused(importlib.import_module("experiments.toy_text"))
    assert f"--environments: gymnasium {gymnasium.__version__} has no Taxi-v4" in told


def test_toy_worlds_are_learnt_and_played(tmp_path, command):
    pytest.importorskip("gymnasium")
    options = ("--methods", "linear_mlirl", "planning", "--episodes", 60)
    done = command("toy_text", *options, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    rows = json.loads((tmp_path / "out/result.json").read_text())["rows"]
    assert (tmp_path / "out/methods.png").read_bytes().startswith(b"\x89PNG")
    assert len(rows) == 6
    for row in rows:
        assert row.keys() >= {"environment", "method", "return", "optimal", "seconds"}
        low, high = row["return_interval"]
        assert low <= row["return"] <= high
        slack = {"FrozenLake-v1": 0.15, "CliffWalking-v1": 0, "Taxi-v4": 0.2}[row["environment"]]
        assert row["return"] >= row["optimal"] - slack
        low, high = row["success_interval"]
        assert low <= row["success"] <= high + 1e-12


def test_no_preference_is_told_in_place_of_shares(capsys):
    rows = [
        {
            "method": "lp",
            "success_mdp": None,
            "accuracy_optimal_all": None,
            "success_changed": None,
            "seconds": 0.1,
            "note": "no preference: R = 0 is best at l1 = 9; lower l1 below 2",
        }
    ]
    own_task.show(rows, 0.9, 0.9)
    assert "LP (3.7)                    no preference: R = 0 is best" in capsys.readouterr().out
    assert "0 of 1 methods" in own_task.interpretation(rows, 0.9, 0.9)
    toy = {"environment": "FrozenLake-v1", **rows[0], "return": None, "optimal": 1.0}
    toy_text.show([toy])
    assert "lp                 no preference: R = 0 is best" in capsys.readouterr().out
    assert "0 of 1 in FrozenLake-v1" in toy_text.interpretation([toy])
