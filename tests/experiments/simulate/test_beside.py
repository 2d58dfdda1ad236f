"""Scenarios beside undisturbed episodes of the same seeds."""

import csv
from collections import Counter

import pytest

from diagrams.scenarios import load_scenario, shipped_scenarios
from experiments.kit.command import Output
from experiments.kit.kept_rows import KEPT
from experiments.simulate import beside, episodes
from experiments.simulate.episodes import Outcome
from irl.errors import InputError


def config(policy_file, folder, **options):
    return beside.Config(policy=policy_file, out=folder, starts=4, **options)


def row_of(job, *, success=True, acted=True):
    return {
        **{"number": job.number, "repetition": job.repetition, "disturbed": job.disturbed},
        **{"start": job.start, "verdict": "goal" if success else "lost", "actions": [3]},
        **{"states": [7], "chosen_by": ["policy"], "action_failures": [""], "success": success},
        **{"false_success": False, "seconds": 0.1, "fault": "", "acted": acted},
        **{"limits": None, "cpu_s": 1.0},
    }


@pytest.fixture
def played(monkeypatch):
    """Episodes that cost nothing, counted; the first fails when pushed, the second escapes it."""
    known = Counter()

    def play(setting, job, whole):
        known[setting.scenario, job.number] += 1
        pushed = setting.scenario == load_scenario("push").text()
        assert bool(setting.scenario) == job.disturbed
        return Outcome(
            row_of(job, success=not (pushed and job.number == 0), acted=job.number != 1)
            if pushed
            else row_of(job)
        )

    monkeypatch.setattr(episodes, "play", play)
    return known


def test_every_shipped_scenario_stands_beside_episodes_that_are_played_once(
    policy_file, tmp_path, played, capsys
):
    given = config(policy_file, tmp_path)
    result = beside.main(given, Output(tmp_path, given))
    assert list(result["scenarios"]) == shipped_scenarios()
    assert max(played.values()) == 1
    assert sum(played.values()) == 4 * (1 + len(shipped_scenarios()))
    push = result["scenarios"]["push"]
    assert (push["successes"], push["trials"], push["not_acted"]) == (2, 3, 1)
    assert (push["undisturbed"]["successes"], push["undisturbed"]["trials"]) == (3, 3)
    assert push["paired"]["only_undisturbed"] == 1
    assert push["paired"]["difference"][0] == pytest.approx(-1 / 3)
    assert result["scenarios"]["slip"]["paired"]["difference"][0] == 0.0
    rows = list(csv.DictReader((tmp_path / "scenarios.csv").open()))
    assert [row["scenario"] for row in rows] == shipped_scenarios()
    assert len(list(csv.DictReader((tmp_path / "push/episodes.csv").open()))) == 4
    assert (tmp_path / "scenarios.png").stat().st_size > 10_000
    assert not list(tmp_path.rglob(KEPT))
    assert "push     2/3" in capsys.readouterr().out


def test_what_was_interrupted_goes_on(policy_file, tmp_path, played, monkeypatch):
    given = config(policy_file, tmp_path, scenarios=("push", "slip"))
    play = episodes.play

    def until(setting, job, whole):
        if sum(played.values()) == 6:
            raise KeyboardInterrupt
        return play(setting, job, whole)

    monkeypatch.setattr(episodes, "play", until)
    with pytest.raises(KeyboardInterrupt):
        beside.main(given, Output(tmp_path, given))
    monkeypatch.setattr(episodes, "play", play)
    result = beside.main(given, Output(tmp_path, given))
    assert sum(played.values()) == 12
    assert list(result["scenarios"]) == ["push", "slip"]


@pytest.mark.parametrize(
    ("names", "told"),
    [(("push", "earthquake"), r"--scenarios: .*earthquake.*push"), (("push", "push"), "once")],
)
def test_scenarios_that_cannot_be_are_refused(policy_file, tmp_path, names, told):
    given = config(policy_file, tmp_path, scenarios=names)
    with pytest.raises(InputError, match=told):
        beside.main(given, Output(tmp_path, given))


def test_it_is_a_command(command, tmp_path):
    done = command("simulate", "scenarios", "--policy", tmp_path / "none", "--out", tmp_path / "o")
    assert done.returncode == 2
    assert "none" in done.stderr
