from dataclasses import replace

import pytest

from diagrams.trials.arm import ArmRig, run_arm_trial
from diagrams.trials.record import Outcome, Pair, TrialConfig
from experiments.kit.shipped_data import load_planner
from models.task.spaces import Action, Kind, State


@pytest.fixture(scope="module")
def rig():
    return ArmRig(load_planner(), TrialConfig())


def test_the_whole_arm_does_what_the_state_names(rig):
    move = Pair(State(8, 0, 10).index, Action(Kind.TRANSLATE, 9).index)
    first = run_arm_trial(rig, TrialConfig(), move, 5)
    assert first.outcome == Outcome.HELD
    assert first.next_state == State(9, 0, 10).index
    assert first.pad_force == pytest.approx(40.0, rel=0.05)

    drop = run_arm_trial(rig, TrialConfig(), Pair(move.state, Action(Kind.DROP).index), 5)
    assert (drop.outcome, drop.next_state) == (Outcome.FREE, State(8, 0).index)
    assert abs(drop.lift_height) < 1e-3

    # The same bits, whatever ran before.
    again = run_arm_trial(rig, TrialConfig(), move, 5)
    assert replace(again, cpu_s=0.0) == replace(first, cpu_s=0.0)


def test_a_cube_that_is_let_go_falls_by_the_solver_of_the_trial(rig):
    drop = Pair(State(17, 0, 10).index, Action(Kind.DROP).index)
    fine = run_arm_trial(rig, TrialConfig(restitution=(0.6, 0.6)), drop, 3)
    discrete = TrialConfig(solver="discrete")
    coarse = run_arm_trial(ArmRig(load_planner(), discrete), discrete, drop, 3)
    assert coarse.outcome == fine.outcome == Outcome.FREE
    assert abs(fine.lift_height) < 1e-3
    # It rebounds, and rolls on.
    assert coarse.drift < 0.005 < fine.drift


def test_a_motion_that_cannot_be_planned_is_a_fault_and_says_why(rig):
    stay = Pair(State(8, 0, 10).index, Action(Kind.TRANSLATE, 8).index)
    record = run_arm_trial(rig, TrialConfig(), stay, 0)
    assert record.outcome == Outcome.FAULT
    assert "already" in record.fault


def test_a_state_out_of_reach_is_a_fault_and_says_so(rig, monkeypatch):
    monkeypatch.setattr(rig.planner, "posture", lambda position, gripper: None)
    drop = Pair(State(8, 0, 10).index, Action(Kind.DROP).index)
    record = run_arm_trial(rig, TrialConfig(), drop, 0)
    assert (record.outcome, record.draws) == (Outcome.FAULT, 1)
    assert "does not reach" in record.reason


def test_what_drake_cannot_simulate_is_a_fault_and_what_we_get_wrong_is_not(rig, monkeypatch):
    grasp = Pair(State(8, 0).index, Action(Kind.GRASP, 10).index)
    record = run_arm_trial(rig, TrialConfig(mass=(1e-300, 1e-300)), grasp, 0)
    assert record.outcome == Outcome.FAULT
    assert "NaN" in record.reason and "in _course" in record.fault

    def mistaken(*_):
        raise KeyError("ours")

    monkeypatch.setattr(rig.planner, "plan", mistaken)
    with pytest.raises(KeyError, match="ours"):
        run_arm_trial(rig, TrialConfig(), grasp, 0)
