import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from diagrams.gripper_controller import GRIP_FORCE
from diagrams.station import Station
from models.errors import ModelError
from models.scenes.planning_scene import HOME
from models.task.spaces import GOAL_STATE

CUBE_ASIDE = RigidTransform([0.5, 0.0, 0.52])


@pytest.fixture(scope="module")
def station():
    return Station()


def started(station, arm=HOME, width=0.085, command=None):
    simulator = Simulator(station)
    root = simulator.get_mutable_context()
    station.initialize(root, X_WO=CUBE_ASIDE, q=arm, width=width)
    station.GetInputPort("arm.position_command").FixValue(root, arm)
    station.GetInputPort("gripper.position_command").FixValue(
        root, [width if command is None else command]
    )
    return simulator, root


def measured(station, root, name):
    return station.GetOutputPort(name).Eval(root)


def test_ports_bear_the_names_that_hardware_would(station):
    inputs = {station.get_input_port(i).get_name() for i in range(station.num_input_ports())}
    outputs = {station.get_output_port(i).get_name() for i in range(station.num_output_ports())}
    # Hardware has no port for pushes from outside: whoever stands beside it does that.
    assert inputs - {"spatial_forces"} == {"arm.position_command", "gripper.position_command"}
    assert outputs >= {
        "arm.position_measured",
        "arm.velocity_measured",
        "gripper.position_measured",
        "gripper.force_measured",
        "object.pose",
        "task.state",
    }


def test_holds_still_when_told_to(station):
    simulator, root = started(station)
    simulator.AdvanceTo(0.3)
    assert measured(station, root, "arm.position_measured") == pytest.approx(HOME, abs=1e-6)
    assert measured(station, root, "arm.velocity_measured") == pytest.approx(np.zeros(7), abs=1e-4)
    assert measured(station, root, "gripper.position_measured") == pytest.approx([0.085], abs=1e-4)
    assert measured(station, root, "task.state") == [GOAL_STATE]
    assert measured(station, root, "object.pose").translation() == pytest.approx(
        CUBE_ASIDE.translation(), abs=1e-4
    )


def test_arm_and_gripper_follow_their_commands(station):
    simulator, root = started(station, command=0.02)
    station.GetInputPort("arm.position_command").FixValue(root, HOME + 0.01)
    simulator.AdvanceTo(1.6)
    assert measured(station, root, "arm.position_measured") == pytest.approx(HOME + 0.01, abs=1e-4)
    assert measured(station, root, "gripper.position_measured") == pytest.approx([0.02], abs=2e-4)


def test_a_closed_gripper_stops_at_its_end_without_grip_force(station):
    simulator, root = started(station, width=0.01, command=0.0)
    simulator.AdvanceTo(0.5)
    assert measured(station, root, "gripper.position_measured")[0] < 0.003
    assert abs(measured(station, root, "gripper.force_measured")[0]) < 0.25 * GRIP_FORCE


@pytest.mark.parametrize("time_step", [0.0, -0.001, np.nan, np.inf, "short", None])
def test_a_time_step_is_above_zero(time_step):
    with pytest.raises(ModelError, match="time_step"):
        Station(time_step=time_step)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"q": HOME[:6]}, "q has shape"),
        ({"q": HOME * np.nan}, "q holds a value that is not finite"),
        ({"q": "home"}, "q: 'home'; wanted real numbers"),
        ({"width": np.nan}, "width: nan"),
        ({"width": "wide"}, "width: 'wide'"),
        ({"X_WO": np.eye(4)}, "X_WO: ndarray; valid"),
        ({"X_WO": RigidTransform([np.nan, 0.0, 0.0])}, "X_WO holds a value that is not finite"),
    ],
)
def test_a_start_that_is_none_is_refused_before_anything_moves(station, options, message):
    root = station.CreateDefaultContext()
    station.initialize(root, X_WO=CUBE_ASIDE)
    before = station.plant.GetPositions(station.plant.GetMyContextFromRoot(root))
    with pytest.raises(ModelError, match=message):
        station.initialize(root, **{"X_WO": CUBE_ASIDE, **options})
    after = station.plant.GetPositions(station.plant.GetMyContextFromRoot(root))
    np.testing.assert_array_equal(after, before)


def test_an_opening_is_a_number(station):
    simulator, root = started(station)
    station.GetInputPort("gripper.position_command").FixValue(root, [np.nan])
    with pytest.raises(ModelError, match=r"gripper.position_command at 0\.000 s: nan"):
        simulator.AdvanceTo(0.01)


def test_a_wrong_opening_ends_a_running_simulation_by_port_and_time(station):
    simulator, root = started(station)
    command = station.GetInputPort("gripper.position_command").FixValue(root, [0.085])
    simulator.AdvanceTo(0.01)
    command.GetMutableData().set_value([np.inf])
    with pytest.raises(ModelError, match=r"^gripper\.position_command at 0\.01\d s: inf"):
        simulator.AdvanceTo(0.1)


@pytest.mark.parametrize("force", [20.0, 80.0])
def test_the_grip_is_as_strong_as_asked(force):
    station = Station(grip_force=force)
    simulator = Simulator(station)
    root = simulator.get_mutable_context()
    # In the air between the pads, before it falls.
    held = station.plant.GetFrameByName("tcp").CalcPoseInWorld(_at_home(station))
    station.initialize(root, X_WO=held, width=0.0401)
    station.GetInputPort("arm.position_command").FixValue(root, HOME)
    station.GetInputPort("gripper.position_command").FixValue(root, [0.0])
    simulator.AdvanceTo(0.4)
    assert measured(station, root, "gripper.force_measured") == pytest.approx([force], rel=0.02)


def _at_home(station):
    context = station.plant.CreateDefaultContext()
    station.plant.SetPositions(context, station.plant.GetModelInstanceByName("arm"), HOME)
    station.mount.place(context)
    return context


@pytest.mark.parametrize("force", [0.0, 19.0, 236.0, -40.0, np.nan, "firm"])
def test_a_grip_that_the_gripper_cannot_do_is_refused(force):
    with pytest.raises(ModelError, match=r"grip_force: .*; valid: 20 to 235 N"):
        Station(grip_force=force)
