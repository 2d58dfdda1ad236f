"""How contact is simulated wherever the gripper meets the cube.

Hydroelastic patches (pads and cube compliant, table rigid), Drake's lagged approximation,
2 ms, Hunt–Crossley dissipation 20 s/m in the model files. Under these, grasps of 0.05 to 1 kg
hold without slip and releases are quiet; point contact slips, and the SAP approximation kicks
the cube as the fingers open.
"""

import numpy as np
from pydrake.geometry import ProximityProperties, RoleAssign, SceneGraph
from pydrake.multibody.plant import (
    ContactModel,
    CoulombFriction,
    DiscreteContactApproximation,
    MultibodyPlant,
)
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from pydrake.systems.framework import Context

from models.scenes.parsing import CUBE
from models.task.spaces import CUBE_EDGE

TIME_STEP = 0.002
"""Discrete step [s]."""


def use_grasp_contact(plant: MultibodyPlant) -> None:
    """Choose the contact model and solver; call before ``plant.Finalize()``.

    The lagged approximation keeps the SAP solver, which couplers and implicit position
    control need.
    """
    plant.set_contact_model(ContactModel.kHydroelasticWithFallback)
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kLagged)


def set_friction(
    plant: MultibodyPlant, scene_graph: SceneGraph, root: Context, coefficient: float
) -> None:
    """Give everything in one simulation the same coefficient of friction.

    Args:
        plant: registered with ``scene_graph``.
        scene_graph: has the shapes.
        root: context of the diagram; the models themselves stay as they are.
        coefficient: static and dynamic alike.
    """
    inspector = scene_graph.model_inspector()
    context = scene_graph.GetMyMutableContextFromRoot(root)
    friction = CoulombFriction(coefficient, coefficient)
    for geometry_id in inspector.GetAllGeometryIds():
        old = inspector.GetProximityProperties(geometry_id)
        if old is None:
            continue
        properties = ProximityProperties(old)
        properties.UpdateProperty("material", "coulomb_friction", friction)
        scene_graph.AssignRole(
            context, plant.get_source_id(), geometry_id, properties, RoleAssign.kReplace
        )


def set_cube_mass(plant: MultibodyPlant, context: Context, mass: float) -> None:
    """Give the cube a mass [kg] in a context of ``plant``, evenly spread."""
    inertia = SpatialInertia(mass, np.zeros(3), UnitInertia.SolidCube(CUBE_EDGE))
    plant.GetBodyByName(CUBE).SetSpatialInertiaInBodyFrame(context, inertia)
