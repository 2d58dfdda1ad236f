from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from diagrams.decisions import Step
from diagrams.monitor import Loads
from diagrams.policy_controller import Episode
from diagrams.policy_run import Played
from experiments.grasping.exporting import export_episodes
from experiments.kit.shipped_data import load_planner
from irl.errors import InputError
from models.export.precomputed import require_precomputed
from models.motion.failures import ActionFailure
from models.motion.moves import Grip
from models.scenes.gripper import MAX_OPENING
from models.scenes.planning_scene import HOME
from models.task.spaces import GOAL_POSITION, POSITIONS, REST_HEIGHT, Action, Kind, State

FAR = State(14, 0)
NONE = Loads(*np.zeros((4, 7)), 0)


@pytest.fixture(scope="module")
def played():
    """An episode as far as it is planned: grasp, carry, drop; nothing is simulated."""
    planner = load_planner()
    q, plans = HOME, []
    for action, cell, hand in (
        (Action(Kind.GRASP, 10), 14, None),
        (Action(Kind.TRANSLATE, GOAL_POSITION), 14, 10),
        (Action(Kind.DROP), GOAL_POSITION, 10),
    ):
        height = REST_HEIGHT if hand is None else POSITIONS[cell][2]
        p_WO = np.array([*POSITIONS[cell][:2], height])
        width = MAX_OPENING if hand is None else 0.0
        plans.append(planner.plan(action, cell, hand, q, width, RigidTransform(p_WO)))
        q = plans[-1][-1].waypoints[-1]
    return Played(FAR.index, Episode(), 20.0, np.zeros((1, 7)), NONE, plans=tuple(plans))


def test_an_episode_becomes_files_that_the_arm_takes(tmp_path, played):
    broken = Played(FAR.index, Episode(), 0.0, np.zeros((1, 7)), NONE, fault="the solver gave up")
    ended = Step(FAR.index, 10, FAR.index, 0.0, 1.0, ActionFailure.DISPLACED)
    stopped = replace(played, episode=Episode((ended,)))
    assert export_episodes(tmp_path / "e", [broken, played, stopped], 50.0) == ["episode_2"]
    folder = tmp_path / "e" / "episode_2"
    assert sorted(path.name for path in folder.iterdir()) == [
        *("gripper.csv", "precomputed.csv", "trajectory.csv", "trajectory.yaml")
    ]
    require_precomputed(folder / "precomputed.csv", HOME)
    commands = [line.split(",") for line in (folder / "gripper.csv").read_text().splitlines()[1:]]
    assert [float(width) for _, width, _ in commands] == [0.0, MAX_OPENING]
    # Where the gripper closes and opens, the arm stands where the plan says.
    table = np.loadtxt(folder / "trajectory.csv", delimiter=",", skiprows=1)
    grasp, carry, drop = played.plans
    close = next(i for i, part in enumerate(grasp) if isinstance(part, Grip) and part.width == 0.0)
    assert isinstance(drop[0], Grip)
    for (seconds, *_), q in zip(
        commands, (grasp[close - 1].waypoints[-1], carry[-1].waypoints[-1]), strict=True
    ):
        now = np.abs(table[:, 0] - float(seconds) - 0.2).argmin()
        assert np.allclose(table[now, 1:8], q, atol=1e-6)
        assert np.allclose(table[now, 8:15], 0.0)
    assert np.allclose(table[[0, -1], 1:8], HOME, atol=1e-6)


def test_a_folder_that_cannot_be_written_is_named(tmp_path, played):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"--export: .*file: cannot be written"):
        export_episodes(tmp_path / "file", [played], 50.0)
