"""``experiments.reachability --robot gen3_lite``, as a user runs it."""

import json

from experiments.kit.command import execute
from experiments.reachability import gen3_lite as gen3_lite_map
from experiments.reachability import story as reachability
from models.maps.lite_csv import read_map


def test_command_leaves_map_figures_and_picture(tmp_path, monkeypatch):
    monkeypatch.setattr(gen3_lite_map, "RANDOM_POSES", 30)
    arguments = ["--robot", "gen3_lite", "--out", str(tmp_path)]
    execute(reachability.Config, reachability.main, arguments)
    result = json.loads((tmp_path / "result.json").read_text())
    assert (result["reachable"], result["total"]) == (162, 324)
    assert result["values"] == {"0": 162, "1": 162, "2": 0}
    assert sum(result["failures"].values()) == 162
    assert result["solves_per_s"] > 0
    stages = result["ik_stages"]
    assert stages["polynomial"]["poses_solved"] == 30
    assert stages["fine_tuning"]["poses_whose_own_joints_return"] == 30
    assert stages["fine_tuning"]["error_max"] < 1e-11 < stages["polynomial"]["error_median"]
    assert len(read_map(tmp_path / "map.csv")) == 324
    assert (tmp_path / "reachability.png").stat().st_size > 10_000
    assert "gen3_lite" in (tmp_path / "config.yaml").read_text()


def test_the_workspace_grid_is_the_gen3s(refused):
    assert "--grid: unknown name 'workspace'" in refused(
        reachability, "--robot", "gen3_lite", "--grid", "workspace"
    )
