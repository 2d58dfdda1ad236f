"""The scene of grasp trials: a floating gripper over the table, as one diagram."""

import numpy as np
from pydrake.geometry import GeometryId, Role
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    PdControllerGains,
    RevoluteJoint,
    RigidBody,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from diagrams.contact import set_cube_mass, set_friction, use_grasp_contact
from diagrams.faults import simulating
from diagrams.gripper_controller import GripperController, prepare_gripper
from diagrams.reference_ramp import ReferenceRamp
from models.scenes import gripper
from models.scenes.parsing import CUBE, add_models
from models.task.spaces import CUBE_EDGE

MODEL_FILES = ("table.sdf", "gantry.urdf", "robotiq_2f_85.urdf", "cube.sdf")
"""What the scene consists of."""
COLUMN = np.array([0.55, 0.0])
"""x, y of the table's middle [m]."""
SPEED = 0.1
"""Of the slides [m/s]."""
TURN_SPEED = 1.5
"""Of the turret [rad/s], somewhat faster than the arm's wrist."""
_TURRET = SpatialInertia(0.5, np.zeros(3), UnitInertia.SolidSphere(0.4))
"""Stands for the arm's effective inertia behind a gripper that turns."""
_X_GB = RigidTransform([0.0, 0.0, -gripper.TCP_FROM_FLANGE])
"""The gripper's base in the frame of the tool centre point."""


class TrialRig:
    """A diagram built once that serves any number of trials, each from a fresh context.

    ::

       gantry.position_command ── ReferenceRamp ──┐
                                                  ├── plant: gantry, 2F-85, cube, table
       gripper.position_command ── GripperController

    The gantry is three slides that carry the tool centre point, and a turret that turns the
    gripper about an axis through it. That axis, and how the gripper sits on the turret, are
    parameters of the context: one plant serves every orientation and every turn.
    """

    def __init__(self, time_step: float) -> None:
        """Build the diagram, its discrete solver's step in seconds."""
        builder = DiagramBuilder()
        plant, self.scene_graph = AddMultibodyPlantSceneGraph(builder, time_step)
        use_grasp_contact(plant)
        # Ports that are sampled hold copies of every step's results; here they are read rarely.
        plant.SetUseSampledOutputPorts(False)
        add_models(plant, *MODEL_FILES)
        table = RigidTransform([*COLUMN, 0.5])
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("table"), table)
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("rail"))
        self.hand = plant.GetModelInstanceByName("robotiq_2f_85")
        self.gantry = plant.GetModelInstanceByName("gantry")
        turret = plant.AddRigidBody("turret", self.gantry, _TURRET)
        self.axis = plant.AddFrame(
            FixedOffsetFrame("axis", plant.GetFrameByName("carriage"), RigidTransform())
        )
        turn = plant.AddJoint(
            RevoluteJoint("turn", self.axis, turret.body_frame(), np.array([0.0, 0.0, 1.0]))
        )
        plant.AddJointActuator("turn", turn)
        self.mount = plant.AddFrame(
            FixedOffsetFrame("mount", turret.body_frame(), RigidTransform())
        )
        plant.WeldFrames(self.mount, plant.GetFrameByName("base", self.hand))
        prepare_gripper(plant, self.hand)
        for axis in "xyz":
            actuator = plant.GetJointActuatorByName(axis, self.gantry)
            actuator.set_controller_gains(PdControllerGains(p=2e4, d=600.0))
        actuator = plant.GetJointActuatorByName("turn", self.gantry)
        actuator.set_controller_gains(PdControllerGains(p=500.0, d=10.0))
        for instance in (self.hand, self.gantry):
            plant.set_gravity_enabled(instance, False)
        plant.Finalize()
        self.plant = plant
        self.cube = plant.GetBodyByName(CUBE)
        self.palm = plant.GetBodyByName("base", self.hand)

        self.gripper = GripperController.add_to_builder(builder, plant, self.hand)
        self.ramp = builder.AddNamedSystem(
            "gantry_ramp",
            ReferenceRamp(4, speed=[SPEED, SPEED, SPEED, TURN_SPEED], period=time_step),
        )
        builder.Connect(
            self.ramp.get_output_port(), plant.get_desired_state_input_port(self.gantry)
        )
        builder.ExportInput(self.ramp.get_input_port(), "gantry.position_command")
        builder.ExportInput(
            self.gripper.GetInputPort("position_command"), "gripper.position_command"
        )
        builder.ExportInput(plant.get_applied_generalized_force_input_port(), "support")
        self.diagram = builder.Build()

        inspector = self.scene_graph.model_inspector()

        def shapes(body: RigidBody) -> list[GeometryId]:
            return inspector.GetGeometries(
                plant.GetBodyFrameIdOrThrow(body.index()), Role.kProximity
            )

        hand = (plant.get_body(index) for index in plant.GetBodyIndices(self.hand))
        self.hand_shapes = [shape for body in hand for shape in shapes(body)]
        self.table_shapes = shapes(plant.GetBodyByName("table"))


