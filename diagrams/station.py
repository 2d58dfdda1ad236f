"""The station: robot, box, table and cube with their controllers, as one Diagram."""

from collections.abc import Callable

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import Meshcat, MeshcatVisualizer, MeshcatVisualizerParams
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import Demultiplexer

from diagrams.arm_controller import ArmController, prepare_arm
from diagrams.contact import use_grasp_contact
from diagrams.gripper_controller import (
    FINGER_INERTIA,
    GRIP_FORCE,
    GripperController,
    add_finger_inertia,
    prepare_gripper,
)
from diagrams.hand_mount import HandMount
from diagrams.state_identifier import StateIdentifier
from models.arrays import finite_number, finite_vector
from models.scenes import gripper
from models.scenes.inputs import finite_pose
from models.scenes.parsing import ARM, CUBE, GRIPPER
from models.scenes.planning_scene import HOME

TIME_STEP = 0.0025
"""Of the plant and its controllers where nothing else is said [s].

What is carried stays where it is at any step up to this, for the hand is a body of its own
(`HandMount`); what falls needs far shorter ones and has them (`diagrams.falls`)."""
FRAME = 1.0 / 24.0
"""Between two pictures of a visualizer [s]."""


class _Poses(LeafSystem):
    """Poses of the cube and the tool centre point, out of the plant's body poses."""

    def __init__(self, plant: MultibodyPlant) -> None:
        super().__init__()
        bodies = self.DeclareAbstractInputPort("body_poses", AbstractValue.Make([RigidTransform()]))
        cube = plant.GetBodyByName(CUBE).index()
        tcp = plant.GetFrameByName("tcp")
        hand, X_BG = tcp.body().index(), tcp.GetFixedPoseInBodyFrame()

        def calc_object(context: Context, output: AbstractValue) -> None:
            output.set_value(bodies.Eval(context)[int(cube)])

        def calc_tcp(context: Context, output: AbstractValue) -> None:
            output.set_value(bodies.Eval(context)[int(hand)] @ X_BG)

        make = lambda: AbstractValue.Make(RigidTransform())  # noqa: E731
        self.DeclareAbstractOutputPort("object.pose", make, calc_object)
        self.DeclareAbstractOutputPort("tcp.pose", make, calc_tcp)


