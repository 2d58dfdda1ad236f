import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialVelocity

from diagrams.contact import IMPACT_SPEED
from diagrams.falls.scene import Fall, FallScene, Hand, travel
from models.scenes import gripper
from models.task.spaces import TABLE_TOP

X, Y = 0.55, 0.1
MATERIAL = {"friction": 0.8, "mass": 0.1, "restitution": 0.5}
HEIGHT = IMPACT_SPEED**2 / (2 * 9.81)
AWAY = Hand(RigidTransform([0.0, 0.0, 2.0]), 0.0)


@pytest.fixture(scope="module")
def scene():
    return FallScene(edge=True)


def let_go(scene, R_WO, height=0.08, V_WO=None, x=X, settles=False):
    """A cube whose lowest point is so high above the table."""
    z = TABLE_TOP + 0.02 * np.abs(R_WO[2]).sum() + height
    X_WO = RigidTransform(RotationMatrix(R_WO), [x, Y, z])
    return Fall(scene, X_WO, V_WO or SpatialVelocity.Zero(), **MATERIAL, settles=settles)


def rest(fall):
    """Where a cube lies after a second, and how many steps the integrator took."""
    for _ in range(100):
        fall.advance(0.01, AWAY, AWAY)
    return fall.X_WO, fall._simulator.get_integrator().get_num_steps_taken()


def test_a_level_cube_rebounds_by_its_restitution(scene):
    fall = let_go(scene, np.eye(3), height=HEIGHT)
    contact = 0.004
    fall.advance(IMPACT_SPEED / 9.81 + contact, AWAY, AWAY)
    after = fall.V_WO.translational()[2] + 9.81 * contact
    assert after == pytest.approx(0.5 * IMPACT_SPEED, rel=0.1)
    np.testing.assert_allclose(fall.V_WO.rotational(), 0.0, atol=1e-3)


def test_a_cube_that_lands_on_an_edge_leaves_it_as_a_rigid_body_would(scene):
    """Newton's restitution at the edge, with enough friction that it does not slide.

    Tilted by θ about y, the edge is r = a/√2 from the centre, at an angle φ = 45° − θ from the
    vertical. Of a plane blow at a point that sticks, the impulse solves K J = −(v⁻ + e v⁻ n).
    """
    tilt, e, m, a = 0.15, 0.5, 0.1, 0.04
    inertia = m * a * a / 6
    fall = let_go(scene, RotationMatrix.MakeYRotation(tilt).matrix(), height=HEIGHT)
    fall.advance(IMPACT_SPEED / 9.81 + 0.004, AWAY, AWAY)
    speed = IMPACT_SPEED
    # The lowest corner of the square in x, z: towards +x for a positive turn about y.
    r = np.array([[np.cos(tilt), np.sin(tilt)], [-np.sin(tilt), np.cos(tilt)]]) @ [a / 2, -a / 2]
    across = np.array([-r[1], r[0]])  # how r moves with a turn from x to z
    K = np.eye(2) / m + np.outer(across, across) / inertia
    impulse = np.linalg.solve(K, [0.0, (1 + e) * speed])
    spin = float(across @ impulse) / inertia  # from x to z, so about −y
    np.testing.assert_allclose(fall.V_WO.rotational(), [0.0, -spin, 0.0], atol=0.12 * abs(spin))
    upward = -speed + impulse[1] / m - 9.81 * 0.004
    assert fall.V_WO.translational()[2] == pytest.approx(upward, abs=0.08 * speed)


def test_the_table_ends_where_the_real_one_does(scene):
    beyond = let_go(scene, np.eye(3), x=0.79)
    beyond.advance(0.5, AWAY, AWAY)
    assert beyond.X_WO.translation()[2] < TABLE_TOP - 0.5


def test_a_hand_is_where_it_was_told_to_be(scene):
    fall = let_go(scene, np.eye(3), height=0.0)
    start = Hand(RigidTransform([X, 0.0, 1.0]), 0.2)
    turn = RotationMatrix.MakeXRotation(0.3) @ RotationMatrix.MakeZRotation(0.4)
    end = Hand(RigidTransform(turn, [X, 0.1, 1.2]), 0.6)
    fall.advance(0.5, start, end)
    root = fall._simulator.get_context()
    context = scene.plant.GetMyContextFromRoot(root)
    # Over so long a way, how a heavy hand carries itself may show: a hundredth.
    assert scene.base.EvalPoseInWorld(context).IsNearlyEqualTo(end.X_WB, 2e-3)
    for joint, multiplier in zip(scene.joints, gripper.MULTIPLIERS, strict=True):
        assert joint.get_angle(context) == pytest.approx(0.6 * multiplier, abs=2e-3)


def test_a_hand_that_opens_does_not_move_a_cube_it_does_not_touch(scene):
    far, near = (let_go(scene, np.eye(3)) for _ in range(2))
    above = RigidTransform(RotationMatrix.MakeXRotation(np.pi), [X, Y, 0.75])
    far.advance(0.3, AWAY, AWAY)
    near.advance(0.3, Hand(above, 0.4), Hand(above, 0.0))
    # The integrator's steps differ.
    assert travel(far.X_WO, near.X_WO) < 5e-4


@pytest.mark.parametrize("tilt", [0.02, 0.1, 0.5])
def test_a_cube_that_settles_keeps_face_and_place_for_fewer_steps(scene, tilt):
    R_WO = RotationMatrix.MakeYRotation(tilt).matrix()
    fine, steps = rest(let_go(scene, R_WO))
    settled, fewer = rest(let_go(scene, R_WO, settles=True))
    assert travel(fine, settled) < 3e-3
    assert fewer < 0.7 * steps


@pytest.mark.parametrize("share, turns_over", [(0.4, False), (0.6, True)])
@pytest.mark.parametrize("form", ["height", "speed", "rate"])
def test_what_takes_a_cube_over_an_edge_is_energy_of_any_form(scene, form, share, turns_over):
    """Of m·g·(a/√2 − a/2), by which the centre rises on the way over an edge."""
    barrier = 0.04 * (np.sqrt(0.5) - 0.5)
    speed = np.sqrt(2 * 9.81 * barrier * share)
    rate = speed / np.sqrt(0.04**2 / 6)
    V_WO = {
        "speed": SpatialVelocity([0.0, 0.0, 0.0], [speed, 0.0, 0.0]),
        "rate": SpatialVelocity([0.0, rate, 0.0], [0.0, 0.0, 0.0]),
    }
    height = share * barrier if form == "height" else 0.0
    fall = let_go(scene, np.eye(3), height, V_WO.get(form))
    assert fall._can_turn_over() is turns_over


def test_no_time_is_no_motion(scene):
    fall = let_go(scene, np.eye(3))
    before = fall.X_WO
    fall.advance(0.0, AWAY, AWAY)
    assert travel(before, fall.X_WO) == 0.0


def test_travel_counts_a_turn_at_an_edges_length():
    turn = RigidTransform(RotationMatrix.MakeZRotation(0.5))
    assert travel(RigidTransform(), turn) == pytest.approx(0.02)
    assert travel(turn, RigidTransform([0.0, 0.3, 0.0]) @ turn) == pytest.approx(0.3)
