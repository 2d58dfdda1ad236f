"""A hand that constraints hold: it is where the flange is, and what it carries stays in it."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from diagrams.station import TIME_STEP, Station
from models import PlanningScene, solve
from models.maps.gripper_poses import gripper_pose
from models.scenes.parsing import ARM, add_models
from models.scenes.planning_scene import HOME

SWING = 1.0  # of joint 1 [rad]
SECONDS = 1.3  # for it: at most at 1.15 rad/s, of 1.4 that it can do
SETTLE = 0.3  # before [s]


def welded_tcp(q):
    """X_WG by the description itself, hand welded to the arm."""
    plant = MultibodyPlant(0.0)
    add_models(plant, "station.dmd.yaml")
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, plant.GetModelInstanceByName(ARM), q)
    return plant.GetFrameByName("tcp").CalcPoseInWorld(context)


def test_a_hand_at_rest_stays_at_the_flange_under_its_weight():
    station = Station()
    simulator = Simulator(station)
    root = simulator.get_mutable_context()
    station.initialize(root, X_WO=RigidTransform([0.6, 0.1, 0.52]))
    station.GetInputPort("arm.position_command").FixValue(root, HOME)
    station.GetInputPort("gripper.position_command").FixValue(root, [0.085])
    for seconds in (0.0, 1.0):
        if seconds:
            simulator.AdvanceTo(seconds)
        X_WG = station.GetOutputPort("tcp.pose").Eval(root)
        expected = welded_tcp(station.GetOutputPort("arm.position_measured").Eval(root))
        near = 5e-5 if seconds else 1e-12
        assert X_WG.translation() == pytest.approx(expected.translation(), abs=near)
        turned = (X_WG.rotation().inverse() @ expected.rotation()).ToAngleAxis().angle()
        assert turned < (5e-4 if seconds else 1e-7)


def test_the_hand_does_not_push_against_the_wrist_that_it_sits_on():
    """The vendor's shapes overlap by 8 mm there; a weld has them touch, and so have constraints."""
    station = Station()
    root = station.CreateDefaultContext()
    station.initialize(root, X_WO=RigidTransform([0.6, 0.1, 0.52]))
    query = station.GetOutputPort("query_object").Eval(root)
    inspector, plant = query.inspector(), station.plant

    def body(shape):
        return plant.GetBodyFromFrameId(inspector.GetFrameId(shape)).name()

    touching = {frozenset(map(body, (p.id_A, p.id_B))) for p in query.ComputePointPairPenetration()}
    assert touching <= {frozenset(("cube", "table"))}


def carried(time_step):
    """Where a cube is in the hand before the arm swings it round, and after."""
    X_WG = gripper_pose(np.array([0.5, 0.0, 0.65]), 10)
    q = solve(PlanningScene(), X_WG).q
    there = q + np.array([SWING, *np.zeros(6)])
    path = PiecewisePolynomial.CubicHermite(
        [0.0, SETTLE, SETTLE + SECONDS], np.array([q, q, there]).T, np.zeros((7, 3))
    )
    builder = DiagramBuilder()
    station = builder.AddSystem(Station(time_step=time_step))
    for source, name in ((TrajectorySource(path), "arm"), (ConstantVectorSource([0.0]), "gripper")):
        builder.Connect(
            builder.AddSystem(source).get_output_port(),
            station.GetInputPort(f"{name}.position_command"),
        )
    simulator = Simulator(builder.Build())
    root = simulator.get_mutable_context()
    station.initialize(root, X_WO=X_WG, q=q, width=0.0402)
    here = station.GetMyContextFromRoot(root)

    def X_GO():
        tcp = station.GetOutputPort("tcp.pose").Eval(here)
        return tcp.inverse() @ station.GetOutputPort("object.pose").Eval(here)

    simulator.AdvanceTo(SETTLE)
    before = X_GO()
    simulator.AdvanceTo(SETTLE + SECONDS / 2)
    speed = station.GetOutputPort("arm.velocity_measured").Eval(here)[0]
    assert speed == pytest.approx(1.5 * SWING / SECONDS, rel=0.02)
    simulator.AdvanceTo(SETTLE + SECONDS)
    assert station.GetOutputPort("arm.limited_samples").Eval(here)[0] == 0
    return before, X_GO()


def test_a_cube_that_is_swung_does_not_creep_in_the_hand():
    """One that lagged by ½·h·∫r·ω² dt = 1.2·½·h·r·SWING² ÷ SECONDS crept by 0.58 mm at 2.5 ms."""
    moved = []
    for time_step in (TIME_STEP, TIME_STEP / 2):
        before, after = carried(time_step)
        moved.append(1e3 * (after.translation() - before.translation()))
    assert np.linalg.norm(moved[0]) < 0.1
    assert moved[0] == pytest.approx(moved[1], abs=0.05)
