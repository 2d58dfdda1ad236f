"""The command without physics: every start, by table and forecast, counted and in rows."""

import csv

import pytest

from diagrams.policy_controller import Verdict
from experiments.kit.command import Output
from experiments.simulate.story import COLUMNS, Config, main
from irl.errors import InputError


def play(policy_file, folder, **options):
    config = Config(policy=policy_file, out=folder, physics=False, **options)
    return main(config, Output(folder, config))


def test_all_starts_are_played_and_each_leaves_a_row(policy_file, tmp_path):
    result = play(policy_file, tmp_path, starts="all", decision="table", seed=5)
    rows = list(csv.DictReader((tmp_path / "episodes.csv").open()))
    assert result["trials"] == len(rows) == 431
    assert tuple(rows[0]) == COLUMNS
    assert result["successes"] == sum(row["success"] == "1" for row in rows)
    assert 350 <= result["successes"] < 431
    assert set(result["failures"]) == {Verdict.OUT_OF_ACTIONS, Verdict.LOST}
    assert sum(result["failures"].values()) == 431 - result["successes"]
    assert (result["decision"], result["goals"], result["physics"]) == ("table", None, False)


@pytest.mark.parametrize("goals", ["task", "learner"])
def test_results_say_which_goals_the_forecast_went_by(policy_file, tmp_path, goals):
    result = play(policy_file, tmp_path, starts=40, goals=goals)
    assert (result["decision"], result["goals"]) == ("forecast", goals)
    assert result["trials"] == 40
    rows = list(csv.DictReader((tmp_path / "episodes.csv").open()))
    for row in rows:
        many = len(row["chosen_by"].split())
        assert many == int(row["actions"]) == len(row["action_failures"].split())
    assert result["successes"] == 40
    assert result["decision_cpu_ms"]["mean"] < 10.0


def test_what_has_no_motions_is_not_exported(policy_file, tmp_path):
    with pytest.raises(InputError, match="--export"):
        play(policy_file, tmp_path, export=tmp_path / "motions")


def test_repetitions_differ_and_results_say_who_always_succeeds(policy_file, tmp_path):
    result = play(policy_file, tmp_path, starts=30, repeat=3, decision="table")
    rows = list(csv.DictReader((tmp_path / "episodes.csv").open()))
    assert len(rows) == result["trials"] == 90
    by_start = {row["number"]: [] for row in rows}
    for row in rows:
        by_start[row["number"]].append(row["success"] == "1")
    assert result["repeated"]["starts"] == 30 and result["repeated"]["times"] == 3
    assert result["repeated"]["always"] == sum(map(all, by_start.values()))


def test_workers_play_the_same_episodes(policy_file, tmp_path):
    one = play(policy_file, tmp_path / "1", starts=20, seed=3)
    two = play(policy_file, tmp_path / "2", starts=20, seed=3, workers=2)
    assert one["episodes_sha256"] == two["episodes_sha256"]


def test_a_scenario_that_there_is_not_is_refused_by_its_option(policy_file, tmp_path):
    config = Config(policy=policy_file, out=tmp_path, scenario="earthquake")
    with pytest.raises(InputError, match=r"--scenario: .*earthquake.*push"):
        main(config, Output(tmp_path, config))
