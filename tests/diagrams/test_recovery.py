"""Actions that go wrong on the way, in physics: forces act on the cube while the arm moves."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from diagrams.action_executor import ActionExecutor
from diagrams.station import Station
from experiments.kit.shipped_data import load_planner
from models.maps.gripper_poses import gripper_pose
from models.motion.failures import ActionFailure
from models.scenes.planning_scene import HOME
from models.task.spaces import CUBE_EDGE, N_FREE, POSITIONS, Action, Kind, decode_states

MEASURED = (
    *("arm.position_measured", "gripper.position_measured", "gripper.force_measured"),
    *("task.state", "object.pose"),
)
COMMANDS = ("arm.position_command", "gripper.position_command")


class Rig:
    """Station and executor; a force may act on the cube."""

    def __init__(self, planner, *, watching=True):
        builder = DiagramBuilder()
        self.station = builder.AddSystem(Station())
        self.executor = builder.AddSystem(ActionExecutor(planner))
        for name in MEASURED if watching else ("task.state", "object.pose"):
            port = self.station.GetOutputPort(name)
            builder.Connect(port, self.executor.GetInputPort(name))
            if name == "object.pose" and watching:
                builder.Connect(port, self.executor.GetInputPort("object.pose_measured"))
        for name in COMMANDS:
            builder.Connect(self.executor.GetOutputPort(name), self.station.GetInputPort(name))
        builder.ExportInput(self.executor.GetInputPort("request"), "request")
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        self.root = self.simulator.get_mutable_context()
        self.plant = self.station.plant
        self.context = self.plant.GetMyMutableContextFromRoot(self.root)
        self.cube = self.plant.GetBodyByName("cube")
        self.force(np.zeros(3))

    def start(self, X_WO, q=HOME, width=0.085, command=0.085):
        self.station.initialize(self.root, X_WO=X_WO, q=q, width=width)
        own = self.executor.GetMyMutableContextFromRoot(self.root)
        self.executor.start_at(own, q, command)
        self.ask(0, -1)

    def ask(self, sequence, action):
        self.diagram.GetInputPort("request").FixValue(self.root, [sequence, action])

    def force(self, F_W):
        forces = np.zeros(self.plant.num_velocities())
        first = self.cube.floating_velocities_start_in_v()
        forces[first + 3 : first + 6] = F_W
        port = self.plant.get_applied_generalized_force_input_port()
        port.FixValue(self.context, forces)

    def run(self, seconds):
        self.simulator.AdvanceTo(self.root.get_time() + seconds)

    def run_until_finished(self, most=12.0):
        end = self.root.get_time() + most
        while self.root.get_time() < end:
            self.run(0.05)
            if self.execution.sequence and self.execution.finished:
                return self.execution
        raise AssertionError("it did not finish")

    @property
    def execution(self):
        return self.executor.execution(self.executor.GetMyContextFromRoot(self.root))

    @property
    def place(self):
        return self.cube.EvalPoseInWorld(self.context).translation().copy()

    def measured(self, name):
        context = self.station.GetMyContextFromRoot(self.root)
        return self.station.GetOutputPort(name).Eval(context)


@pytest.fixture(scope="module")
def planner():
    return load_planner()


def push(rig, towards, distance):
    """Push the cube as far along the table, by a force that lets go when it is there."""
    start = rig.place
    for _ in range(100):
        way = distance - float((rig.place - start) @ towards)
        if way < 5e-3:
            break
        velocity = rig.cube.EvalSpatialVelocityInWorld(rig.context).translational()
        # With as much as its weight the cube would tip.
        rig.force(towards * min(0.95, 1.0 + 40.0 * way - 4.0 * float(velocity @ towards)))
        rig.run(0.01)
    rig.force(np.zeros(3))


def test_a_cube_that_is_pushed_away_is_grasped_where_it_is_then(planner):
    rig = Rig(planner)
    rig.start(RigidTransform([0.55, 0.0, 0.52]))
    rig.run(0.1)
    rig.ask(1, Action(Kind.GRASP, 10).index)
    rig.run(0.3)
    push(rig, np.array([0.6, 0.8, 0.0]), 0.04)
    pushed = rig.root.get_time()
    assert np.linalg.norm(rig.place - [0.55, 0.0, 0.52]) > 0.025
    assert pushed < 1.0
    ended = rig.run_until_finished()
    assert ended.failure == ActionFailure.DISPLACED
    # Seen by the mean of five looks, and braked.
    assert rig.root.get_time() - pushed < 0.5 + 0.3 + 0.1
    assert np.abs(rig.measured("arm.velocity_measured")).max() < 0.02
    assert rig.station.GetOutputPort("arm.limited_samples").Eval(
        rig.station.GetMyContextFromRoot(rig.root)
    ) == [0.0]

    cell = int(decode_states(int(rig.measured("task.state")[0])).position)
    rig.ask(2, Action(Kind.GRASP, 10).index)
    assert rig.run_until_finished().failure is None
    assert rig.measured("task.state")[0] >= N_FREE
    assert rig.place == pytest.approx(POSITIONS[cell], abs=0.012)


@pytest.mark.parametrize("watching", [True, False])
def test_a_cube_that_is_pulled_out_of_the_hand_ends_the_action_where_that_is_watched(
    planner, watching
):
    rig, q = Rig(planner, watching=watching), planner.posture(1, 10)
    X_WO = gripper_pose(POSITIONS[1], 10)
    rig.start(X_WO, q, CUBE_EDGE + 1e-4, 0.0)
    rig.run(1.0)
    assert rig.measured("task.state")[0] >= N_FREE
    rig.ask(1, Action(Kind.TRANSLATE, 17).index)
    rig.run(0.3)
    rig.force(np.array([0.0, 0.0, -100.0]))
    rig.run(0.1)
    rig.force(np.zeros(3))
    ended = rig.run_until_finished()
    assert ended.failure == (ActionFailure.GRIP_LOST if watching else None)
    assert rig.measured("task.state")[0] < N_FREE
    # The arm has stopped on the way, or gone there with nothing.
    left = np.abs(rig.measured("arm.position_measured") - planner.posture(17, 10)).max()
    assert (left > 0.05) == watching


def test_an_arm_that_does_not_get_there_is_obstructed(planner):
    """A cube that is held back by more than the arm can pull."""
    rig, q = Rig(planner), planner.posture(9, 10)
    rig.start(gripper_pose(POSITIONS[9], 10), q, CUBE_EDGE + 1e-4, 0.0)
    rig.run(0.5)
    rig.ask(1, Action(Kind.TRANSLATE, 17).index)
    port = rig.plant.get_applied_generalized_force_input_port()
    forces = np.zeros(rig.plant.num_velocities())
    forces[rig.plant.GetJointByName("joint_1").velocity_start()] = -60.0
    rig.run(0.3)
    port.FixValue(rig.context, forces)
    while rig.execution.failure is None:
        rig.run(0.01)
    assert rig.execution.failure == ActionFailure.OBSTRUCTED
    # It is told to rest where it was, not where it was to be by then.
    own = rig.executor.GetMyContextFromRoot(rig.root)
    rest = rig.executor.GetOutputPort("arm.position_command").Eval(own).copy()
    assert np.abs(rig.measured("arm.position_measured") - rest).max() < 0.05
    rig.force(np.zeros(3))
    rig.run_until_finished()
    assert np.abs(rig.measured("gripper.position_measured") - CUBE_EDGE).max() < 5e-3
    rig.run(4.0)  # The arm had been thrown back.
    assert np.abs(rig.measured("arm.position_measured") - rest).max() < 0.01
