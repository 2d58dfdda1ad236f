"""How contact is simulated wherever the gripper meets the cube.

Hydroelastic patches (pads and cube compliant, table rigid), Drake's lagged approximation,
2 ms, Hunt–Crossley dissipation 20 s/m in the model files. Under these, grasps of 0.05 to 1 kg
hold without slip and releases are quiet; point contact slips, and the SAP approximation kicks
the cube as the fingers open.
"""

from pydrake.multibody.plant import ContactModel, DiscreteContactApproximation, MultibodyPlant

TIME_STEP = 0.002
"""Discrete step [s]."""


def use_grasp_contact(plant: MultibodyPlant) -> None:
    """Choose the contact model and solver; call before ``plant.Finalize()``.

    The lagged approximation keeps the SAP solver, which couplers and implicit position
    control need.
    """
    plant.set_contact_model(ContactModel.kHydroelasticWithFallback)
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kLagged)
