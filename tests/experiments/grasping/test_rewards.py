"""Lessons about hidden rewards, as a person runs them, and by themselves."""

import json

import numpy as np

from experiments.grasping.enough import counted
from experiments.grasping.lessons import shared_setting, shown_runs
from experiments.grasping.rewards import run_lesson, summary
from experiments.kit.shipped_data import SHIPPED_TASK
from irl.demonstrations import Demonstrations
from irl.posterior.enough import LEARNT, REACHES, UNSURE, EnoughRule, claim
from irl.posterior.predictions import Predicted


def test_rewards_are_learnt_from_one_trajectory_and_results_do_not_depend_on_workers(
    command, tmp_path
):
    options = ("--number", 1, "--learners", "goal_posterior", "--noise", "--questions", 1)
    done = command("grasping", "rewards", *options, "--workers", 2, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "accuracy" in done.stdout
    assert not (tmp_path / "measured.json").exists()
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["noisy_rows"] == []
    assert [row["answers"] for row in result["rows"]] == [0, 1]
    for row in result["rows"]:
        assert row["success_mdp"] >= 0.99
        assert row["worst_start"] >= 0.95
    here = run_lesson(str(SHIPPED_TASK), 0, 1, ("goal_posterior", 0, 0.0))
    assert result["rows"] == here


def test_runs_end_at_the_goal_and_number_as_asked():
    setting = shared_setting(str(SHIPPED_TASK), 1000, 0)
    reward = setting.reward(14)
    shown = shown_runs(setting, reward, 3, np.random.default_rng(0))
    assert np.isin(shown.ends[:, 2], reward.goal_states).all()
    assert np.unique(shown.trajectory).tolist() == [0, 1, 2]
    shown.check(setting.task.model)


def row(**changed):
    base = {
        "method": "m",
        "answers": 0,
        "label_noise": 0.0,
        "kind": "free",
        "costs": {},
        "success_mdp": 1.0,
        "worst_start": 1.0,
        "accuracy_optimal_all": 0.9,
        "labels": 5,
    }
    return {**base, **changed}


def test_a_cost_without_a_name_is_told_apart():
    rows = [row(), row(costs={"tilt": 0.1}, accuracy_optimal_all=0.5, kind="held")]
    told = {each["rewards"]: each for each in summary(rows)}
    assert told["all"]["accuracy_optimal_all"]["mean"] == 0.7
    assert told["named costs"]["accuracy_optimal_all"]["least"] == 0.9
    assert told["a cost without a name"]["number"] == told["held"]["number"] == 1
    assert "region" not in told


def test_lessons_are_counted():
    rows = [
        {"stopped": True, "right": True, "labels": 10, "answers": 4, "costs": {}},
        {"stopped": True, "right": False, "labels": 12, "answers": 8, "costs": {}},
        {"stopped": False, "right": True, "labels": 20, "answers": 16, "costs": {"tilt": 0.1}},
    ]
    told = counted(rows, 16)
    assert (told["lessons"], told["stopped"], told["right_share"]) == (3, 2, 0.5)
    assert told["answers_saved"] == 20 / 3
    assert told["nameless_right_share"] is None


class Told:
    """A learner that predicts what it is told to."""

    shown = Demonstrations.empty()

    def __init__(self, success=1.0, accuracy=0.99, ends=1.0, unexplained=0.01):
        self.predicted = Predicted(success, accuracy)
        self.ends_agree, self.unexplained = ends, unexplained


def test_enough_is_twice_in_a_row():
    enough = EnoughRule()
    assert [enough(Told(a)) for a in (1.0, 0.9, 1.0, 1.0)] == [False, False, False, True]


def test_what_a_learner_may_claim():
    assert claim(Told()) == LEARNT
    assert claim(Told(ends=0.0)) == claim(Told(success=0.9)) == UNSURE
    assert claim(Told(accuracy=0.9)) == claim(Told(unexplained=0.4)) == REACHES
