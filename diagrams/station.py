"""The station: robot, box, table and cube with their controllers, as one Diagram."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import Meshcat, MeshcatVisualizer, MeshcatVisualizerParams
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, LeafSystem

from diagrams.arm_controller import ArmController, prepare_arm
from diagrams.contact import TIME_STEP, use_grasp_contact
from diagrams.gripper_controller import GripperController, prepare_gripper
from diagrams.state_identifier import StateIdentifier
from models.arrays import finite_number, finite_vector
from models.scenes import gripper
from models.scenes.inputs import finite_pose
from models.scenes.parsing import ARM, CUBE, GRIPPER, add_models
from models.scenes.planning_scene import HOME


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


class _Split(LeafSystem):
    """Positions and velocities out of the arm's state."""

    def __init__(self) -> None:
        super().__init__()
        n = len(HOME)
        state = self.DeclareVectorInputPort("state", 2 * n)
        self.DeclareVectorOutputPort(
            "position_measured", n, lambda c, out: out.SetFromVector(state.Eval(c)[:n])
        )
        self.DeclareVectorOutputPort(
            "velocity_measured", n, lambda c, out: out.SetFromVector(state.Eval(c)[n:])
        )


class Station(Diagram):
    """What a controller sees of the robot cell; the same names would serve hardware.

    ::

                                 ┌─────────┐── arm.position_measured      [7] rad
                                 │         │── arm.velocity_measured      [7] rad/s
       arm.position_command ─────┤         │── gripper.position_measured  [1] m of opening
                                 │ Station │── gripper.force_measured     [1] N per pad
       gripper.position_command ─┤         │── object.pose                RigidTransform X_WO
                                 │         │── tcp.pose                   RigidTransform X_WG
                                 └─────────┘── task.state                 [1] index

    Both commands must be connected. Before a simulation starts, call `initialize` on the root
    context: the gripper's reference is state, and begins at an opening of zero otherwise.
    """

    def __init__(self, *, meshcat: Meshcat | None = None, time_step: float = TIME_STEP) -> None:
        """Build the station.

        Args:
            meshcat: where to publish it; None does not.
            time_step: of the plant and its controllers [s].

        Raises:
            ModelError: if the time step is not above 0.
        """
        time_step = finite_number(time_step, "time_step", above=0.0, valid="seconds above 0")
        super().__init__()
        builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(builder, time_step)
        plant = self.plant
        use_grasp_contact(plant)
        add_models(plant, "station.dmd.yaml")
        arm, hand = (plant.GetModelInstanceByName(name) for name in (ARM, GRIPPER))
        prepare_arm(plant, arm)
        prepare_gripper(plant, hand)
        # As for the arm, the weight of the hand is the arm controller's to compensate.
        plant.set_gravity_enabled(hand, False)
        plant.Finalize()
        self._cube = plant.GetBodyByName(CUBE)

        arm_controller = ArmController.add_to_builder(builder, plant, arm)
        self._gripper = GripperController.add_to_builder(builder, plant, hand)
        split = builder.AddNamedSystem("arm_state", _Split())
        builder.Connect(plant.get_state_output_port(arm), split.get_input_port())
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
                builder, self.scene_graph, meshcat, MeshcatVisualizerParams(publish_period=1 / 24)
            )

        builder.ExportInput(arm_controller.get_input_port(), "arm.position_command")
        builder.ExportInput(
            self._gripper.GetInputPort("position_command"), "gripper.position_command"
        )
        for name in ("position_measured", "velocity_measured"):
            builder.ExportOutput(split.GetOutputPort(name), f"arm.{name}")
        for name in ("position_measured", "force_measured"):
            builder.ExportOutput(self._gripper.GetOutputPort(name), f"gripper.{name}")
        for name in ("object.pose", "tcp.pose"):
            builder.ExportOutput(poses.GetOutputPort(name), name)
        builder.ExportOutput(identifier.get_output_port(), "task.state")
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
        self.plant.SetPositions(context, self.plant.GetModelInstanceByName(ARM), q)
        angles = gripper.joint_positions(float(gripper.knuckle_angle(width)))
        for name, angle in zip(gripper.JOINTS, angles, strict=True):
            self.plant.GetJointByName(name, hand).set_angle(context, angle)
        self.plant.SetFreeBodyPose(context, self._cube, X_WO)
        self._gripper.set_opening(root, width)
