"""The scene of grasp trials: a floating gripper over the table, as one diagram."""

import numpy as np
from pydrake.geometry import GeometryId, Role
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    PdControllerGains,
    RevoluteJoint,
    RigidBody,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.framework import DiagramBuilder

from diagrams.contact import use_grasp_contact
from diagrams.falls.scene import FallScene
from diagrams.gripper_controller import prepare_gripper
from diagrams.trials.record import TrialConfig
from diagrams.trials.references import SteppedReferences, TimedReferences
from models.scenes.parsing import CUBE, add_models

MODEL_FILES = ("table.sdf", "gantry.urdf", "robotiq_2f_85.urdf", "cube.sdf")
"""What the scene consists of."""
COLUMN = np.array([0.55, 0.0])
"""x, y of the table's middle [m]."""
_TURRET = SpatialInertia(0.5, np.zeros(3), UnitInertia.SolidSphere(0.4))
"""Stands for the arm's effective inertia behind a gripper that turns."""


class TrialRig:
    """A diagram built once that serves any number of trials, each from a fresh context.

    ::

       references of gantry and gripper ──┐
                                          ├── plant: gantry, 2F-85, cube, table
       support ───────────────────────────┘

    The gantry is three slides that carry the tool centre point, and a turret that turns the
    gripper about an axis through it. That axis, and how the gripper sits on the turret, are
    parameters of the context: one plant serves every orientation and every turn.
    """

    def __init__(self, config: TrialConfig) -> None:
        """Build the diagram.

        Args:
            config: of the trials it is for, for its solver.
        """
        self.config = config
        self.landing = (
            FallScene(edge=False, accuracy=config.landing_accuracy)
            if config.solver == "cenic"
            else None
        )
        builder = DiagramBuilder()
        plant, self.scene_graph = AddMultibodyPlantSceneGraph(
            builder, 0.0 if self.landing else config.time_step
        )
        use_grasp_contact(plant)
        if not self.landing:
            # Sampled ports hold copies of every step's results; here they are read rarely.
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
        self.knuckle = plant.GetJointByName("left_knuckle", self.hand)

        kind = TimedReferences if self.landing else SteppedReferences
        self.references = kind(builder, plant, self.gantry, self.hand)
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
