import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialVelocity

from diagrams.falls.scene import FallScene, Hand, travel
from diagrams.trials.landing import Release, come_to_rest
from models.task.spaces import REST_HEIGHT, TABLE_TOP

X, Y = 0.55, 0.1
MATERIAL = {"friction": 0.8, "mass": 0.1, "restitution": 0.5}


@pytest.fixture(scope="module")
def fall():
    """Let a cube fall by 8 cm, far below a hand: ``fall(R_WO, V_WO, limit)``; where it ends."""
    scene = FallScene(edge=False)

    def fallen(R_WO, V_WO=None, limit=3.0, hand=2.0, opens=False, rise=0.0):
        height = TABLE_TOP + 0.02 * np.abs(R_WO[2]).sum() + 0.08
        X_WO = RigidTransform(RotationMatrix(R_WO), [X, Y, height])
        X_WB = RigidTransform(RotationMatrix.MakeXRotation(np.pi), [X, Y, hand])
        release = Release(Hand(X_WB, 0.4), opens, X_WO, V_WO or SpatialVelocity.Zero())
        end = come_to_rest(scene, release, rise, limit, **MATERIAL)
        return end.X_WO, end.V_WO

    return fallen


def turned(axis, angle):
    about = {"x": RotationMatrix.MakeXRotation, "y": RotationMatrix.MakeYRotation}[axis]
    return about(angle).matrix()


def test_a_level_cube_lands_where_it_was_let_go(fall):
    X_WO, V_WO = fall(np.eye(3))
    np.testing.assert_allclose(X_WO.translation(), [X, Y, REST_HEIGHT], atol=1e-4)
    np.testing.assert_allclose(X_WO.rotation().matrix(), np.eye(3), atol=1e-3)
    assert np.linalg.norm(V_WO.get_coeffs()) < 1e-6


@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_fall_and_its_mirror_image_end_as_mirror_images(fall, axis):
    one, _ = fall(turned(axis, 0.3), limit=0.3)
    other, _ = fall(turned(axis, -0.3), limit=0.3)
    mirror = np.diag([-1.0, 1.0, 1.0] if axis == "y" else [1.0, -1.0, 1.0])
    centre = np.array([X, Y, 0.0])
    there = mirror @ (one.translation() - centre)
    np.testing.assert_allclose(other.translation() - centre, there, atol=2e-4)
    expected = mirror @ one.rotation().matrix() @ mirror
    np.testing.assert_allclose(other.rotation().matrix(), expected, atol=1e-2)


def test_energy_is_never_won(fall):
    """No cube comes higher or faster than its fall allows."""
    rng = np.random.default_rng(0)
    for _ in range(4):
        R = RotationMatrix.MakeZRotation(rng.uniform(0, 6)).matrix() @ turned(
            "x", rng.uniform(0, 3)
        )
        X_WO, V_WO = fall(R, limit=0.3)
        bottom = X_WO.translation()[2] - 0.02 * np.abs(X_WO.rotation().matrix()[2]).sum()
        assert -1e-3 < bottom - TABLE_TOP < 0.08
        assert 0.5 * np.linalg.norm(V_WO.translational()) ** 2 < 9.81 * 0.1


@pytest.mark.parametrize("angle", [0.5, 1.2])
def test_a_cube_comes_to_rest_on_a_face(fall, angle):
    X_WO, V_WO = fall(turned("y", angle))
    assert X_WO.translation()[2] == pytest.approx(REST_HEIGHT, abs=1e-4)
    assert np.abs(X_WO.rotation().matrix()[2]).max() == pytest.approx(1.0, abs=1e-4)
    assert np.linalg.norm(V_WO.get_coeffs()) < 1e-3


def test_a_rolling_cube_finds_no_edge(fall):
    X_WO, _ = fall(np.eye(3), SpatialVelocity([0.0, 20.0, 0.0], [1.5, 0.0, 0.0]))
    assert X_WO.translation()[0] > X + 0.2
    assert X_WO.translation()[2] == pytest.approx(REST_HEIGHT, abs=1e-3)


def test_a_hand_that_opens_and_rises_leaves_a_level_cube_alone(fall):
    away, _ = fall(np.eye(3))
    beside, _ = fall(np.eye(3), hand=0.75, opens=True, rise=0.1)
    assert travel(away, beside) < 1e-4
