"""The arm of a whole station: its weight, its limits, what it is commanded."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from diagrams.arm_controller import JOINTS, control_model
from diagrams.station import TIME_STEP, Station
from models.errors import ModelError
from models.scenes.parsing import ARM, GRIPPER
from models.scenes.planning_scene import HOME

ASIDE = RigidTransform([0.5, 0.15, 0.52])
SPEED = np.array([1.3963] * 4 + [1.2218] * 3)
TORQUE = np.array([39.0] * 4 + [9.0] * 3)


@pytest.fixture(scope="module")
def station():
    return Station()


def started(station, q=HOME):
    simulator = Simulator(station)
    root = simulator.get_mutable_context()
    station.initialize(root, X_WO=ASIDE, q=q)
    station.GetInputPort("gripper.position_command").FixValue(root, [0.085])
    command = station.GetInputPort("arm.position_command").FixValue(root, q)
    return simulator, root, command


def measured(station, root, name):
    return station.GetOutputPort(f"arm.{name}").Eval(root)


def weight(station, q):
    """Joint torques ``[7]`` [N m] that hold the robot: slopes of its centre of mass' height."""
    plant, mount = station.plant, station.mount
    robot = [plant.GetModelInstanceByName(name) for name in (ARM, GRIPPER)]
    bodies = [plant.get_body(i) for each in robot for i in plant.GetBodyIndices(each)]
    mass = sum(body.default_mass() for body in bodies)
    context = plant.CreateDefaultContext()

    def height(q):
        plant.SetPositions(context, robot[0], q)
        mount.place(context)
        return plant.CalcCenterOfMassPositionInWorld(context, robot)[2]

    step = 1e-5 * np.eye(7)
    return 9.81 * mass * np.array([height(q + d) - height(q - d) for d in step]) / 2e-5


def test_the_torques_measured_are_those_that_carry_arm_and_hand(station):
    rng = np.random.default_rng(0)
    stretched = np.array([0.0, np.pi / 2, 0.0, 0.0, 0.0, 0.0, 0.0])
    postures = [stretched, *(HOME + rng.normal(0.0, [0.4] * 7, (2, 7)))]
    for q in postures:
        simulator, root, _ = started(station, q)
        simulator.AdvanceTo(0.1)
        torque = measured(station, root, "torque_measured")
        assert torque == pytest.approx(weight(station, q), abs=0.05)
        assert measured(station, root, "position_measured") == pytest.approx(q, abs=1e-4)
        assert measured(station, root, "limited_samples") == 0
    # Stretched level, the shoulder needs four fifths of what it has for the weight alone.
    assert 0.75 < torque_share(station, stretched) < 0.85


def torque_share(station, q):
    return np.abs(weight(station, q) / TORQUE).max()


def test_the_controllers_own_model_is_the_robot_with_its_hand_wherever_it_stands(station):
    plant = station.plant
    arm, hand = (plant.GetModelInstanceByName(name) for name in (ARM, GRIPPER))
    model = control_model(plant, station.mount)
    mass = sum(
        plant.get_body(i).default_mass() for each in (arm, hand) for i in plant.GetBodyIndices(each)
    )
    assert model.CalcTotalMass(model.CreateDefaultContext()) == pytest.approx(mass)
    assert model.num_positions() == 7
    context = model.CreateDefaultContext()
    for q in np.random.default_rng(1).uniform(-2.0, 2.0, (5, 7)):
        model.SetPositions(context, q)
        told = -model.CalcGravityGeneralizedForces(context)
        assert told == pytest.approx(weight(station, q), abs=1e-4)


def test_what_the_hand_holds_is_felt(station):
    """A load that the controller does not know: it sags by torque over stiffness."""
    simulator, root, _ = started(station)
    simulator.AdvanceTo(0.2)
    before = measured(station, root, "torque_measured")
    plant = station.plant
    hand = plant.GetBodyByName("base", plant.GetModelInstanceByName(GRIPPER))
    heavier = hand.default_mass() + 0.5
    hand.SetMass(plant.GetMyMutableContextFromRoot(root), heavier)
    simulator.AdvanceTo(1.0)
    more = measured(station, root, "torque_measured") - before
    off = HOME - measured(station, root, "position_measured")
    assert np.abs(more).max() > 1.5
    assert off * np.array([4000.0] * 4 + [1000.0] * 3) == pytest.approx(more, abs=0.01)
    assert np.abs(off).max() < 1e-3


@pytest.mark.parametrize("joint", [0, 1, 5])
def test_a_radian_away_the_arm_gets_there_within_its_limits(station, joint):
    simulator, root, command = started(station)
    there = HOME.copy()
    there[joint] += -1.0 if joint == 1 else 1.0
    command.GetMutableData().set_value(there)
    fastest, passed = np.zeros(7), 0.0
    while root.get_time() < 1.4:
        simulator.AdvanceTo(root.get_time() + 0.004)
        fastest = np.maximum(fastest, np.abs(measured(station, root, "velocity_measured")))
        way = (measured(station, root, "position_measured") - HOME) / (there - HOME)[joint]
        passed = max(passed, way[joint] - 1.0)
    assert (fastest <= SPEED).all()
    assert fastest[joint] > 0.95 * SPEED[joint]
    assert passed < 2e-3
    assert measured(station, root, "position_measured") == pytest.approx(there, abs=1e-3)
    limited = measured(station, root, "limited_samples")[0] * TIME_STEP
    assert 0.8 < limited < 1.3


def test_another_winding_of_a_joint_moves_nothing(station):
    simulator, root, command = started(station)
    command.GetMutableData().set_value(HOME + 2.0 * np.pi * np.array([0, 0, 0, 0, 0, 0, -1]))
    simulator.AdvanceTo(0.2)
    assert measured(station, root, "position_measured") == pytest.approx(HOME, abs=1e-5)
    assert measured(station, root, "velocity_measured") == pytest.approx(np.zeros(7), abs=1e-3)


def test_wild_commands_move_the_arm_within_its_speed(station):
    rng = np.random.default_rng(2)
    simulator, root, command = started(station)
    fastest = np.zeros(7)
    for _ in range(12):
        wild = HOME + rng.normal(0.0, 10.0 ** rng.uniform(-3, 1, 7))
        wild[[1, 3, 5]] = np.clip(wild[[1, 3, 5]], HOME[[1, 3, 5]] - 0.3, HOME[[1, 3, 5]] + 0.3)
        command.GetMutableData().set_value(wild)
        for _ in range(rng.integers(5, 25)):
            simulator.AdvanceTo(root.get_time() + 0.004)
            fastest = np.maximum(fastest, np.abs(measured(station, root, "velocity_measured")))
    assert (fastest <= 1.005 * SPEED).all()
    assert (fastest > 0.3).any()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e9])
def test_a_command_that_is_no_angle_ends_a_simulation_by_port_and_time(station, bad):
    simulator, _, command = started(station)
    simulator.AdvanceTo(0.01)
    wrong = HOME.copy()
    wrong[2] = bad
    command.GetMutableData().set_value(wrong)
    with pytest.raises(ModelError, match=r"^arm\.position_command at 0\.01\d s: joint_3 ") as error:
        simulator.AdvanceTo(0.1)
    assert "valid: angles within" in str(error.value)
    assert JOINTS[2] in str(error.value)
