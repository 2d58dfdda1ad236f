"""The 2F-85 as its user sees it: an opening in metres goes in, opening and force come out."""

from functools import lru_cache

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    ModelInstanceIndex,
    PdControllerGains,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.framework import BasicVector, Context, Diagram, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import MatrixGain

from diagrams.reference_ramp import ReferenceRamp
from models.arrays import finite_number
from models.errors import ModelError
from models.scenes import gripper
from models.task.spaces import CUBE_EDGE

GRIP_FORCE = 40.0
"""Force of each pad on what it holds [N]."""
FORCE_RANGE = (20.0, 235.0)
"""What the vendor's gripper can do [N]."""
KNUCKLE_SPEED = 0.5
"""Knuckle velocity limit [rad/s]: the gap between the pads closes at about 0.05 m/s, each pad doing
half of it."""
FINGER_INERTIA = 0.005
"""Of each moving part of the fingers about its joint, besides its own [kg m²]."""
_GAINS = PdControllerGains(p=100.0, d=2.0)
_BOTH = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 1.0]])
"""From one knuckle's position and velocity to the desired state of the two actuators."""


def prepare_gripper(
    plant: MultibodyPlant, hand: ModelInstanceIndex, grip_force: float = GRIP_FORCE
) -> None:
    """Give both knuckles the same implicit position control, limited to the grip force.

    Call before ``plant.Finalize()``. The torque limit is the one that presses the pads on a
    4 cm cube with ``grip_force`` [N]; equal on both sides, so that neither finger leads.

    Raises:
        ModelError: if the force is not one that the vendor's gripper can do.
    """
    low, high = FORCE_RANGE
    valid = f"{low:g} to {high:g} N"
    if not low <= finite_number(grip_force, "grip_force", valid=valid) <= high:
        raise ModelError(f"grip_force: {grip_force:g}; valid: {valid}")
    torque = grip_force * float(gripper.closing_rate(gripper.knuckle_angle(CUBE_EDGE)))
    for side in ("left", "right"):
        actuator = plant.GetJointActuatorByName(f"{side}_knuckle", hand)
        actuator.set_controller_gains(_GAINS)
        actuator.set_effort_limit(torque)


def add_finger_inertia(
    plant: MultibodyPlant, context: Context, hand: ModelInstanceIndex, inertia: float
) -> None:
    """Give each moving part of the fingers more inertia about its joint [kg m²], in a context.

    As rotors behind gears do: `FINGER_INERTIA` is what MuJoCo Menagerie's model of the 2F-85 gives
    its drivers. It also lets error control take long steps: how far the couplers give under the
    grip's load depends on the length of a step and on this inertia, and without it the fingers
    tremble as the length changes.
    """
    for side in ("left", "right"):
        for part in ("outer_knuckle", "inner_knuckle", "inner_finger"):
            body = plant.GetBodyByName(f"{side}_{part}", hand)
            own = body.default_spatial_inertia()
            mass = own.get_mass()
            unit = own.get_unit_inertia().CopyToFullMatrix3() + inertia / mass * np.eye(3)
            moments, products = unit.diagonal(), (unit[0, 1], unit[0, 2], unit[1, 2])
            body.SetSpatialInertiaInBodyFrame(
                context, SpatialInertia(mass, own.get_com(), UnitInertia(*moments, *products))
            )


@lru_cache(maxsize=16)
def _knuckle_angle(width: float) -> float:
    """Of an opening [m]; asked at every step, and the same for many."""
    return float(gripper.knuckle_angle(width))


class _KnuckleCommand(LeafSystem):
    """Opening [m] to knuckle angle [rad]."""

    def __init__(self) -> None:
        super().__init__()
        opening = self.DeclareVectorInputPort("opening", 1)

        def calc(context: Context, output: BasicVector) -> None:
            place = f"gripper.position_command at {context.get_time():.3f} s"
            width = finite_number(float(opening.Eval(context)[0]), place, valid="metres")
            output[0] = _knuckle_angle(width)

        self.DeclareVectorOutputPort("knuckle", 1, calc, {opening.ticket()})


