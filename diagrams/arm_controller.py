"""The Gen3's joints follow a position command, as the vendor's low-level servoing does."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, PdControllerGains
from pydrake.systems.controllers import InverseDynamics
from pydrake.systems.framework import BasicVector, Context, Diagram, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import Demultiplexer, ZeroOrderHold

from diagrams.hand_mount import HandMount
from diagrams.limiter import Limiter
from models.errors import ModelError
from models.scenes.limits import JointLimits
from models.scenes.parsing import ARM, GRIPPER, add_models

JOINTS = tuple(f"joint_{i}" for i in range(1, 8))
N_JOINTS = len(JOINTS)
ACCELERATION_LIMIT = np.array([5.2] * 4 + [10.0] * 3)
"""Of the joints [rad/s²], by the vendor (Gen3 user guide: 297.94 and 572.95 °/s²)."""
_LARGE = PdControllerGains(p=4000.0, d=200.0)
"""Joints 1 to 4 [N m/rad, N m s/rad]: a cube of 1 kg at arm's length moves them by 2 mrad."""
_SMALL = PdControllerGains(p=1000.0, d=30.0)
"""Joints 5 to 7."""


def prepare_arm(plant: MultibodyPlant, arm: ModelInstanceIndex) -> None:
    """Give the arm's joints implicit position control within their torque limits.

    Call before ``plant.Finalize()``.
    """
    for i, name in enumerate(JOINTS):
        actuator = plant.GetJointActuatorByName(name, arm)
        actuator.set_controller_gains(_LARGE if i < 4 else _SMALL)


def control_model(plant: MultibodyPlant, mount: HandMount) -> MultibodyPlant:
    """What the controller knows of the robot: the arm where it stands, and the hand, wide open.

    The hand is one rigid body; that its fingers move by some centimetres changes what a joint
    carries by less than 0.03 N m. What the hand holds is not part of the model.

    Args:
        plant: of the simulation, finalized; arm and hand as in `gen3_2f85.dmd.yaml`.
        mount: of the hand in ``plant``.
    """
    arm, hand = (plant.GetModelInstanceByName(name) for name in (ARM, GRIPPER))
    model = MultibodyPlant(time_step=0.0)
    add_models(model, "gen3.urdf")
    (own,) = {model.GetJointByName(name).model_instance() for name in JOINTS}
    context = plant.CreateDefaultContext()
    mount.place(context)
    base = plant.GetBodyByName("base_link", arm)
    model.WeldFrames(
        model.world_frame(),
        model.GetFrameByName("base_link", own),
        base.EvalPoseInWorld(context),
    )
    flange = "end_effector_link"
    inertia = plant.CalcSpatialInertia(
        context, plant.GetFrameByName(flange, arm), plant.GetBodyIndices(hand)
    )
    body = model.AddRigidBody("hand", own, inertia)
    model.WeldFrames(model.GetFrameByName(flange, own), body.body_frame())
    model.mutable_gravity_field().set_gravity_vector(plant.gravity_field().gravity_vector())
    model.Finalize()
    return model


class _Follow(LeafSystem):
    """`Limiter.follow` as a system without state: what was remembered goes in, what is comes out.

    It runs at every step of the simulation; the state itself and what is taken out of it are
    Drake's own primitives, for their speed.
    """

    def __init__(self, limiter: Limiter) -> None:
        super().__init__()
        size = len(limiter.at_rest(np.zeros(limiter.n_joints)))
        command = self.DeclareVectorInputPort("command", limiter.n_joints)
        before = self.DeclareVectorInputPort("before", size)
        state = self.DeclareVectorInputPort("state", 2 * limiter.n_joints)

        def calc(context: Context, output: BasicVector) -> None:
            try:
                after = limiter.follow(
                    command.Eval(context),
                    before.Eval(context),
                    state.Eval(context)[: limiter.n_joints],
                )
            except ModelError as error:
                place = f"arm.position_command at {context.get_time():.3f} s"
                raise ModelError(f"{place}: {error}") from None
            output.SetFromVector(after)

        self.DeclareVectorOutputPort("after", size, calc)


