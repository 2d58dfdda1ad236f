import json
import subprocess
import sys

import pytest
import yaml


def command(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "experiments.gridworld", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )


def test_command_leaves_configuration_result_and_figures(tmp_path):
    done = command(
        "--sizes", 5, 6, "--seeds", 0, 1, "--goal", "offset", "--trajectories", "border",
        "--state-preferences", "--iterations", 200, "--out", tmp_path / "run",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    left = {path.name for path in (tmp_path / "run").iterdir()}
    assert left == {"config.yaml", "result.json", "policy_5.png", "policy_6.png", "accuracy.png"}
    config = yaml.safe_load((tmp_path / "run/config.yaml").read_text())
    assert config["sizes"] == [5, 6]
    assert config["step"] == 1e-3
    result = json.loads((tmp_path / "run/result.json").read_text())
    for kind in ("rows", "rows_additive"):
        assert [row["states"] for row in result[kind]] == [25, 36]
        for row in result[kind]:
            assert len(row["accuracy"]) == 2
            assert all(0 <= share <= 1 for share in row["accuracy"])
            assert 0 < row["demonstrated_fraction"] < 1
            assert row["seconds_per_iteration"] > 0
            assert row["trajectories"] == "border"
    for figure in ("policy_5.png", "accuracy.png"):
        assert (tmp_path / "run" / figure).read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--sizes", 8), "odd"),
        (("--sizes", 1), "at least 3"),
        (("--trajectories", "spiral"), "diagonal"),
        (("--beta", 3), "--beta"),
        (("--step", 0), "step"),
        (("--hidden", 0), "hidden"),
    ],
)
def test_mistakes_are_told_in_one_line_and_leave_nothing(tmp_path, arguments, words):
    done = command(*arguments, "--out", tmp_path / "run")
    assert done.returncode == 2
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "run").exists()
