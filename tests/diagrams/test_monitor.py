import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from diagrams.monitor import ContactMonitor
from diagrams.state_identifier import LEAST_FORCE
from diagrams.station import Station
from models.scenes.planning_scene import HOME

BETWEEN, BESIDE = 0.0, 0.001
"""A cube in the middle between pads that are 39 mm apart, and one that only one of them touches."""


@pytest.mark.parametrize(
    ("force", "aside", "held"),
    [
        (40.0, BETWEEN, True),
        (LEAST_FORCE, BETWEEN, True),
        (LEAST_FORCE - 1.0, BETWEEN, False),  # being let go
        (-40.0, BETWEEN, False),
        (40.0, BESIDE, False),
    ],
)
def test_a_cube_is_held_by_fingers_that_both_touch_it_and_press(force, aside, held):
    builder = DiagramBuilder()
    station = builder.AddSystem(Station())
    monitor = builder.AddSystem(ContactMonitor(station.plant))
    builder.Connect(station.GetOutputPort("query_object"), monitor.GetInputPort("query_object"))
    sources = {
        monitor.GetInputPort("gripper.force_measured"): [force],
        station.GetInputPort("arm.position_command"): HOME,
        station.GetInputPort("gripper.position_command"): [0.039],
    }
    for port, value in sources.items():
        builder.Connect(builder.AddSystem(ConstantVectorSource(value)).get_output_port(), port)
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    station.initialize(root, X_WO=RigidTransform([0.6, 0.0, 0.52]), width=0.039)
    X_WG = station.GetOutputPort("tcp.pose").Eval(station.GetMyContextFromRoot(root))
    X_WO = X_WG @ RigidTransform([0.0, aside, 0.0])
    station.initialize(root, X_WO=X_WO, width=0.039)
    Simulator(diagram, root).AdvanceTo(station.plant.time_step())

    depths = monitor.depths(monitor.GetMyContextFromRoot(root))
    pads = {f"{side}_inner_finger" for side in ("left", "right")}
    cube = "held cube" if held else "cube"
    touched = {pair for pair in depths if "cube" in pair}
    assert touched <= {f"{cube} and {pad}" for pad in pads}
    assert len(touched) == (2 if aside == BETWEEN else 1)
