import numpy as np
import pytest
from pydrake.math import RigidTransform

from diagrams.trials.record import TrialConfig
from diagrams.trials.references import GANTRY_SPEED
from diagrams.trials.rig import COLUMN, TrialRig
from diagrams.trials.scene import TrialScene
from models.scenes import gripper
from models.task.spaces import R_WG

START, GOAL = np.array([*COLUMN, 0.6]), np.array([0.57, -0.01, 0.7])
TURN = np.array([0.0, 0.0, 0.6])


@pytest.fixture(scope="module", params=["cenic", "discrete"])
def rig(request):
    return TrialRig(TrialConfig(solver=request.param))


def desired(rig, scene):
    """Gantry's positions and velocities, then a knuckle's angle, as the plant is told them."""
    context = rig.plant.GetMyContextFromRoot(scene._root)
    port = rig.plant.get_desired_state_input_port(rig.gantry)
    return np.append(port.Eval(context), rig.references.knuckle(scene._root))


def begun(rig):
    scene = TrialScene(rig, R_WG[10], TURN, friction=0.8, mass=0.1)
    scene.start(START, gripper.MAX_OPENING, RigidTransform([0.7, 0.1, 0.52]))
    return scene


def test_every_part_goes_at_its_own_speed_and_then_rests(rig):
    scene = begun(rig)
    scene.command(GOAL, 0.05, turned=True)
    scene.advance(0.3)
    told = desired(rig, scene)
    wanted = np.append(START, 0.0)
    way = np.append(GOAL, 0.6) - wanted
    wanted += np.sign(way) * np.minimum(np.abs(way), GANTRY_SPEED * 0.3)
    np.testing.assert_allclose(told[:4] / GANTRY_SPEED, wanted / GANTRY_SPEED, atol=0.004)
    opened = float(gripper.knuckle_angle(gripper.MAX_OPENING))
    assert told[8] == pytest.approx(opened + 0.5 * 0.3, abs=2e-3)
    scene.advance(0.9)
    told = desired(rig, scene)
    np.testing.assert_allclose(told[:8], [*GOAL, 0.6, 0.0, 0.0, 0.0, 0.0], atol=1e-9)
    assert told[8] == pytest.approx(float(gripper.knuckle_angle(0.05)), abs=1e-9)


def test_a_command_on_the_way_is_followed_from_where_it_came(rig):
    scene = begun(rig)
    scene.command(GOAL, 0.0)
    scene.advance(0.2)
    before = desired(rig, scene)
    scene.command(START, gripper.MAX_OPENING)
    scene.advance(0.05)
    after = desired(rig, scene)
    back = np.sign(before[:3] - START) * 0.1 * 0.05
    np.testing.assert_allclose(
        after[:3], before[:3] - np.where(before[:3] == START, 0, back), atol=5e-4
    )
    assert after[8] == pytest.approx(before[8] - 0.5 * 0.05, abs=2e-3)


def test_pads_press_with_the_grip_force_whatever_the_solver(rig):
    scene = TrialScene(rig, R_WG[10], friction=0.8, mass=0.1)
    scene.start(START, 0.0405, RigidTransform(START))
    scene.support(True)
    scene.command(START, 0.0)
    scene.advance(0.3)
    assert scene.pad_force == pytest.approx(40.0, rel=0.01)
    assert scene.opening == pytest.approx(0.04, abs=1e-3)


def test_finger_inertia_adds_to_the_energy_of_turning_fingers():
    energy = []
    for inertia in (0.0, 0.005):
        rig = TrialRig(TrialConfig(solver="cenic", finger_inertia=inertia))
        scene = begun(rig)
        for name, multiplier in zip(gripper.JOINTS, gripper.MULTIPLIERS, strict=True):
            rig.plant.GetJointByName(name, rig.hand).set_angular_rate(
                scene._context, 0.5 * multiplier
            )
        energy.append(rig.plant.CalcKineticEnergy(scene._context))
    # Both knuckles of a side turn at 0.5 rad/s, and the inner finger, turning back, not at all.
    assert energy[1] - energy[0] == pytest.approx(4 * 0.5 * 0.005 * 0.5**2, rel=1e-6)