class _Measured(LeafSystem):
    """Knuckle angle and torque to opening [m] and pad force [N]."""

    def __init__(self, plant: MultibodyPlant, hand: ModelInstanceIndex) -> None:
        super().__init__()
        state = self.DeclareVectorInputPort("state", plant.num_multibody_states(hand))
        torque = self.DeclareVectorInputPort("torque", plant.num_actuators(hand))
        joint = plant.GetJointByName("left_knuckle", hand)
        positions = plant.GetPositionsFromArray(hand, np.arange(plant.num_positions()))
        knuckle = positions.tolist().index(joint.position_start())

        def calc_opening(context: Context, output: BasicVector) -> None:
            output[0] = gripper.opening(state.Eval(context)[knuckle])

        def calc_force(context: Context, output: BasicVector) -> None:
            rate = gripper.closing_rate(state.Eval(context)[knuckle])
            output[0] = torque.Eval(context).mean() / rate

        # The plant computes torques within its step, from the state at the step's start.
        self.DeclareVectorOutputPort("position_measured", 1, calc_opening, {state.ticket()})
        self.DeclareVectorOutputPort("force_measured", 1, calc_force)


class GripperController(Diagram):
    """Opens and closes a prepared 2F-85 at limited speed and force.

    ::

                          ┌───────────────────┐
       position_command ──┤                   ├── desired_state      (to the plant)
      (plant) state ──────┤ GripperController ├── position_measured  [m]
      (plant) torque ─────┤                   ├── force_measured     [N] per pad
                          └───────────────────┘

    `position_command` is the opening between the pads in metres. A command of 0 closes on
    whatever lies between and holds it with the grip force. The reference starts where
    `set_opening` puts it.
    """

    def __init__(self, plant: MultibodyPlant, hand: ModelInstanceIndex, *, period: float) -> None:
        """Control model instance ``hand`` of ``plant``, updated every ``period`` seconds.

        Raises:
            ModelError: if the period is not above 0.
        """
        super().__init__()
        builder = DiagramBuilder()
        command = builder.AddNamedSystem("knuckle_command", _KnuckleCommand())
        self._ramp = builder.AddNamedSystem(
            "ramp", ReferenceRamp(1, speed=KNUCKLE_SPEED, period=period)
        )
        both = builder.AddNamedSystem("both_knuckles", MatrixGain(_BOTH))
        measured = builder.AddNamedSystem("measured", _Measured(plant, hand))
        builder.Connect(command.get_output_port(), self._ramp.get_input_port())
        builder.Connect(self._ramp.get_output_port(), both.get_input_port())
        builder.ExportInput(command.get_input_port(), "position_command")
        builder.ExportInput(measured.GetInputPort("state"), "state")
        builder.ExportInput(measured.GetInputPort("torque"), "torque")
        builder.ExportOutput(both.get_output_port(), "desired_state")
        for name in ("position_measured", "force_measured"):
            builder.ExportOutput(measured.GetOutputPort(name), name)
        builder.BuildInto(self)

    def set_opening(self, context: Context, width: float) -> None:
        """Put the reference at an opening of ``width`` metres, at rest.

        Raises:
            ModelError: if ``width`` is not a finite number.
        """
        width = finite_number(width, "width", valid="metres")
        ramp_context = self._ramp.GetMyMutableContextFromRoot(context)
        self._ramp.set_reference(ramp_context, [float(gripper.knuckle_angle(width))])

    @classmethod
    def add_to_builder(
        cls,
        builder: DiagramBuilder,
        plant: MultibodyPlant,
        hand: ModelInstanceIndex,
    ) -> "GripperController":
        """Add a controller at the plant's own period and wire it to the plant."""
        controller = builder.AddNamedSystem(
            "gripper_controller", cls(plant, hand, period=plant.time_step())
        )
        builder.Connect(
            controller.GetOutputPort("desired_state"), plant.get_desired_state_input_port(hand)
        )
        builder.Connect(plant.get_state_output_port(hand), controller.GetInputPort("state"))
        builder.Connect(
            plant.get_net_actuation_output_port(hand), controller.GetInputPort("torque")
        )
        return controller
