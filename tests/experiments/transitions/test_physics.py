"""What is told of the physics follows from the trials, here made up."""

import numpy as np
import pytest

from diagrams.trials.counts import transition_entries
from diagrams.trials.record import Outcome, Pair, Trial, TrialRecord
from experiments.kit.command import Output
from experiments.kit.shipped_data import load_feasibility
from experiments.transitions.coverage import coverage_by_gripper, plot_coverage, print_coverage
from experiments.transitions.physics import physics, print_physics
from models.task.estimate import rotated_orientations
from models.task.spaces import R_WG, Action, Kind, State
from models.task.trial_classes import trial_classes

CLASSES = trial_classes()
DROP = Action(Kind.DROP).index


def tried(kind, gripper=10, orientation=0):
    """The pair that stands for a class, and its number."""
    state = State(8, orientation, None if kind == Kind.GRASP else gripper)
    target = {Kind.GRASP: gripper, Kind.TRANSLATE: 3, Kind.ROTATE: 0, Kind.DROP: None}[kind]
    number = int(CLASSES.number(state.index, Action(kind, target).index))
    return Pair(*(int(part) for part in CLASSES.tried(number, 0))), number


@pytest.fixture(scope="module")
def told():
    over = TrialRecord(Outcome.FREE, turn=(np.pi / 2, 0.0, 0.0), displacement=(0.0, 0.03, 0.0))
    level = TrialRecord(Outcome.FREE, turn=(0.0, 0.0, 0.02), drift=0.002)
    fault = TrialRecord(Outcome.FAULT, fault="solver")
    drop, number = tried(Kind.DROP)
    # Fell over in three of four: what geometry did not say.
    trials = [Trial(drop, r, over if r < 3 else level) for r in range(4)]
    trials.append(Trial(drop, 4, fault))
    turn, _ = tried(Kind.ROTATE)
    after = State.from_index(turn.state), Action.from_index(turn.action)
    rigid = R_WG[after[1].target] @ R_WG[after[0].gripper].T
    angle = np.arccos((np.trace(rigid) - 1) / 2)
    axis = np.array(
        [rigid[2, 1] - rigid[1, 2], rigid[0, 2] - rigid[2, 0], rigid[1, 0] - rigid[0, 1]]
    )
    vector = tuple((angle * axis / np.linalg.norm(axis)).tolist())
    trials.append(Trial(turn, 0, TrialRecord(Outcome.HELD, turn=vector)))
    entries = transition_entries(load_feasibility().mask(), trials, CLASSES)
    return number, turn, physics(trials, entries, CLASSES), entries


def test_a_class_is_told_by_what_became_of_its_cube(told, capsys):
    number, _, result, _ = told
    print_physics(result)
    assert "vertical" in capsys.readouterr().out
    (row,) = result["classes"]
    assert (row["class"], row["kind"], row["trials"], row["layer"]) == (number, "drop", 4, 0)
    assert row["face_kept"] == row["orientation_kept"] == 0.25
    assert row["commonest"][0] == 0.75 and row["commonest"][1] < 0.75 < row["commonest"][2]
    assert row["held"] == 0.0
    assert row["off_flush_deg"] == pytest.approx(0.0, abs=1e-6)


def test_pairs_that_end_where_geometry_did_not_say_are_counted(told):
    _, _, result, entries = told
    drop = result["estimate"]["drop"]
    tried_drops = np.unique(entries.state[(entries.evidence < 2) & (entries.action == DROP)]).size
    assert drop["pairs"] == drop["changed"] == tried_drops > 100
    assert drop["distance"] == pytest.approx(0.75)
    assert result["estimate"]["grasp"] == {"pairs": 0, "changed": 0, "distance": 0.0}


def test_a_rigid_turn_is_what_geometry_says(told):
    _, turn, result, _ = told
    state, action = State.from_index(turn.state), Action.from_index(turn.action)
    ties = rotated_orientations()[0][state.gripper, action.target, state.orientation] > 1
    (name,) = result["rotations"]
    assert name == ("two equally near" if ties else "one nearest orientation")
    assert result["rotations"][name]["foretold"] == result["rotations"][name]["held"] == 1.0
    assert result["estimate"]["rotate"]["changed"] == 0


def test_coverage_is_told_by_gripper(told, tmp_path, capsys):
    entries = told[3]
    rows = coverage_by_gripper(entries)
    total = sum(row[kind.name.lower()]["pairs"] for row in rows for kind in Kind)
    assert total == int(load_feasibility().mask().sum())
    assert rows[0]["grasp"] == {"pairs": 0, "tried": 0, "certainty": None}
    assert 0 < rows[10]["drop"]["tried"] <= rows[10]["drop"]["pairs"]
    assert rows[10]["drop"]["certainty"] < rows[0]["drop"]["certainty"] == 1.0
    counts = {"drop": {"measured": 1, "kernel": 2, "estimated": 3}}
    print_coverage(counts, rows)
    assert "vertical, turned 0°" in capsys.readouterr().out
    with Output(tmp_path, None).figure("c.png") as figure:
        plot_coverage(figure, entries)
    assert (tmp_path / "c.png").stat().st_size > 10_000
