import json
import signal
import subprocess
import sys
import time

import pytest
import yaml

from experiments.complexity import story
from experiments.complexity.growth import FIT_FROM, PUBLISHED, PUBLISHED_STATES, growth
from irl.methods import METHODS


def test_command_times_every_method_on_every_grid(tmp_path, command):
    done = command("complexity", "--states", 25, 16, "--rounds", 1, "--out", tmp_path / "run")
    assert done.returncode == 0, done.stderr
    left = {path.name for path in (tmp_path / "run").iterdir()}
    assert left == {"config.yaml", "result.json", "complexity.png"}
    assert yaml.safe_load((tmp_path / "run/config.yaml").read_text())["gamma"] == 0.99
    result = json.loads((tmp_path / "run/result.json").read_text())
    assert [row["states"] for row in result["rows"]] == [16, 25]
    for row in result["rows"]:
        assert row["seconds"].keys() == METHODS.keys()
        for name, seconds in row["seconds"].items():
            low, high = row["quartiles"][name]
            assert 0 < low <= seconds <= high
            assert row["times_fa_mlirl"][name] == seconds / row["seconds"]["fa_mlirl"]
        assert row["skipped"] == {}
    assert [row["horizon"] for row in result["rows"]] == [4, 4]
    assert {name for name, unit in result["unit"].items() if unit == "solve"} == {
        "goal_posterior", "lp", "lp_advice", "lp_basis",
    }  # fmt: skip
    assert [row["states"] for row in result["published"]["rows"]] == list(PUBLISHED_STATES)
    assert result["setting"]["threads"] == 1
    assert (tmp_path / "run/complexity.png").read_bytes().startswith(b"\x89PNG")


def test_a_method_over_budget_is_skipped_on_larger_grids(tmp_path, command):
    done = command(
        "complexity",
        "--states", 9, 16, 25, "--methods", "fa_mlirl", "lp", "--rounds", 1,
        "--budget", 0.003, "--out", tmp_path / "run",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    small, *larger = json.loads((tmp_path / "run/result.json").read_text())["rows"]
    assert small["seconds"]["lp"] > 0.003
    assert small["timed"]["lp"] >= 1
    for row in larger:
        assert row["seconds"].keys() == {"fa_mlirl"}
        assert "9 states" in row["skipped"]["lp"]


def test_a_killed_run_goes_on_with_the_same_command_only(tmp_path, command):
    out = tmp_path / "run"
    kept = out / "measured.json"
    options = ["--states", "9", "2500", "--methods", "planning", "--out", str(out)]
    running = subprocess.Popen(
        [sys.executable, "-m", "experiments.complexity", *options], stderr=subprocess.DEVNULL
    )
    limit = time.monotonic() + 60
    while not kept.exists() and running.poll() is None and time.monotonic() < limit:
        time.sleep(0.01)
    running.send_signal(signal.SIGKILL)
    running.wait()
    before = json.loads(kept.read_text())["rows"]
    assert [row["states"] for row in before] == [9]

    other = command("complexity", *options, "--gamma", 0.9)
    assert other.returncode == 2
    assert f"{kept}: kept by other work, differing in gamma (0.99 there, 0.9 here)" in other.stderr
    done = command("complexity", *options)
    assert done.returncode == 0, done.stderr
    rows = json.loads((out / "result.json").read_text())["rows"]
    assert rows[0] == before[0]
    assert [row["states"] for row in rows] == [9, 2500]
    assert not kept.exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--states", 26), "--states: 26 is not a square; the next are 25, 36"),
        (("--states", 4), "--states: a grid needs at least 3 cells"),
        (("--methods", "magic"), "--methods: unknown name 'magic'"),
        (("--rounds", 0), "--rounds: "),
        (("--gamma", 1), "--gamma: "),
        (("--budget", 0), "--budget: "),
    ],
)
def test_mistakes_are_told_in_one_line_and_leave_nothing(refused, arguments, words):
    assert words in refused(story, *arguments)


def test_growth_of_a_power_law_is_its_exponent():
    sizes = [9, FIT_FROM, 2 * FIT_FROM, 8 * FIT_FROM, 9 * FIT_FROM]
    rows = [{"states": n, "seconds": {"fa_mlirl": 1.0 if n == 9 else n**1.5}} for n in sizes]
    rows[1]["seconds"]["lp"] = rows[2]["seconds"]["lp"] = 1.0
    fit = growth(rows)
    assert fit.keys() == {"fa_mlirl"}  # two grids tell nothing of lp
    assert fit["fa_mlirl"]["exponent"] == pytest.approx(1.5)
    assert fit["fa_mlirl"]["low"] <= fit["fa_mlirl"]["high"]
    assert fit["fa_mlirl"]["states"] == sizes[1:]


def test_interval_of_growth_covers_a_disturbed_power_law():
    noise = [1.1, 0.92, 1.05, 0.95, 1.02]
    rows = [
        {"states": FIT_FROM * 2**k, "seconds": {"max_ent": factor * 4.0**k}}
        for k, factor in enumerate(noise)
    ]
    fit = growth(rows)["max_ent"]
    assert fit["low"] < 2 < fit["high"]
    assert fit["low"] < fit["exponent"] < fit["high"]


def test_published_table_has_a_time_for_every_grid():
    assert all(len(column) == len(PUBLISHED_STATES) for column in PUBLISHED.values())
    assert PUBLISHED["fa_mlirl"][-1] == 3.347
