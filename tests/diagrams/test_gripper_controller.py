"""The 2F-85 under load: alone in the world, closing on a block."""

import numpy as np
import pytest
from pydrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    Box,
    ProximityProperties,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from diagrams.contact import TIME_STEP, use_grasp_contact
from diagrams.gripper_controller import GRIP_FORCE, GripperController, prepare_gripper
from models.scenes import gripper
from models.scenes.parsing import add_models

SIDES = ("left", "right")


class Bench:
    """A gripper on the world's frame, without gravity; optionally a block between its pads."""

    def __init__(self, block=None, *, rigid=False, offset=0.0, opening=gripper.MAX_OPENING):
        builder = DiagramBuilder()
        self.plant, _ = AddMultibodyPlantSceneGraph(builder, TIME_STEP)
        plant = self.plant
        use_grasp_contact(plant)
        add_models(plant, "robotiq_2f_85.urdf")
        self.hand = plant.GetModelInstanceByName("robotiq_2f_85")
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base", self.hand))
        if block is not None:
            inertia = SpatialInertia(0.1, np.zeros(3), UnitInertia.SolidCube(0.04))
            body = plant.AddRigidBody("block", plant.AddModelInstance("block"), inertia)
            properties = ProximityProperties()
            if rigid:
                AddRigidHydroelasticProperties(0.04, properties)
            else:
                AddCompliantHydroelasticProperties(0.04, 1e7, properties)
            AddContactMaterial(20.0, None, CoulombFriction(0.8, 0.8), properties)
            shape = Box(0.03, block, 0.03)
            plant.RegisterCollisionGeometry(body, RigidTransform(), shape, "block", properties)
        prepare_gripper(plant, self.hand)
        plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
        plant.Finalize()
        self.controller = GripperController.add_to_builder(builder, plant, self.hand)
        builder.ExportInput(self.controller.GetInputPort("position_command"), "command")
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        self.root = self.simulator.get_mutable_context()
        self.context = plant.GetMyMutableContextFromRoot(self.root)
        angles = gripper.joint_positions(float(gripper.knuckle_angle(opening)))
        for name, angle in zip(gripper.JOINTS, angles, strict=True):
            plant.GetJointByName(name, self.hand).set_angle(self.context, angle)
        if block is not None:
            at = RigidTransform([0.0, offset, gripper.TCP_FROM_FLANGE])
            plant.SetFreeBodyPose(self.context, body, at)
            self.block = body
        self.controller.set_opening(self.root, opening)

    def advance(self, command, seconds):
        self.diagram.GetInputPort("command").FixValue(self.root, [command])
        self.simulator.AdvanceTo(self.root.get_time() + seconds)

    def measured(self, name):
        port = self.controller.GetOutputPort(f"{name}_measured")
        return port.Eval(self.controller.GetMyContextFromRoot(self.root))[0]

    def angle(self, name):
        return self.plant.GetJointByName(name, self.hand).get_angle(self.context)

    def coupling_error(self):
        """Largest deviation of a joint from where its coupler should hold it [rad]."""
        angles = np.array([self.angle(name) for name in gripper.JOINTS])
        return np.abs(angles - gripper.joint_positions(angles[0])).max()

    def contact_forces(self):
        """Of each pad on the block along the closing axis [N]: left pushes towards +y.

        Pads are rigid: they meet what is rigid too in points.
        """
        results = self.plant.get_contact_results_output_port().Eval(self.context)
        query = self.plant.get_geometry_query_input_port().Eval(self.context)
        forces = dict.fromkeys(SIDES, 0.0)
        for i in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(i)
            bodies = [
                self.plant.get_body(at).name() for at in (info.bodyA_index(), info.bodyB_index())
            ]
            sign = 1.0 if bodies[1] == "block" else -1.0  # the force is on B
            side = next(name for name in bodies if name != "block").split("_")[0]
            forces[side] += sign * info.contact_force()[1]
        for i in range(results.num_hydroelastic_contacts()):
            info = results.hydroelastic_contact_info(i)
            surface = info.contact_surface()
            bodies = [
                self.plant.GetBodyFromFrameId(query.inspector().GetFrameId(id_)).name()
                for id_ in (surface.id_M(), surface.id_N())
            ]
            # The force is on M.
            sign = 1.0 if bodies[0] == "block" else -1.0
            side = next(name for name in bodies if name != "block").split("_")[0]
            forces[side] += sign * info.F_Ac_W().translational()[1]
        return forces

    def pad(self, side):
        """Pose of a pad's surface in the gripper's base."""
        surface = RigidTransform([0.0, gripper.PAD_SURFACE_Y, 0.03242])
        frame = self.plant.GetFrameByName(f"{side}_inner_finger", self.hand)
        return frame.CalcPoseInWorld(self.context) @ surface


