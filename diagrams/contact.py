"""How contact is simulated wherever the gripper meets the cube.

Hydroelastic patches (the cube compliant, pads and table rigid), Drake's lagged approximation,
Hunt–Crossley dissipation 20 s/m in the model files. Under these, grasps of 0.05 to 1 kg
hold without slip and releases are quiet; point contact slips, and the SAP approximation kicks
the cube as the fingers open. What is rigid meets the pads in points: let what is grasped be
compliant.
"""

from typing import Any, Literal

import numpy as np
from pydrake.geometry import GeometryId, ProximityProperties, Role, RoleAssign, SceneGraph
from pydrake.multibody.plant import (
    ContactModel,
    CoulombFriction,
    DiscreteContactApproximation,
    MultibodyPlant,
)
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from pydrake.systems.framework import Context
from scipy.optimize import brentq

from models.errors import ModelError
from models.scenes.parsing import CUBE
from models.task.spaces import CUBE_EDGE

Solver = Literal["discrete", "cenic"]
"""What can simulate contact: steps that are all equal, or Drake's CENIC, an integrator that
controls its error by the length of its steps."""
TIME_STEP = 0.002
"""Discrete step of a gripper without its arm [s]."""
RESTITUTIONS = (0.05, 0.98)
"""Coefficients of restitution that dissipation can give."""
RESTITUTION = 0.5
"""Coefficient of restitution of cube and table where none is drawn: wood on wood (see
`diagrams.trials.record`)."""
IMPACT_SPEED = 0.4
"""Of the blow that a restitution is of [m/s].

Hunt and Crossley's contact, which is what Drake has, rebounds the better the slower the blow: where
it gives 0.5 at 0.4 m/s it gives 0.22 at the 1.25 m/s of a fall by 8 cm, and 0.8 at 0.1. Of wood the
restitution hardly depends on the speed. At this speed as many cubes tumble as in MuJoCo, where it
does not at all: 1 of 48 from the lower layer (there 2) and 32 of 48 from the upper (28), let go
alike; at 1.25 m/s it would be 35 and 40."""


def use_grasp_contact(plant: MultibodyPlant) -> None:
    """Choose the contact model and solver; call before ``plant.Finalize()``.

    The lagged approximation keeps the SAP solver, which couplers and implicit position
    control need; CENIC, which integrates plants with continuous state, has its own.
    """
    plant.set_contact_model(ContactModel.kHydroelasticWithFallback)
    if plant.time_step() > 0.0:
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
    friction = CoulombFriction(coefficient, coefficient)
    for shape in scene_graph.model_inspector().GetAllGeometryIds():
        _set_material(plant, scene_graph, root, shape, "coulomb_friction", friction)


def friction_of(plant: MultibodyPlant, context: Context) -> float:
    """The cube's coefficient of friction, in a context of ``plant``."""
    inspector = plant.get_geometry_query_input_port().Eval(context).inspector()
    (shape,) = plant.GetCollisionGeometriesForBody(plant.GetBodyByName(CUBE))
    material = inspector.GetProximityProperties(shape)
    assert material is not None
    return float(material.GetProperty("material", "coulomb_friction").static_friction())


def set_restitution(
    plant: MultibodyPlant, scene_graph: SceneGraph, root: Context, restitution: float
) -> None:
    """Let the cube rebound from the table with a coefficient of restitution.

    The table is rigid, so that the dissipation of their contact is the cube's own.

    Args:
        plant: registered with ``scene_graph``.
        scene_graph: has the shapes.
        root: context of the diagram; the models themselves stay as they are.
        restitution: speed after a blow at `IMPACT_SPEED` ÷ before, within `RESTITUTIONS`.
    """
    frame = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName(CUBE).index())
    value = dissipation(restitution, IMPACT_SPEED)
    for shape in scene_graph.model_inspector().GetGeometries(frame, Role.kProximity):
        _set_material(plant, scene_graph, root, shape, "hunt_crossley_dissipation", value)


def dissipation(restitution: float, speed: float) -> float:
    """Hunt and Crossley's dissipation [s/m] of a contact that gives a restitution at a speed.

    Where the force is ``f(x)·(1 + d·ẋ)`` for any ``f`` that depends on penetration alone, the
    equation of motion ``m·ẋ·dẋ/dx = −f·(1 + d·ẋ)`` integrates to ``u − ln(1 + u)``, with
    ``u = d·ẋ``, being the same before and after the blow: stiffness, shape and mass drop out.

    Args:
        restitution: speed after ÷ before, within `RESTITUTIONS`.
        speed: before the blow [m/s].

    Raises:
        ModelError: if the restitution is outside of that.
    """
    least, most = RESTITUTIONS
    if not least <= restitution <= most:
        raise ModelError(f"restitution: {restitution}; valid: {least:g} to {most:g}")

    def gained(u: float) -> float:
        return u - np.log1p(u) - (-restitution * u - np.log1p(-restitution * u))

    # Positive for weak dissipation, negative where the speed after comes near 1/d, its limit.
    return float(brentq(gained, 1e-2, (1.0 - 1e-15) / restitution) / speed)


def _set_material(
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    root: Context,
    shape: GeometryId,
    name: str,
    value: Any,
) -> None:
    """Give one shape a property of its material, in one simulation."""
    context = scene_graph.GetMyMutableContextFromRoot(root)
    inspector = scene_graph.get_query_output_port().Eval(context).inspector()
    old = inspector.GetProximityProperties(shape)
    if old is None:
        return
    properties = ProximityProperties(old)
    properties.UpdateProperty("material", name, value)
    scene_graph.AssignRole(context, plant.get_source_id(), shape, properties, RoleAssign.kReplace)


def set_cube_mass(plant: MultibodyPlant, context: Context, mass: float) -> None:
    """Give the cube a mass [kg] in a context of ``plant``, evenly spread."""
    inertia = SpatialInertia(mass, np.zeros(3), UnitInertia.SolidCube(CUBE_EDGE))
    plant.GetBodyByName(CUBE).SetSpatialInertiaInBodyFrame(context, inertia)
