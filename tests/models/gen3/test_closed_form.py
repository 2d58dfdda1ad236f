"""The Gen3's closed-form inverse kinematics against the plant's forward kinematics."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from models.errors import ModelError
from models.gen3 import branches, chain
from models.gen3.branches import BRANCHES, wrist_in_reach
from models.gen3.chain import HAND_LENGTH, LIMIT, forward
from models.gen3.closed_form import solve_batch, solve_branches, solve_first
from models.gen3.newton import MET, OUT_OF_REACH
from models.rotations import geodesic_angle
from models.scenes.planning_scene import HOME, PlanningScene

COUNT = 3000
STRAIGHT = 0.05
"""Wrist angle |q6| [rad] below which answers may be missing."""


@pytest.fixture(scope="module")
def scene():
    return PlanningScene()


@pytest.fixture(scope="module")
def postures():
    bound = np.minimum(LIMIT, np.pi)
    return np.random.default_rng(0).uniform(-bound, bound, (COUNT, 7))


@pytest.fixture(scope="module")
def answers(postures):
    """The branches of every posture's own pose and q3."""
    return [solve_branches(*forward(q), q[2]) for q in postures]


def poses(postures):
    pairs = [forward(q) for q in postures]
    return np.array([R for R, _ in pairs]), np.array([p for _, p in pairs])


def apart(a, b):
    """Largest difference of the joint angles, modulo whole turns."""
    return np.abs((a - b + np.pi) % (2.0 * np.pi) - np.pi).max(axis=-1)


def assert_exact(q, R, p):
    R_BE, p_BE = forward(q)
    assert np.linalg.norm(p_BE - p) < 1e-9
    assert geodesic_angle(R_BE, R) < 1e-9


def test_constants_are_the_descriptions(scene):
    joints = [scene.plant.GetJointByName(f"joint_{i}") for i in range(1, 8)]
    joints.append(scene.plant.GetJointByName("end_effector"))
    for joint, y, z, roll in zip(joints, chain.Y, chain.Z, chain.ROLL, strict=True):
        X_PF = joint.frame_on_parent().GetFixedPoseInBodyFrame()
        X_MC = joint.frame_on_child().GetFixedPoseInBodyFrame()
        expected = RigidTransform(RollPitchYaw(roll, 0.0, 0.0), np.array([0.0, y, z]))
        assert X_PF.IsNearlyEqualTo(expected, 1e-13)
        assert X_MC.IsExactlyIdentity()
    np.testing.assert_array_equal(scene.upper, LIMIT)
    np.testing.assert_array_equal(scene.lower, -LIMIT)


def test_every_posture_is_among_its_own_branches(postures, answers):
    missed = [
        q for q, found in zip(postures, answers, strict=True) if (apart(found, q) > 1e-6).all()
    ]
    # Only a straight wrist excuses an absence, and not often.
    assert all(abs(q[5]) < STRAIGHT for q in missed)
    assert len(missed) <= 0.002 * COUNT


def test_every_answer_is_exact_within_the_limits_and_unlike_the_others(postures, answers):
    for q, found in zip(postures, answers, strict=True):
        R, p = forward(q)
        assert 1 <= len(found) <= BRANCHES
        assert (np.abs(found) <= LIMIT).all()
        for i, answer in enumerate(found):
            assert_exact(answer, R, p)
            assert answer[2] == q[2]
            assert (apart(found[:i], answer) > 1e-6).all()


def test_every_answer_meets_the_pose_by_the_plants_kinematics(scene, postures, answers):
    for q, found in zip(postures[:500], answers[:500], strict=True):
        X_WG = scene.forward(q)
        for answer in found:
            position, angle = scene.error(answer, X_WG)
            assert position < 1e-9
            assert angle < 1e-9


def test_there_are_eight_branches_somewhere(answers):
    assert max(len(found) for found in answers) == BRANCHES


@pytest.mark.parametrize("distance", [0.91, 1.0, 5.0, 1e200])
def test_a_pose_out_of_reach_has_no_branch(distance):
    R, _ = forward(HOME)
    p = np.array([distance, 0.0, 0.28481])
    for q3 in np.linspace(-np.pi, np.pi, 9):
        assert solve_branches(R, p, q3).shape == (0, 7)


@pytest.mark.parametrize(
    "straight",
    [[5], [3], [1, 2], [1, 3], [3, 5], [1, 2, 3, 4, 5], [0, 1, 2, 3, 4, 5, 6]],
    ids=lambda joints: "q" + "".join(str(joint + 1) for joint in joints),
)
def test_singular_postures_have_an_answer_and_all_are_exact(postures, straight):
    for q in postures[:200].copy():
        q[straight] = 0.0
        R, p = forward(q)
        found = solve_branches(R, p, q[2])
        assert 1 <= len(found) <= BRANCHES
        for answer in found:
            assert_exact(answer, R, p)
            assert (np.abs(answer) <= LIMIT).all()


