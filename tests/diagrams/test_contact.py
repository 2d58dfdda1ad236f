import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from diagrams.contact import IMPACT_SPEED, dissipation, set_restitution, use_grasp_contact
from models.errors import ModelError
from models.scenes.parsing import CUBE, add_models

ACCURACY = 1e-6
TOP = 0.5
FALLEN = np.sqrt(2 * 9.81 * 0.08)
"""Of a cube that fell by 8 cm [m/s]."""
FLAT = np.eye(3)
CORNER = RotationMatrix.MakeXRotation(np.arctan(np.sqrt(2.0))).matrix() @ (
    RotationMatrix.MakeZRotation(np.pi / 4).matrix()
)


@pytest.fixture(scope="module")
def falling_cube():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    use_grasp_contact(plant)
    add_models(plant, "table.sdf", "cube.sdf")
    table = RigidTransform([0.0, 0.0, TOP])
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("table"), table)
    plant.Finalize()
    return builder.Build(), plant, scene_graph


def rebound(falling_cube, R_WO, restitution):
    """Of the cube's centre, speed after its first blow ÷ before; of the cube, kinetic energy."""
    diagram, plant, scene_graph = falling_cube
    simulator = Simulator(diagram)
    root = simulator.get_mutable_context()
    context = plant.GetMyMutableContextFromRoot(root)
    set_restitution(plant, scene_graph, root, restitution)
    height = TOP + 0.02 * np.abs(R_WO[2]).sum() + 0.08
    cube = plant.GetBodyByName(CUBE)
    plant.SetFreeBodyPose(context, cube, RigidTransform(RotationMatrix(R_WO), [0.0, 0.0, height]))
    ResetIntegratorFromFlags(simulator, "cenic", 0.005)
    simulator.get_mutable_integrator().set_target_accuracy(ACCURACY)
    simulator.Initialize()
    simulator.AdvanceTo(np.sqrt(2 * 0.08 / 9.81) - 0.002)
    fastest, energy = 0.0, 0.0
    for _ in range(40):
        simulator.AdvanceTo(root.get_time() + 5e-4)
        rising = cube.EvalSpatialVelocityInWorld(context).translational()[2]
        if rising > fastest:
            fastest, energy = rising, plant.CalcKineticEnergy(context)
    mass = cube.get_mass(context)
    return fastest / FALLEN, energy / (0.5 * mass * FALLEN**2)


def restitution_at(speed, chosen):
    """Of a contact that has a chosen one at `IMPACT_SPEED`: u − ln(1 + u) stays the same."""
    u = dissipation(chosen, IMPACT_SPEED) * speed
    return -brentq(lambda v: v - np.log1p(v) - (u - np.log1p(u)), -1 + 1e-15, -1e-9) / u


@pytest.mark.parametrize("exponent", [1.0, 1.5, 3.0])
@pytest.mark.parametrize("restitution", [0.05, 0.5, 0.98])
def test_dissipation_gives_the_restitution_whatever_the_spring(restitution, exponent):
    speed, d = 1.3, dissipation(restitution, 1.3)

    def motion(_, y):
        depth = max(y[0], 0.0)
        return [y[1], -1e4 * depth**exponent * max(0.0, 1.0 + d * y[1])]

    def left(_, y):
        return y[0]

    left.terminal, left.direction = True, -1
    blow = solve_ivp(motion, (0, 100), [0.0, speed], events=left, rtol=1e-9, atol=1e-12)
    assert -blow.y_events[0][0][1] / speed == pytest.approx(restitution, rel=1e-4)


@pytest.mark.parametrize("restitution", [0.0, 1.0, np.nan])
def test_a_restitution_that_no_dissipation_gives_is_refused(restitution):
    with pytest.raises(ModelError, match=r"restitution.*0\.05 to 0\.98"):
        dissipation(restitution, 1.0)


@pytest.mark.parametrize("R_WO", [FLAT, CORNER], ids=["flat", "corner"])
@pytest.mark.parametrize("restitution", [0.3, 0.5, 0.7])
def test_a_cube_that_falls_on_its_axis_rebounds_as_chosen(falling_cube, R_WO, restitution):
    speed, energy = rebound(falling_cube, R_WO, restitution)
    # A corner gives way for 5 ms, in which its weight takes 0.04 of the speed.
    assert speed == pytest.approx(restitution_at(FALLEN, restitution), abs=0.04)
    # It rises as it fell, without spin: its energy is that of its centre.
    assert energy == pytest.approx(speed**2, rel=1e-2)
