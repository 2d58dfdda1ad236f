"""What disturbances do to the plant: by forces, parameters and signals alone."""

from copy import copy
from itertools import pairwise

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from diagrams.scenarios import DisturbedStation, draw, load_scenario
from diagrams.scenarios.draws import within_reach
from diagrams.scenarios.schema import parse_scenario
from diagrams.scenarios.unseen_hand import shove
from diagrams.station import Station
from models.rotations import geodesic_angle
from models.scenes.planning_scene import HOME

X_WO = RigidTransform([0.55, 0.0, 0.52])
KEY = (3, 1, 0)


class Still:
    """A disturbed station whose arm is told to stay, with its fingers so far apart."""

    def __init__(self, scenario, width=0.085, key=KEY, X_WO=X_WO):
        builder = DiagramBuilder()
        self.station = builder.AddNamedSystem("station", DisturbedStation(scenario))
        self.commands = {}
        for name, value in (("arm", HOME), ("gripper", [width])):
            source = builder.AddSystem(ConstantVectorSource(value))
            port = self.station.GetInputPort(f"{name}.position_command")
            builder.Connect(source.get_output_port(), port)
            self.commands[name] = source
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        self.root = self.simulator.get_mutable_context()
        self.draws = draw(scenario, key)
        self.station.initialize(self.root, self.draws, X_WO=X_WO, width=0.085)
        self.context = self.station.plant.GetMyContextFromRoot(self.root)

    def pose(self, body="cube"):
        return copy(self.station.plant.GetBodyByName(body).EvalPoseInWorld(self.context))

    def output(self, name):
        own = self.station.GetMyContextFromRoot(self.root)
        return copy(self.station.GetOutputPort(name).Eval(own))

    def hand(self):
        return self.station.plant.GetFrameByName("tcp").CalcPoseInWorld(self.context)


def test_a_shove_moves_and_turns_the_cube_on_the_table_by_a_force():
    still = Still(load_scenario("push"))
    lead = shove(np.random.default_rng(1))
    still.station.hand.now(still.root, lead)
    steps = []
    for _ in range(80):
        still.simulator.AdvanceTo(still.root.get_time() + 0.01)
        steps.append(still.pose())
    moved = np.linalg.norm(steps[-1].translation() - X_WO.translation())
    turned = geodesic_angle(steps[-1].rotation().matrix(), np.eye(3))
    assert moved == pytest.approx(lead.distance, abs=0.003)
    assert turned == pytest.approx(abs(lead.turn), abs=0.08)
    # It stays flat, and nowhere jumps.
    assert max(abs(X.translation()[2] - 0.52) for X in steps) < 1e-3
    assert (
        max(np.linalg.norm(b.translation() - a.translation()) for a, b in pairwise(steps)) < 0.003
    )
    done = still.station.disturbance(still.root)
    assert done.done[0].acted and done.done[0].distance == pytest.approx(moved, abs=1e-3)


def test_what_the_cube_does_not_allow_is_left_and_counts_as_not_acted():
    still = Still(parse_scenario("slip: { distance: 0.01 }", "slip"))
    (lead,) = still.draws.leads
    still.station.hand.now(still.root, lead)
    disturbance = still.station.disturbance(still.root)
    assert not disturbance.acted and not disturbance.done[0].acted
    waiting = Still(load_scenario("yank"))
    assert not waiting.station.disturbance(waiting.root).acted


def held(scenario):
    """The cube in the closed hand, as high as the hand is."""
    plant = Station().plant
    context = plant.CreateDefaultContext()
    arm = plant.GetModelInstanceByName("arm")
    plant.SetPositions(context, arm, HOME)
    flange = plant.GetBodyByName("end_effector_link", arm).EvalPoseInWorld(context)
    R_FG = RotationMatrix.MakeZRotation(-np.pi / 2)
    X_WG = flange @ RigidTransform(R_FG, [0.0, 0.0, 0.1425])
    still = Still(scenario, width=0.0, X_WO=X_WG)
    body = still.station.plant.GetBodyByName("cube")
    # Until the fingers have closed, nothing falls.
    body.Lock(still.station.plant.GetMyMutableContextFromRoot(still.root))
    still.simulator.AdvanceTo(1.2)
    body.Unlock(still.station.plant.GetMyMutableContextFromRoot(still.root))
    return still


