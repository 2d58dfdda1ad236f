"""The hold test as a command."""

import csv
import json
from pathlib import Path

import pytest

from experiments.hold import robosuite, story
from experiments.hold.cases import Case
from experiments.hold.rig import Load
from experiments.kit.command import execute
from experiments.kit.kept_rows import KEPT

SMALL = (
    *("--swings", "up-down-across", "--shares", "1", "--masses", "0.5", "--frictions", "0.5"),
    *("--heavy", "3", "--no-arm", "--peers", "/nowhere/python"),
)


KEPT_CHATTER = 777
"""In a kept row: what is kept is not run again."""


@pytest.fixture(scope="module")
def resumed(tmp_path_factory):
    """The folder of a run that was interrupted before its pictures, then called again."""
    folder = tmp_path_factory.mktemp("hold")

    def run():
        execute(story.Config, story.main, [*SMALL, "--out", str(folder)])

    def interrupted(*_):
        raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(story, "plot_verdicts", interrupted)
        with pytest.raises(SystemExit):
            run()
    kept = json.loads((folder / KEPT).read_text())
    kept["rows"][0]["chatter"] = KEPT_CHATTER
    (folder / KEPT).write_text(json.dumps(kept))
    run()
    return folder


def test_an_interrupted_run_goes_on_where_it_was(resumed):
    rows = json.loads((resumed / "result.json").read_text())["rows"]
    assert [row["chatter"] == KEPT_CHATTER for row in rows] == [True, False]
    assert not (resumed / KEPT).exists()


def test_cases_are_told_and_a_missing_peer_is_named(resumed):
    result = json.loads((resumed / "result.json").read_text())
    assert result["robosuite"].startswith("/nowhere/python: no such interpreter")
    assert result["engines"]["ours"]["verdicts"] == {"holds": 1, "lost": 1}
    assert result["engines"]["halved"]["other_verdict_than_ours"] == 0
    assert set(result["engines"]) == {"ours", "halved"}
    with (resumed / "cases.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["verdict"] for row in rows] == ["holds", "lost"]
    for told, row in zip(rows, result["rows"], strict=True):
        assert float(told["slip_mm"]) == row["slip_mm"]
        # 2 · friction · force ÷ (mass · (g + a)), by hand from the columns.
        needed = row["mass_kg"] * (9.81 + row["acceleration_m_s2"])
        assert row["ratio"] == pytest.approx(2 * row["friction"] * row["force_n"] / needed)
    assert (resumed / "verdicts.png").stat().st_size > 10_000
    assert (resumed / "margin.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--time-step", 0.0013), "--time-step: 0.0013 s; 2 ms must be a whole number of steps"),
        (("--force", 10), "--force: must be ≥ 20 and ≤ 235"),
        (("--shares", 1.5), "--shares: must be > 0 and ≤ 1"),
        (("--shares", "nan"), "--shares: must be > 0 and ≤ 1, is nan"),
        (("--masses", 0), "--masses: must be ≥ 0.01"),
        (("--swings", "upwards"), "--swings: unknown name 'upwards'; valid: sweep-across"),
        (("--workers", 0), "--workers: must be ≥ 1"),
    ],
    ids=str,
)
def test_bad_options_are_refused(refused, options, words):
    assert words in refused(story, *options)


@pytest.mark.skipif(
    bool(robosuite.missing(robosuite.PYTHON)), reason=robosuite.missing(robosuite.PYTHON)
)
def test_robosuites_hand_obeys_coulomb_too():
    loads = {"holds": Load(0.5, 0.5, 40.0), "lost": Load(3.0, 0.5, 20.0)}
    cases = [Case("up-down-across", 1.0, load) for load in loads.values()]
    found = robosuite.hold_all(robosuite.PYTHON, cases)
    assert [row["mujoco_verdict"] for row in found] == list(loads)
    # The gain was found for the cube as it is gripped; it settles a little since.
    assert found[0]["mujoco_force_mean_n"] == pytest.approx(40.0, rel=0.2)


def test_an_environment_without_robosuite_is_told(tmp_path):
    bare = Path(tmp_path / "python")
    bare.write_text("#!/bin/sh\nexit 1\n")
    bare.chmod(0o755)
    assert "has no robosuite" in robosuite.missing(bare)
