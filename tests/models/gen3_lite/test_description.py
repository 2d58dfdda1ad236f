"""The Gen3 Lite's description: joints, limits, kinematics and hand."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator

from models import dh
from models.gen3_lite import chain
from models.scenes.lite_gripper import JOINTS, LOWER, MAX_OPENING, UPPER, joint_positions, opening
from models.scenes.parsing import (
    DESCRIPTION,
    STATION_FILES,
    add_models,
    description_hash,
)
from models.scenes.planning_scene import PlanningScene
from models.scenes.robots import GEN3_LITE

# Joint origins [m] and turns [rad] in the parent, from the vendor's description.
ORIGINS = [
    ((0.0, 0.0, 0.12825), (0.0, 0.0, 0.0)),
    ((0.0, -0.03, 0.115), (1.5708, 0.0, 0.0)),
    ((0.0, 0.28, 0.0), (-3.1416, 0.0, 0.0)),
    ((0.0, -0.14, 0.02), (1.5708, 0.0, 0.0)),
    ((0.0285, 0.0, 0.105), (0.0, 1.5708, 0.0)),
    ((-0.105, 0.0, 0.0285), (0.0, -1.5708, 0.0)),
]
TOOL = 0.130
BASE = np.array([0.0, 0.0, 0.5])


@pytest.fixture(scope="module")
def scene():
    return PlanningScene(robot=GEN3_LITE)


@pytest.fixture(scope="module")
def postures():
    return np.random.default_rng(0).uniform(-chain.LIMIT, chain.LIMIT, (1000, 6))


def vendor_forward(q):
    X = RigidTransform()
    for (xyz, rpy), angle in zip(ORIGINS, q, strict=True):
        X = X @ RigidTransform(RollPitchYaw(rpy), xyz)
        X = X @ RigidTransform(RollPitchYaw(0.0, 0.0, angle), np.zeros(3))
    return X @ RigidTransform(np.array([0.0, 0.0, TOOL]))


def test_plant_agrees_with_the_vendors_joint_origins(scene, postures):
    for q in postures:
        X_BG, wanted = scene.forward(q), vendor_forward(q)
        assert np.abs(X_BG.translation() - BASE - wanted.translation()).max() < 1e-9
        assert np.abs(X_BG.rotation().matrix() - wanted.rotation().matrix()).max() < 1e-9


def test_plant_agrees_with_the_tables(scene, postures):
    p_WG = np.array([scene.forward(q).translation() for q in postures])
    R_WG = np.array([scene.forward(q).rotation().matrix() for q in postures])
    R, p = dh.forward_kinematics(dh.GEN3_LITE_DH, postures)
    assert np.linalg.norm(p_WG - BASE - p, axis=1).max() < 0.01e-3
    assert np.abs(R - R_WG).max() < 2e-5


def test_the_inverse_kinematics_chain_is_the_plants(scene, postures):
    for q in postures[:100]:
        R, p = chain.forward(q)
        X = scene.forward(q)
        assert np.abs(X.rotation().matrix() - R).max() < 1e-13
        assert np.abs(X.translation() - BASE - p - TOOL * R[:, 2]).max() < 1e-13


def test_limits_are_the_vendors(scene):
    np.testing.assert_array_equal(scene.upper, [2.68, 2.61, 2.61, 2.6, 2.53, 2.6])
    np.testing.assert_array_equal(scene.lower, -scene.upper)
    np.testing.assert_array_equal(scene.upper, chain.LIMIT)
    np.testing.assert_array_equal(scene.velocity_limit, [1.6, 1.6, 1.6, 1.6, 1.6, 3.2])
    efforts = [scene.plant.GetJointActuatorByName(name).effort_limit() for name in GEN3_LITE.joints]
    np.testing.assert_array_equal(efforts, [10.0, 14.0, 10.0, 7.0, 7.0, 7.0])
    # Table A.1 gives them in whole degrees.
    assert np.abs(scene.upper - dh.GEN3_LITE_DH.upper).max() < np.radians(1.0)


def test_fingers_open_symmetrically_by_the_width_asked_for(scene):
    plant = scene.plant
    # Middle of the tip's inner face, in its link.
    face = np.array([-0.018488, 0.0011091, 0.0])
    face += 0.0059 * np.array([np.sin(0.2455), np.cos(0.2455), 0.0])
    tcp = plant.GetFrameByName("tcp")
    for width in (0.01, 0.04, 0.1):
        scene.open_to(width)
        faces = np.array(
            [
                plant.CalcPointsPositions(
                    scene.context, plant.GetFrameByName(f"{side}_finger_dist"), face, tcp
                ).ravel()
                for side in ("right", "left")
            ]
        )
        np.testing.assert_allclose(faces[:, 1], [-width / 2, width / 2], atol=2e-5)
        np.testing.assert_allclose(faces[:, 0], 0.0, atol=1e-9)
        assert np.abs(faces[:, 2]).max() < 0.02


def test_opening_is_monotonic_and_inverted():
    widths = opening(np.linspace(LOWER, UPPER, 50))
    assert (np.diff(widths) > 0).all()
    for width in np.linspace(widths[0], MAX_OPENING, 7):
        assert abs(opening(joint_positions(width)[0]) - width) < 1e-6
    assert joint_positions(1.0)[0] == UPPER
    assert joint_positions(-1.0)[0] == LOWER


def test_the_mimic_joints_follow_the_first_as_the_hand_closes():
    plant = MultibodyPlant(time_step=2e-3)
    add_models(plant, "gen3_lite_2f.urdf")
    plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("gripper_base"))
    plant.Finalize()
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    joints = [plant.GetJointByName(name) for name in JOINTS]
    for joint, angle in zip(joints, joint_positions(0.1), strict=True):
        joint.set_angle(context, angle)
    plant.get_actuation_input_port().FixValue(context, [-5e-3, -5e-3])
    simulator.AdvanceTo(0.1)
    right, tip, left, other = (joint.get_angle(context) for joint in joints)
    assert right < joint_positions(0.08)[0]
    assert left == pytest.approx(right, abs=1e-3)
    assert (tip, other) == pytest.approx((-0.676 * right + 0.149,) * 2, abs=1e-3)


def test_the_gen3s_files_are_untouched():
    assert not set(STATION_FILES) - {p.name for p in DESCRIPTION.iterdir()}
    assert not any("lite" in name for name in STATION_FILES)
    assert description_hash(GEN3_LITE.files) != description_hash()