def test_a_wrist_on_the_first_axis_gives_exact_answers_or_none():
    q3 = np.random.default_rng(1).uniform(0.2, 2.9, 200)
    upper, forearm = branches._UPPER_ARM, branches._FOREARM
    elbow, shoulder = branches._ELBOW_OFFSET, branches._SHOULDER_OFFSET
    q4 = np.arcsin(-(elbow * np.cos(q3) + shoulder) / (np.sin(q3) * forearm))
    x = np.cos(q3) * forearm * np.sin(q4) - np.sin(q3) * elbow
    q2 = np.arctan(-x / (forearm * np.cos(q4) + upper))
    for angles in zip(q2, q3, q4, strict=True):
        R, p = forward(np.array([0.3, *angles, 0.5, 1.0, -2.0]))
        for answer in solve_branches(R, p, angles[1]):
            assert_exact(answer, R, p)


def test_batch_equals_single(postures):
    R, p = poses(postures[:40])
    grid = np.linspace(-np.pi, np.pi, 7)
    batch = solve_batch(R, p, grid)
    assert batch.shape == (40, 7, BRANCHES, 7)
    exists = ~np.isnan(batch)
    assert (exists.all(axis=-1) == exists.any(axis=-1)).all()
    for i in range(40):
        for j, q3 in enumerate(grid):
            single = solve_branches(R[i], p[i], q3)
            np.testing.assert_array_equal(batch[i, j][exists[i, j, :, 0]], single)


def test_the_first_answer_is_one_of_the_branches(postures):
    R, p = poses(postures[:200])
    grid = np.linspace(-np.pi, np.pi, 33)
    q, status = solve_first(R, p, grid)
    assert (status == MET).all()
    for i, answer in enumerate(q):
        # Angles follow a pose met within 1e-6 by the square root where elbow or wrist are straight.
        if abs(answer[5]) > STRAIGHT:
            assert apart(solve_branches(R[i], p[i], answer[2]), answer).min() < 2e-3
        R_BE, p_BE = forward(answer)
        assert np.linalg.norm(p_BE - p[i]) < 2e-6
        assert geodesic_angle(R_BE, R[i]) < 2e-6


def test_reach_is_denied_to_no_posture_and_to_what_is_too_far_or_near(postures):
    for q in postures:
        assert wrist_in_reach(*forward(q))
    folded = np.array([0.3, 0.4, 0.0, LIMIT[3], 0.5, 0.6, 0.7])
    assert wrist_in_reach(*forward(folded))
    R, p = forward(HOME)
    shoulder = np.array([0.0, 0.0, 0.28481])
    for distance in (0.05, 1.2):
        p = shoulder + HAND_LENGTH * R[:, 2] + np.array([distance, 0.0, 0.0])
        assert not wrist_in_reach(R, p)
        q, status = solve_first(R[None], p[None], np.linspace(-np.pi, np.pi, 9))
        assert np.isnan(q).all()
        assert status[0] == OUT_OF_REACH
        assert np.isnan(solve_batch(R[None], p[None], np.linspace(-np.pi, np.pi, 99))).all()


def test_home_is_found_from_the_lists_of_its_numbers():
    R, p = forward(HOME)
    found = solve_branches(R.tolist(), p.tolist(), HOME[2])
    assert apart(found, HOME).min() < 1e-9


@pytest.mark.parametrize(
    ("R", "p", "q3", "message"),
    [
        (np.eye(3), np.zeros((1, 3)), np.zeros(1), r"wanted \[n, 3, 3\]"),
        (np.eye(3)[None], np.zeros((2, 3)), np.zeros(1), r"wanted \[n, 3, 3\]"),
        (np.eye(3)[None], np.zeros((1, 3)), np.float64(0.0), r"wanted \[n, 3, 3\]"),
        (np.eye(3)[None], np.full((1, 3), np.nan), np.zeros(1), "not finite"),
        (np.eye(3)[None], np.zeros((1, 3)), np.array([np.inf]), "not finite"),
        (2.0 * np.eye(3)[None], np.zeros((1, 3)), np.zeros(1), "not a rotation"),
    ],
)
def test_what_is_no_pose_is_refused(R, p, q3, message):
    with pytest.raises(ModelError, match=message):
        solve_batch(R, p, q3)


@pytest.mark.parametrize("joint", [1, 3, 5])
def test_a_posture_with_a_joint_at_its_limit_is_among_its_own_branches(joint):
    """But for the few beside a singularity, as the module's first lines say."""
    rng = np.random.default_rng(joint)
    low = np.minimum(LIMIT, np.pi)
    postures = rng.uniform(-low, low, (200, 7))
    postures[:, joint] = rng.choice([-1.0, 1.0], 200) * LIMIT[joint]
    missing = 0
    for q in postures:
        R, p = forward(q)
        answers = solve_branches(R, p, q[2])
        assert (np.abs(answers) <= LIMIT).all()
        away = np.abs((answers - q + np.pi) % (2.0 * np.pi) - np.pi).max(axis=1, initial=0.0)
        missing += not (away < 1e-6).any()
    assert missing <= 1