class Station(Diagram):
    """What a controller sees of the robot cell; the same names would serve hardware.

    ::

                                 ┌─────────┐── arm.position_measured      [7] rad
                                 │         │── arm.velocity_measured      [7] rad/s
                                 │         │── arm.torque_measured        [7] N m
                                 │         │── arm.limited_samples        [1] samples
       arm.position_command ─────┤         │── gripper.position_measured  [1] m of opening
                                 │ Station │── gripper.force_measured     [1] N per pad
       gripper.position_command ─┤         │── object.pose                RigidTransform X_WO
       spatial_forces ───────────┤         │── tcp.pose                   RigidTransform X_WG
                                 │         │── task.state                 [1] index
                                 └─────────┘── state, query_object, contact_results

    The last three are Drake's own, for cameras, loggers and teleoperation: the plant's positions
    and velocities, its geometry, its contacts. `station.md` beside this file has a table of all
    ports, with examples.

    Both commands must be connected; one that is not finite ends the simulation with a `ModelError`.
    `spatial_forces` is the plant's own port for forces on bodies, and need not be connected.
    The arm obeys the limits of its speed and acceleration (`ArmController`). Before a simulation
    starts, call `initialize` on the root context: the references of arm and gripper are state, and
    begin at zero otherwise. Torques, forces and contacts are those of the step that begins, and
    cost its computation where it is not taken next.
    """

    def __init__(
        self,
        *,
        meshcat: Meshcat | None = None,
        time_step: float = TIME_STEP,
        grip_force: float = GRIP_FORCE,
        prepare: Callable[[MultibodyPlant], None] | None = None,
        movable_base: bool = False,
    ) -> None:
        """Build the station.

        Args:
            meshcat: where to publish it; None does not.
            time_step: of the plant and its controllers [s].
            grip_force: of each pad on what it holds [N]; the vendor's gripper can do 20 to 235.
            prepare: changes the plant before it is finalized, such as by one body more.
            movable_base: whether `mount.move_base` can move the robot in a context.

        Raises:
            ModelError: if the time step is not above 0, or the force beyond the gripper's range.
        """
        time_step = finite_number(time_step, "time_step", above=0.0, valid="seconds above 0")
        super().__init__()
        builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(builder, time_step)
        plant = self.plant
        use_grasp_contact(plant)
        # Sampled ports copy every step's results, whether read or not.
        plant.SetUseSampledOutputPorts(False)
        self.mount = HandMount(plant, movable_base=movable_base)
        """How the hand sits on the arm."""
        arm, hand = (plant.GetModelInstanceByName(name) for name in (ARM, GRIPPER))
        prepare_arm(plant, arm)
        prepare_gripper(plant, hand, grip_force)
        if prepare is not None:
            prepare(plant)
        plant.Finalize()
        self.mount.let_touch(self.scene_graph)
        self._cube = plant.GetBodyByName(CUBE)

        self._arm = ArmController.add_to_builder(builder, plant, self.mount)
        self._gripper = GripperController.add_to_builder(builder, plant, hand)
        measured = builder.AddNamedSystem("arm_state", Demultiplexer([len(HOME)] * 2))
        builder.Connect(plant.get_state_output_port(arm), measured.get_input_port())
        poses = builder.AddNamedSystem("poses", _Poses(plant))
        builder.Connect(plant.get_body_poses_output_port(), poses.get_input_port())
        identifier = builder.AddNamedSystem("state_identifier", StateIdentifier())
        for name in ("object.pose", "tcp.pose"):
            builder.Connect(poses.GetOutputPort(name), identifier.GetInputPort(name))
        for name in ("position_measured", "force_measured"):
            builder.Connect(
                self._gripper.GetOutputPort(name), identifier.GetInputPort(f"gripper.{name}")
            )
        if meshcat is not None:
            MeshcatVisualizer.AddToBuilder(
                builder, self.scene_graph, meshcat, MeshcatVisualizerParams(publish_period=FRAME)
            )

        for name, controller in (("arm", self._arm), ("gripper", self._gripper)):
            port = controller.GetInputPort("position_command")
            builder.ExportInput(port, f"{name}.position_command")
        builder.ExportInput(plant.get_applied_spatial_force_input_port(), "spatial_forces")
        outputs = {
            "arm.position_measured": measured.get_output_port(0),
            "arm.velocity_measured": measured.get_output_port(1),
            "arm.torque_measured": plant.get_net_actuation_output_port(arm),
            "arm.limited_samples": self._arm.GetOutputPort("limited_samples"),
            "gripper.position_measured": self._gripper.GetOutputPort("position_measured"),
            "gripper.force_measured": self._gripper.GetOutputPort("force_measured"),
            "object.pose": poses.GetOutputPort("object.pose"),
            "tcp.pose": poses.GetOutputPort("tcp.pose"),
            "task.state": identifier.get_output_port(),
            "state": plant.get_state_output_port(),
            "query_object": self.scene_graph.get_query_output_port(),
            "contact_results": plant.get_contact_results_output_port(),
        }
        for name, port in outputs.items():
            builder.ExportOutput(port, name)
        builder.BuildInto(self)

    def initialize(
        self,
        root: Context,
        *,
        X_WO: RigidTransform,
        q: np.ndarray = HOME,
        width: float = gripper.MAX_OPENING,
    ) -> None:
        """Put the scene at rest: arm at ``q [7]`` [rad], pads ``width`` [m] apart, cube at X_WO.

        Raises:
            ModelError: if the pose is none, ``q`` not so many finite angles, or ``width`` not a
                finite number.
        """
        finite_pose(X_WO, "X_WO")
        q = finite_vector(q, len(HOME), "q")
        width = finite_number(width, "width", valid="metres")
        context = self.plant.GetMyMutableContextFromRoot(root)
        hand = self.plant.GetModelInstanceByName(GRIPPER)
        add_finger_inertia(self.plant, context, hand, FINGER_INERTIA)
        self.plant.SetPositions(context, self.plant.GetModelInstanceByName(ARM), q)
        self.mount.place(context)
        angles = gripper.joint_positions(float(gripper.knuckle_angle(width)))
        for name, angle in zip(gripper.JOINTS, angles, strict=True):
            self.plant.GetJointByName(name, hand).set_angle(context, angle)
        self.plant.SetFreeBodyPose(context, self._cube, X_WO)
        self._arm.set_position(root, q)
        self._gripper.set_opening(root, width)
