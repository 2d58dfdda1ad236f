import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialForce, SpatialVelocity
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import EventStatus

from diagrams.contact import set_friction
from diagrams.falls.scene import Fall, FallScene, Hand, travel
from diagrams.falls.station import StationSimulator
from diagrams.station import Station
from models.scenes import gripper
from models.scenes.parsing import CUBE
from models.scenes.planning_scene import HOME
from models.task.spaces import REST_HEIGHT, TABLE_TOP

AWAY = Hand(RigidTransform([0.0, 0.0, 2.0]), 0.0)
DOWN = SpatialVelocity([0.0, 0.0, 0.0], [0.0, 0.0, -0.5])
TILTED = RigidTransform(RotationMatrix.MakeYRotation(0.15), [0.55, 0.0, 0.57])


@pytest.fixture(scope="module")
def station():
    return Station()


@pytest.fixture(scope="module")
def scene():
    return FallScene(edge=True)


def begin(station, scene, X_WO, V_WO=None, command=gripper.MAX_OPENING, friction=0.8):
    """A simulation with the hand at home, far from the cube."""
    simulator = Simulator(station)
    root = simulator.get_mutable_context()
    set_friction(station.plant, station.scene_graph, root, friction)
    station.initialize(root, X_WO=X_WO)
    station.GetInputPort("arm.position_command").FixValue(root, HOME)
    station.GetInputPort("gripper.position_command").FixValue(root, [command])
    plant = station.plant
    context = plant.GetMyMutableContextFromRoot(root)
    cube = plant.GetBodyByName(CUBE)
    plant.SetFreeBodySpatialVelocity(
        context=context, body=cube, V_JpJc=V_WO or SpatialVelocity.Zero()
    )
    simulator.Initialize()
    return StationSimulator(simulator, plant, scene), simulator


def pose(station, simulator):
    return station.GetOutputPort("object.pose").Eval(simulator.get_context())


@pytest.mark.parametrize("friction", [0.3, 0.8])
def test_a_cube_in_the_air_falls_as_in_the_scene(station, scene, friction):
    simulation, simulator = begin(station, scene, TILTED, DOWN, friction=friction)
    simulation.advance_to(0.25)
    alone = Fall(scene, TILTED, DOWN, friction=friction, mass=0.1, restitution=0.5)
    alone.advance(0.25, AWAY, AWAY)
    # The integrator's steps differ.
    assert travel(pose(station, simulator), alone.X_WO) < 2e-3

    coarse, simulator = begin(station, None, TILTED, DOWN, friction=friction)
    coarse.advance_to(0.25)
    assert travel(pose(station, simulator), alone.X_WO) > 4e-3


def test_it_comes_to_rest_and_stays(station, scene):
    simulation, simulator = begin(station, scene, TILTED, DOWN)
    simulation.advance_to(1.4)
    before = pose(station, simulator)
    assert before.translation()[2] == pytest.approx(REST_HEIGHT, abs=1e-4)
    simulation.advance_to(1.7)
    assert travel(before, pose(station, simulator)) < 1e-4
    assert simulation.falling is False


def test_nothing_changes_where_nothing_falls(station, scene):
    lying = RigidTransform([0.5, 0.1, REST_HEIGHT])
    states = []
    for where in (scene, None):
        simulation, simulator = begin(station, where, lying, command=0.0)
        simulation.advance_to(0.3)
        states.append(station.GetOutputPort("state").Eval(simulator.get_context()))
    np.testing.assert_array_equal(*states)


def test_fingers_that_close_have_the_cube_to_themselves(station, scene):
    simulation, _ = begin(station, scene, TILTED, DOWN, command=0.0)
    simulation.advance_to(0.05)
    assert not simulation.falling


def test_a_cube_that_misses_the_table_is_let_go_of(station, scene):
    beside = RigidTransform([0.8, 0.0, TABLE_TOP + 0.1])
    simulation, simulator = begin(station, scene, beside, DOWN)
    simulation.advance_to(0.05)
    assert simulation.falling
    simulation.advance_to(0.6)
    assert not simulation.falling
    assert pose(station, simulator).translation()[2] < 0.0


def test_a_monitor_ends_it(station, scene):
    simulation, simulator = begin(station, scene, TILTED, DOWN)
    simulator.set_monitor(
        lambda context: (
            EventStatus.ReachedTermination(station, "enough")
            if context.get_time() > 0.013
            else EventStatus.DidNothing()
        )
    )
    simulation.advance_to(1.0)
    assert simulation.time == pytest.approx(0.015)
    assert pose(station, simulator).translation()[2] < 0.57


def test_what_another_force_acts_on_is_the_stations(station, scene):
    simulation, simulator = begin(station, scene, TILTED, DOWN)
    port, root = station.GetInputPort("spatial_forces"), simulator.get_mutable_context()
    pull = ExternallyAppliedSpatialForce()
    pull.F_Bq_W = SpatialForce([0.0, 0.0, 0.0], [0.0, 0.0, 3.0])

    def ask(body):
        pull.body_index = body.index()
        port.FixValue(root, [pull])

    plant = station.plant
    ask(plant.GetBodyByName(CUBE))
    simulation.advance_to(0.1)
    assert not simulation.falling
    assert pose(station, simulator).translation()[2] > TABLE_TOP + 0.04  # 3 N carry 0.1 kg

    ask(plant.GetBodyByName("left_inner_finger"))
    simulation.advance_to(0.12)
    assert simulation.falling
    ask(plant.GetBodyByName(CUBE))
    simulation.advance_to(0.14)
    assert not simulation.falling
