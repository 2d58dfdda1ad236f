import json

import numpy as np
import pytest
import yaml

from experiments.gridworld import story
from experiments.gridworld.hard import Case
from experiments.kit.command import execute
from irl.domains.gridworld import GridWorld


def run(*arguments):
    execute(story.Config, story.main, [str(argument) for argument in arguments])


def result_of(folder):
    return json.loads((folder / "result.json").read_text())


def test_command_leaves_configuration_result_and_figures(tmp_path, command):
    done = command(
        "gridworld", "--sizes", 5, 6, "--seeds", 0, 1, "--goal", "offset",
        "--trajectories", "border", "--state-preferences", "--iterations", 200,
        "--out", tmp_path / "run",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "8/8" in done.stderr  # the bar: two sizes, two seeds, plain and additive
    left = {path.name for path in (tmp_path / "run").iterdir()}
    figures = {"policy_5.png", "policy_6.png", "accuracy.png", "time.png", "preferences.png"}
    assert left == {"config.yaml", "result.json", *figures}
    config = yaml.safe_load((tmp_path / "run/config.yaml").read_text())
    assert config["sizes"] == [5, 6]
    assert config["step"] == 1e-3
    result = result_of(tmp_path / "run")
    for kind in ("rows", "rows_additive"):
        assert [row["states"] for row in result[kind]] == [25, 36]
        for row in result[kind]:
            assert len(row["accuracy"]) == len(row["wall_s"]) == 2
            for shortest, share in zip(row["accuracy_shortest"], row["accuracy"], strict=True):
                assert 0 <= shortest <= share <= 1
            assert 0 < row["demonstrated_fraction"] < 1
            assert row["seconds_per_iteration"] > 0
            assert row["trajectories"] == "border"
    for figure in figures:
        assert (tmp_path / "run" / figure).read_bytes().startswith(b"\x89PNG")


def test_state_preferences_turn_demonstrations_along_the_limits_inwards(tmp_path):
    run(
        "--sizes", 7, "--seeds", 0, 1, 2, "--no-additive", "--iterations", 500,
        "--out", tmp_path / "run",
    )  # fmt: skip
    rows = result_of(tmp_path / "run")["preference_rows"]
    without, with_ = (sum(row["stays_at_limits"]) for row in rows if row["beta"] == 1)
    assert with_ < without
    assert all(share == 1 for row in rows for share in row["accuracy"])


def test_hard_cases_do_not_depend_on_the_number_of_workers(tmp_path):
    results = []
    for workers in (1, 2):
        run(
            "--hard", "--hard-size", 7, "--hard-seeds", 2, "--queries", 1, "--wrong", 0.3,
            "--sizes", 5, "--seeds", 0, "--iterations", 40, "--no-additive",
            "--workers", workers, "--out", tmp_path / str(workers),
        )  # fmt: skip
        results.append(result_of(tmp_path / str(workers)))
    one, two = results
    assert one["hard_rows"] == two["hard_rows"]
    assert one["rows"][0]["accuracy"] == two["rows"][0]["accuracy"]
    cases = {row["case"] for row in one["hard_rows"]}
    assert cases == {
        "goal at a corner", "wall", "four rooms", "30% wrong actions", "unseen quadrant",
        "unseen half",
    }  # fmt: skip
    assert len(one["hard_rows"]) == 4 * len(cases)  # with and without preferences and queries
    for row in one["hard_rows"]:
        low, high = row["interval"]
        assert 0 <= low <= sum(row["accuracy"]) / 2 <= high <= 1
    for figure in ("hard.png", "hard_policies.png"):
        assert (tmp_path / "1" / figure).read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("share", "corners"), [(0.0, (0, 1, 2, 3)), (0.25, (0, 1, 2, 3)), (0.0, (1, 2))]
)
def test_a_case_shows_what_it_says(share, corners):
    case = Case("any", GridWorld(9, (4, 4)), "border", wrong=share, corners=corners)
    shown = case.demonstrations(np.random.default_rng(0))
    world = case.world
    after = world.model.P.indices[world.model.pair_index(shown.state, shown.action)]
    worse = world.distance[after] > world.distance[shown.state]
    # In the four corners every move is right, so that these cannot be made worse.
    assert worse.sum() == round(share * (len(shown) - 4))
    assert np.unique(shown.trajectory[~worse]).size == len(corners)
    x, _ = world.cells[shown.state].T
    assert corners != (1, 2) or x.min() >= 4  # the left half is unseen


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--sizes", 8), "--sizes: goal centre needs an odd size"),
        (("--sizes", 1), "--sizes: a grid needs at least 3"),
        (("--trajectories", "spiral"), "diagonal"),
        (("--beta", 3), "--beta"),
        (("--step", 0), "--step: must be > 0"),
        (("--hidden", 0), "--hidden: must be ≥ 1"),
        (("--workers", 0), "--workers: must be ≥ 1"),
        (("--seeds", 0, -1), "--seeds: with --seed"),
        (("--hard", "--hard-size", 8), "--hard-size: "),
        (("--hard-seeds", 0), "--hard-seeds: "),
        (("--wrong", 2), "--wrong: must be ≥ 0 and ≤ 1"),
        (("--state-query", "bald"), "--state-query: unknown name 'bald'"),
    ],
)
def test_mistakes_are_told_in_one_line_and_leave_nothing(refused, arguments, words):
    assert words in refused(story, *arguments)
