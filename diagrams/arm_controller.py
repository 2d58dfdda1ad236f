"""The Gen3's joints follow a position command, as the vendor's low-level servoing does."""

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, PdControllerGains
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import StateInterpolatorWithDiscreteDerivative

N_JOINTS = 7
_LARGE = PdControllerGains(p=4000.0, d=200.0)
"""Joints 1 to 4 [N m/rad, N m s/rad]: half a milliradian off under the heaviest posture."""
_SMALL = PdControllerGains(p=1000.0, d=30.0)
"""Joints 5 to 7."""


def prepare_arm(plant: MultibodyPlant, arm: ModelInstanceIndex) -> None:
    """Give the arm's joints implicit position control within their torque limits.

    Call before ``plant.Finalize()``. The vendor's controller compensates the arm's weight; so
    does this one, ideally: gravity does not act on ``arm``. The load in the hand it feels.
    """
    plant.set_gravity_enabled(arm, False)
    for i in range(1, N_JOINTS + 1):
        actuator = plant.GetJointActuatorByName(f"joint_{i}", arm)
        actuator.set_controller_gains(_LARGE if i <= 4 else _SMALL)


class ArmController(StateInterpolatorWithDiscreteDerivative):
    """Turns `position_command` [rad] into the desired state that the joints' control follows.

    ::

                        ┌───────────────┐
       position_command ┤ ArmController ├ desired_state  [position, velocity]
                        └───────────────┘

    The velocity is the command's discrete derivative; the first command counts as at rest.
    """

    @classmethod
    def add_to_builder(
        cls, builder: DiagramBuilder, plant: MultibodyPlant, arm: ModelInstanceIndex
    ) -> "ArmController":
        """Add a controller at the plant's own period and wire it to the plant."""
        controller = builder.AddNamedSystem(
            "arm_controller",
            cls(N_JOINTS, plant.time_step(), suppress_initial_transient=True),
        )
        builder.Connect(controller.get_output_port(), plant.get_desired_state_input_port(arm))
        return controller