class TrialScene:
    """One simulation on a rig, from a fresh context."""

    def __init__(
        self,
        rig: TrialRig,
        R_WG: np.ndarray,
        turn_W: np.ndarray | None = None,
        *,
        friction: float,
        mass: float,
    ) -> None:
        """Set what stays the same through a trial.

        Args:
            rig: the diagram.
            R_WG: the gripper's orientation at the start ``[3, 3]``.
            turn_W: rotation vector in W ``[3]`` [rad], not zero, that `command` may turn the
                gripper by; none if absent.
            friction: coefficient, of everything.
            mass: of the cube [kg].
        """
        self._rig, self._mass = rig, mass
        self.clearance = np.inf
        """Smallest distance between hand and table after any `advance` so far [m]."""
        self._simulator = Simulator(rig.diagram)
        self._root = self._simulator.get_mutable_context()
        self._context = rig.plant.GetMyMutableContextFromRoot(self._root)
        self.turn_angle = 0.0 if turn_W is None else float(np.linalg.norm(turn_W))
        """Of the turn that `command` may ask for [rad]."""
        # Frame A has its z along the axis.
        axis_W = (
            turn_W / self.turn_angle if turn_W is not None and self.turn_angle else [0.0, 0.0, 1.0]
        )
        R_WA = RotationMatrix.MakeFromOneVector(np.asarray(axis_W), 2)
        R_AG = R_WA.inverse() @ RotationMatrix(R_WG)
        rig.axis.SetPoseInParentFrame(self._context, RigidTransform(R_WA))
        rig.mount.SetPoseInParentFrame(self._context, RigidTransform(R_AG) @ _X_GB)
        set_friction(rig.plant, rig.scene_graph, self._root, friction)
        set_cube_mass(rig.plant, self._context, mass)

    def start(self, p_WG: np.ndarray, width: float, X_WO: RigidTransform) -> None:
        """Put gripper (opening in metres) and cube in place, at rest.

        Raises:
            SimulatorFault: if Drake cannot begin there.
        """
        rig = self._rig
        rig.plant.SetPositions(self._context, rig.gantry, [*p_WG, 0.0])
        angles = gripper.joint_positions(float(gripper.knuckle_angle(width)))
        for name, angle in zip(gripper.JOINTS, angles, strict=True):
            rig.plant.GetJointByName(name, rig.hand).set_angle(self._context, angle)
        rig.plant.SetFreeBodyPose(self._context, rig.cube, X_WO)
        rig.ramp.set_reference(rig.ramp.GetMyMutableContextFromRoot(self._root), [*p_WG, 0.0])
        rig.gripper.set_opening(self._root, width)
        self.support(False)
        with simulating():
            self._simulator.Initialize()

    def command(self, p_WG: np.ndarray, width: float, *, turned: bool = False) -> None:
        """Send tool centre point and opening on their way [m], and the gripper to its turn."""
        diagram = self._rig.diagram
        gantry = [*p_WG, self.turn_angle if turned else 0.0]
        diagram.GetInputPort("gantry.position_command").FixValue(self._root, gantry)
        diagram.GetInputPort("gripper.position_command").FixValue(self._root, [width])

    def support(self, on: bool) -> None:
        """Carry the cube's weight, while the fingers have not closed on it yet."""
        force = np.zeros(self._rig.plant.num_velocities())
        # A free body's velocities in the plant: angular, then linear; the last is along z.
        last = self._rig.cube.floating_velocities_start_in_v() + 5
        weight = -self._mass * self._rig.plant.gravity_field().gravity_vector()[2]
        force[last] = weight if on else 0.0
        self._rig.diagram.GetInputPort("support").FixValue(self._root, force)

    def advance(self, seconds: float) -> None:
        """Simulate on.

        Raises:
            SimulatorFault: if the solver fails.
        """
        with simulating():
            self._simulator.AdvanceTo(self._root.get_time() + seconds)
            # Asked within: this is where a pose that is not finite any more shows.
            self.clearance = min(self.clearance, self._hand_to_table())

    @property
    def time(self) -> float:
        """Since the start [s]."""
        return self._root.get_time()

    @property
    def X_WO(self) -> RigidTransform:
        """Pose of the cube."""
        return self._rig.cube.EvalPoseInWorld(self._context)

    @property
    def X_WG(self) -> RigidTransform:
        """Pose of the tool centre point."""
        return self._rig.palm.EvalPoseInWorld(self._context) @ _X_GB.inverse()

    @property
    def X_GO(self) -> RigidTransform:
        """Pose of the cube in the gripper."""
        return self.X_WG.inverse() @ self.X_WO

    @property
    def opening(self) -> float:
        """Between the pads [m]."""
        return self._measured("position_measured")

    @property
    def pad_force(self) -> float:
        """Of each pad [N]."""
        return self._measured("force_measured")

    @property
    def cube_speed(self) -> float:
        """Of the cube, its spin counted at an edge's length [m/s]."""
        velocity = self._rig.cube.EvalSpatialVelocityInWorld(self._context)
        spin = np.linalg.norm(velocity.rotational()) * CUBE_EDGE
        return float(np.linalg.norm(velocity.translational()) + spin)

    def _measured(self, port: str) -> float:
        controller = self._rig.gripper
        context = controller.GetMyContextFromRoot(self._root)
        return float(controller.GetOutputPort(port).Eval(context)[0])

    def _hand_to_table(self) -> float:
        rig = self._rig
        port = rig.scene_graph.get_query_output_port()
        query = port.Eval(rig.scene_graph.GetMyContextFromRoot(self._root))
        return min(
            query.ComputeSignedDistancePairClosestPoints(shape, table).distance
            for shape in rig.hand_shapes
            for table in rig.table_shapes
        )