def test_a_slip_moves_the_held_cube_in_the_hand_which_holds_it_again():
    still = held(parse_scenario("slip: { distance: 0.015, turn: 15, wait: 1.6 }", "slip"))
    before = still.hand().inverse() @ still.pose()
    still.simulator.AdvanceTo(2.6)
    (done,) = still.station.disturbance(still.root).done
    assert done.acted and done.ended - done.began < 1.0
    after = still.hand().inverse() @ still.pose()
    moved = np.linalg.norm(after.translation() - before.translation())
    assert 0.011 < moved < 0.019
    turned = np.degrees(geodesic_angle(after.rotation().matrix(), before.rotation().matrix()))
    assert 11.0 < turned < 19.0


def test_parameters_lie_in_the_context_of_one_episode():
    still = Still(parse_scenario("mass: 0.5\nfriction: 0.3", "both"))
    body = still.station.plant.GetBodyByName("cube")
    assert body.get_mass(still.context) == pytest.approx(0.5)
    assert body.default_mass() == pytest.approx(0.1)
    fresh = still.diagram.CreateDefaultContext()
    plant_context = still.station.plant.GetMyContextFromRoot(fresh)
    assert body.get_mass(plant_context) == pytest.approx(0.1)


def test_a_weak_joint_has_less_torque_from_construction_on():
    weak, usual = (
        plant.GetJointActuatorByName("joint_4").effort_limit()
        for plant in (DisturbedStation(load_scenario("weak_joint")).plant, Station().plant)
    )
    assert weak == pytest.approx(0.6 * usual)


def test_the_base_stands_elsewhere_with_arm_and_hand_on_it():
    still, usual = Still(load_scenario("base")), Still(load_scenario("posture"))
    X_BB = still.draws.X_BB
    X_WB = RigidTransform([0.0, 0.0, 0.5])
    for body in ("base_link", "bracelet_link"):
        expected = X_WB @ X_BB @ X_WB.inverse() @ usual.pose(body)
        assert still.pose(body).IsNearlyEqualTo(expected, 1e-9)
    moved = X_WB @ X_BB @ X_WB.inverse() @ usual.hand()
    assert still.hand().IsNearlyEqualTo(moved, 1e-9)
    assert still.pose().IsExactlyEqualTo(X_WO)


def test_noise_is_measured_and_named_but_not_simulated():
    still = Still(load_scenario("noise"))
    seen = []
    for time in (0.05, 0.09, 0.15, 0.25):
        still.simulator.AdvanceTo(time)
        seen.append(still.output("object.pose"))
        assert still.pose().IsNearlyEqualTo(X_WO, 1e-4)
    gap = [np.linalg.norm(X.translation() - still.pose().translation()) for X in seen]
    assert min(gap) > 1e-4 and max(gap) < 0.03
    assert seen[0].IsNearlyEqualTo(seen[1], 1e-6)
    assert not seen[1].IsNearlyEqualTo(seen[2], 1e-4)
    # A cube just on the grid is lost to those who see it beside it.
    edge = Still(
        parse_scenario("noise: { position: 0.1, turn: 0 }", "far"),
        X_WO=RigidTransform([0.62, 0.149, 0.52]),
    )
    edge.simulator.AdvanceTo(0.01)
    X = edge.output("object.pose").translation()
    lost = not (0.475 <= X[0] <= 0.625 and -0.15 <= X[1] <= 0.15)
    assert (edge.output("task.state")[0] == 15984) == lost


def test_commands_arrive_late_and_the_arm_stays_until_they_do():
    still = Still(load_scenario("delay"), width=0.0)
    still.simulator.AdvanceTo(0.048)
    assert still.output("gripper.position_measured")[0] == pytest.approx(0.085, abs=1e-4)
    assert still.output("gripper.position_command_arriving") == [0.085]
    still.simulator.AdvanceTo(0.2)
    assert still.output("gripper.position_measured")[0] < 0.083
    assert still.output("gripper.position_command_arriving") == [0.0]
    np.testing.assert_array_equal(still.output("arm.position_command_arriving"), HOME)


def test_a_second_cube_lies_on_the_table():
    still = Still(load_scenario("distractor"))
    p = still.pose("second_cube").translation()
    assert 0.08 <= np.linalg.norm(p - X_WO.translation()) <= 0.15
    assert within_reach(p)