class ArmController(Diagram):
    """Follows position commands within the joints' limits, and carries the robot's own weight.

    ::

                          ┌───────────────┐
       position_command ──┤               ├── desired_state    (to the plant)
                          │ ArmController ├── weight           (to the plant) [N m]
      (plant) state ──────┤               ├── limited_samples
                          └───────────────┘

    Commands within the limits of speed and acceleration are followed as they are, others as
    `Limiter` says, which waits for a joint that is held up; `limited_samples` counts these. The
    weight of arm and hand is compensated by the controller's own `control_model`, while what the
    hand holds is felt. The reference starts where `set_position` puts it.
    """

    def __init__(self, model: MultibodyPlant, *, period: float) -> None:
        """Control the arm that ``model`` describes, updated every ``period`` seconds.

        Raises:
            ModelError: if the period is not above 0.
        """
        super().__init__()
        joints = [model.GetJointByName(name) for name in JOINTS]
        self._limiter = Limiter(
            JointLimits(
                JOINTS,
                np.array([joint.position_lower_limits()[0] for joint in joints]),
                np.array([joint.position_upper_limits()[0] for joint in joints]),
            ),
            np.array([joint.velocity_upper_limits()[0] for joint in joints]),
            ACCELERATION_LIMIT,
            period,
        )
        self._model = model
        builder = DiagramBuilder()
        follow = builder.AddNamedSystem("follow", _Follow(self._limiter))
        size = follow.GetOutputPort("after").size()
        self._memory = builder.AddNamedSystem("memory", ZeroOrderHold(period, size))
        after, before = (
            builder.AddNamedSystem(name, Demultiplexer([2 * N_JOINTS, size - 2 * N_JOINTS - 1, 1]))
            for name in ("after", "before")
        )
        for system in (self._memory, after):
            builder.Connect(follow.get_output_port(), system.get_input_port())
        builder.Connect(self._memory.get_output_port(), follow.GetInputPort("before"))
        builder.Connect(self._memory.get_output_port(), before.get_input_port())
        mode = InverseDynamics.InverseDynamicsMode.kGravityCompensation
        weight = builder.AddNamedSystem("weight", InverseDynamics(model, mode))
        builder.ExportInput(follow.GetInputPort("command"), "position_command")
        builder.ExportInput(weight.get_input_port_estimated_state(), "state")
        builder.ConnectInput("state", follow.GetInputPort("state"))
        builder.ExportOutput(after.get_output_port(0), "desired_state")
        builder.ExportOutput(weight.get_output_port(), "weight")
        builder.ExportOutput(before.get_output_port(2), "limited_samples")
        builder.BuildInto(self)

    def set_position(self, root: Context, q: np.ndarray) -> None:
        """Put the reference at ``q [7]`` [rad], at rest, with nothing limited yet.

        Raises:
            ModelError: if ``q`` is not so many finite angles.
        """
        context = self._memory.GetMyMutableContextFromRoot(root)
        context.SetDiscreteState(self._limiter.at_rest(q))

    @classmethod
    def add_to_builder(
        cls,
        builder: DiagramBuilder,
        plant: MultibodyPlant,
        mount: HandMount,
    ) -> "ArmController":
        """Add a controller at the plant's own period and wire it to the plant."""
        arm = plant.GetModelInstanceByName(ARM)
        controller = builder.AddNamedSystem(
            "arm_controller", cls(control_model(plant, mount), period=plant.time_step())
        )
        builder.Connect(plant.get_state_output_port(arm), controller.GetInputPort("state"))
        builder.Connect(
            controller.GetOutputPort("desired_state"), plant.get_desired_state_input_port(arm)
        )
        builder.Connect(controller.GetOutputPort("weight"), plant.get_actuation_input_port(arm))
        return controller