@pytest.fixture(scope="module")
def travel():
    """Opening, pads and coupling error on the way from open to closed and back."""
    bench, rows = Bench(), []
    for command in (0.0, gripper.MAX_OPENING):
        for _ in range(16):
            bench.advance(command, 0.11)
            error = bench.coupling_error()
            rows.append((bench.measured("position"), *map(bench.pad, SIDES), error))
    return rows


def test_the_fingers_travel_the_rated_stroke(travel):
    closing, opening = np.array([row[0] for row in travel]).reshape(2, 16)
    assert (np.diff(closing) <= 1e-4).all() and (np.diff(opening) >= -1e-4).all()
    # The linkage ends at 0.8 rad, 1.5 mm before the pads would touch.
    assert closing[-1] == pytest.approx(1.51e-3, abs=2e-5)
    assert opening[-1] == pytest.approx(0.085, abs=1e-4)


def test_the_pads_stay_parallel_and_symmetric_all_the_way(travel):
    for width, left, right, error in travel:
        np.testing.assert_allclose(
            left.translation(), [0.0, -width / 2, left.translation()[2]], atol=1e-7
        )
        np.testing.assert_allclose(right.translation(), left.translation() * [1, -1, 1], atol=1e-7)
        turned = (left.rotation().inverse() @ right.rotation()).matrix()
        np.testing.assert_allclose(turned, np.diag([-1.0, -1.0, 1.0]), atol=1e-6)
        assert error < 1e-6


def test_the_pads_advance_as_they_close(travel):
    """By 14 mm in all, 12 mm of them until they hold the cube; facts of the vendor's linkage."""
    heights = {row[0]: row[1].translation()[2] for row in travel}
    widths = np.array(sorted(heights))
    at = np.interp([0.0015, 0.02, 0.04, 0.06, 0.085], widths, [heights[w] for w in widths])
    np.testing.assert_allclose(at, [0.14425, 0.14426, 0.14255, 0.13888, 0.13076], atol=5e-5)


@pytest.mark.parametrize("command", [0.08, 0.06, 0.04, 0.015])
def test_the_command_is_the_opening_in_metres(command):
    bench = Bench(opening=0.05)
    bench.advance(command, 1.0)
    gap = bench.pad("right").translation()[1] - bench.pad("left").translation()[1]
    assert bench.measured("position") == pytest.approx(command, abs=2e-5)
    assert gap == pytest.approx(command, abs=2e-5)
    assert abs(bench.measured("force")) < 0.01 * GRIP_FORCE


def test_the_grip_force_presses_each_pad_on_a_cube(grip=GRIP_FORCE):
    bench = Bench(block=0.04, opening=0.046)
    bench.advance(0.0, 0.6)
    assert bench.contact_forces() == pytest.approx({"left": grip, "right": -grip}, rel=0.005)
    assert bench.measured("force") == pytest.approx(grip, rel=0.005)


@pytest.mark.parametrize(
    ("block", "rigid"),
    # What is rigid meets the pads, which are too, in points; a thin block sinks in.
    [
        *((block, False) for block in (0.02, 0.04, 0.06, 0.08)),
        (0.04, True),
        (0.06, True),
        (0.08, True),
    ],
)
def test_force_is_measured_and_shared_evenly_whatever_is_held(block, rigid):
    """One torque serves all widths: its force grows as the linkage opens, by 22 % at most."""
    bench = Bench(block=block, rigid=rigid, offset=0.002, opening=min(block + 0.006, 0.085))
    bench.advance(0.0, 0.6)
    forces, force = bench.contact_forces(), bench.measured("force")
    rates = gripper.closing_rate(gripper.knuckle_angle([0.04, block]))
    # Where rigid meets rigid, in points, it is hardly as even.
    assert forces["left"] == pytest.approx(-forces["right"], rel=5e-3 if rigid else 1e-5)
    assert force == pytest.approx(forces["left"], rel=5e-3 if rigid else 1e-4)
    assert force == pytest.approx(GRIP_FORCE * rates[0] / rates[1], rel=0.01)
    # The fingers centre what they close on, and what they press they dent.
    assert bench.block.EvalPoseInWorld(bench.context).translation()[1] == pytest.approx(0, abs=1e-4)
    assert block - 1e-3 < bench.measured("position") < block
    # Load spreads the couplers by no more than what moves a pad by 10 µm.
    assert bench.coupling_error() < 2e-4


def test_a_held_block_is_let_go():
    bench = Bench(block=0.04, opening=0.042)
    bench.advance(0.0, 0.3)
    assert bench.measured("force") == pytest.approx(GRIP_FORCE, rel=0.005)
    bench.advance(gripper.MAX_OPENING, 0.8)
    assert bench.contact_forces() == {"left": 0.0, "right": 0.0}
    assert abs(bench.measured("force")) < 0.5
    assert bench.measured("position") > 0.05
