"""The Gen3 Lite's inverse kinematics against its own forward kinematics and brute force."""

import numpy as np
import pytest

from models.errors import ModelError
from models.gen3_lite.chain import LIMIT, forward, tune
from models.gen3_lite.ik import solve, solve_batch, within_limits
from models.gen3_lite.polynomial import SOLUTIONS, out_of_reach, polynomials
from models.gen3_lite.trigonometric_roots import trigonometric_roots
from models.rotations import geodesic_angle, rotation_z
from models.task.spaces import R_WG

COUNT = 1000
SIXTEEN = np.array([1.18, 1.03, 2.5, 1.6, 0.19, -1.9])
"""A configuration whose pose has 16 solutions."""


@pytest.fixture(scope="module")
def postures():
    return np.random.default_rng(0).uniform(-LIMIT, LIMIT, (COUNT, 6))


@pytest.fixture(scope="module")
def poses(postures):
    pairs = [forward(q) for q in postures]
    return np.array([R for R, _ in pairs]), np.array([p for _, p in pairs])


@pytest.fixture(scope="module")
def solutions(poses):
    return solve_batch(*poses)


def apart(a, b):
    """Largest difference of the joint angles, modulo whole turns."""
    return np.abs((a - b + np.pi) % (2.0 * np.pi) - np.pi).max(axis=-1)


def assert_exact(q, R, p):
    R_BE, p_BE = forward(q)
    assert np.abs(p_BE - p).max() < 1e-11
    assert geodesic_angle(R_BE, R) < 1e-9  # the angle itself resolves 1e-9 only


def by_brute_force(R, p, rng, starts):
    tuned = [tune(start, R, p) for start in rng.uniform(-np.pi, np.pi, (starts, 6))]
    return np.array([q for q in tuned if q is not None]).reshape(-1, 6)


def test_every_posture_is_among_the_solutions_of_its_pose(postures, solutions):
    nearest = np.nanmin(apart(solutions.q, postures[:, None]), axis=1)
    assert nearest.max() < 1e-6


def test_every_solution_is_exact_and_unlike_the_others(poses, solutions):
    for R, p, padded in zip(*poses, solutions.q, strict=True):
        found = padded[~np.isnan(padded[:, 0])]
        assert (np.abs(found) <= np.pi).all()
        for i, q in enumerate(found):
            assert_exact(q, R, p)
            assert (apart(found[:i], q) > 1e-6).all()


def test_solutions_come_in_pairs_up_to_sixteen(solutions):
    counts = (~np.isnan(solutions.q[..., 0])).sum(axis=1)
    assert (counts % 2 == 0).all()
    assert len(solve(*forward(SIXTEEN))) == SOLUTIONS


def test_brute_force_finds_no_further_solution(poses, solutions):
    rng = np.random.default_rng(1)
    for i in range(40):
        R, p = poses[0][i], poses[1][i]
        found = solutions.q[i][~np.isnan(solutions.q[i, :, 0])]
        others = by_brute_force(R, p, rng, 100)
        assert len(others) > 20
        assert apart(others[:, None], found[None]).min(axis=1).max() < 1e-5


def test_brute_force_agrees_on_the_tasks_orientations():
    """Vertical and level hands give multiple roots."""
    rng = np.random.default_rng(2)
    solved = 0
    for gripper in np.repeat(range(18), 4):
        p = np.round(rng.uniform([-0.4, -0.4, 0.0], [0.4, 0.4, 0.6]) / 0.05) * 0.05
        found = solve(R_WG[gripper], p)
        others = by_brute_force(R_WG[gripper], p, rng, 60)
        solved += len(found) > 0
        assert len(found) % 2 == 0
        assert len(found) or not len(others)
        if len(others):
            assert apart(others[:, None], found[None]).min(axis=1).max() < 1e-3
    assert solved > 30


def test_f_is_of_degree_eight_and_vanishes_at_the_solutions(poses, solutions):
    """17 values give every other one, as if F had no further harmonic."""
    R, p = poses
    values = polynomials(R, p)
    harmonics = np.fft.rfft(values) / 17
    for shift in (0.1, 1.0, 2.5):
        # A hand turned about its own z axis shifts q6.
        shifted = polynomials(np.ascontiguousarray(R @ rotation_z(-shift)), p)[:, 0]
        waves = np.exp(1j * shift * np.arange(9)) * np.where(np.arange(9), 2.0, 1.0)
        expected = (harmonics * waves).sum(axis=1).real
        assert (np.abs(shifted - expected) < 1e-13 * np.abs(values).max(axis=1)).all()
    # Nearest root to each solution, but for the rounding of the description's right angles.
    roots = np.exp(1j * solutions.q[:, :, None, 5]) - trigonometric_roots(values)[:, None]
    assert np.nanmax(np.abs(roots).min(axis=2)) < 0.02
    assert np.nanmedian(np.abs(roots).min(axis=2)) < 1e-5


def test_stages_are_recorded(solutions):
    exists = ~np.isnan(solutions.q[..., 0])
    np.testing.assert_array_equal(np.isnan(solutions.rough_error), ~exists)
    np.testing.assert_array_equal(np.isnan(solutions.error), ~exists)
    # The description's rounded right angles, 3.7e-6 rad each, and nothing else.
    assert 1e-7 < np.nanmedian(solutions.rough_error) < 2e-5
    assert np.nanmax(solutions.error) < 1e-11
    assert (solutions.starts - solutions.failures >= exists.sum(axis=1)).all()


@pytest.mark.parametrize(
    "zero",
    [[1], [2], [3], [4], [1, 2], [3, 4], [1, 2, 3], [0, 1, 2, 3, 4, 5]],
    ids=lambda joints: "q" + "".join(str(joint + 1) for joint in joints),
)
def test_singular_postures_have_exact_solutions(postures, zero):
    for q in postures[:30].copy():
        q[zero] = 0.0
        R, p = forward(q)
        found = solve(R, p)
        assert len(found) > 0
        assert apart(found, q).min() < (0.02 if {1, 2} <= set(zero) else 1e-6)
        for solution in found:
            assert_exact(solution, R, p)


def test_out_of_reach_means_no_solution(poses):
    R, p = poses
    assert not out_of_reach(R, p).any()
    for distance in (0.75, 1.0, 50.0):
        far = np.array([distance, 0.0, 0.24325])
        assert out_of_reach(np.eye(3), far)
        assert solve(np.eye(3), far).shape == (0, 6)
    # Nearer than the arm is long, and yet none: a vertical hand.
    near = np.array([0.55, 0.0, 0.1]) - 0.13 * R_WG[10][:, 2]
    assert not out_of_reach(R_WG[10], near)
    assert len(solve(R_WG[10], near)) == 0


def test_limits_are_a_question_of_their_own(solutions):
    within = within_limits(solutions.q)
    assert 0 < within.sum() < (~np.isnan(solutions.q[..., 0])).sum()
    assert within.any(axis=1).all()
    assert within_limits(LIMIT) and within_limits(-LIMIT)
    assert within_limits(LIMIT + 1e-12)
    assert not within_limits(LIMIT + 1e-8 * np.eye(6)[5])
    assert not within_limits(np.full(6, np.nan))


def test_tuning_alone_converges_from_nearby_and_says_if_not(postures, poses):
    for q, R, p in zip(postures[:50], poses[0], poses[1], strict=False):
        tuned = tune(q + 1e-4, R, p)
        assert tuned is not None
        assert_exact(tuned, R, p)
    assert tune(np.zeros(6), np.eye(3), np.array([2.0, 0.0, 0.0])) is None


def test_batch_equals_single(poses, solutions):
    for i in range(30):
        q = solutions.q[i][~np.isnan(solutions.q[i, :, 0])]
        np.testing.assert_allclose(solve(poses[0][i], poses[1][i]), q, atol=1e-9)


@pytest.mark.parametrize(
    ("R", "p", "message"),
    [
        (np.eye(3), np.zeros((1, 3)), r"wanted \[n, 3, 3\]"),
        (np.eye(3)[None], np.zeros((2, 3)), r"wanted \[n, 3, 3\]"),
        (np.eye(3)[None], np.full((1, 3), np.nan), "not finite"),
        (2.0 * np.eye(3)[None], np.zeros((1, 3)), "not a rotation"),
    ],
)
def test_what_is_no_pose_is_refused(R, p, message):
    with pytest.raises(ModelError, match=message):
        solve_batch(R, p)


def test_a_posture_with_a_joint_at_its_limit_is_among_the_answers_within_the_limits():
    rng = np.random.default_rng(4)
    postures = rng.uniform(-LIMIT, LIMIT, (300, 6))
    joint = rng.integers(0, 6, 300)
    postures[range(300), joint] = rng.choice([-1.0, 1.0], 300) * LIMIT[joint]
    R, p = (np.array(parts) for parts in zip(*map(forward, postures), strict=True))
    answers = solve_batch(R, p).q
    for q, found, within in zip(postures, answers, within_limits(answers), strict=True):
        away = np.abs((found[within] - q + np.pi) % (2.0 * np.pi) - np.pi).max(axis=1)
        assert (away < 1e-6).any()
