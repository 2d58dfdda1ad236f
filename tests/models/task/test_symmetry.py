"""Symmetry classes: an equivalence whose maps reproduce every member from its representative."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from models.rotations import geodesic_angle, rotation_z
from models.task import symmetry
from models.task.spaces import R_WG, R_WO

MIRROR = np.diag([1.0, -1.0, 1.0])
CUBE = np.array(Rotation.create_group("O").as_matrix())


@pytest.fixture(scope="module", params=[True, False], ids=["mirror", "no mirror"])
def classes(request):
    return symmetry.symmetry_classes(mirror=request.param)


def test_counts():
    with_mirror, without = (symmetry.symmetry_classes(mirror=m) for m in (True, False))
    assert with_mirror.n_members.tolist() == [120, 120, 72, 48, 192, 192, 72, 48]
    assert without.n_members.tolist() == [120, 120, 72, 24, 24, 192, 192, 72, 24, 24]


def test_every_map_reproduces_the_member(classes):
    for o, g in np.ndindex(48, 18):
        representative = classes.representative[classes.pair_class[o, g]]
        R_O, R_G = R_WO[representative[0]], R_WG[representative[1]]
        assert classes.valid[o, g].any()
        for S, mirrored in zip(
            classes.S[o, g][classes.valid[o, g]],
            classes.mirrored[classes.valid[o, g]],
            strict=True,
        ):
            np.testing.assert_allclose(S[2], [0, 0, 1], atol=1e-9)
            flip = MIRROR if mirrored else np.eye(3)
            # The gripper up to half a turn about its approach, the cube up to its faces.
            moved_G, moved_O = S @ flip @ R_G @ flip, S @ flip @ R_O @ flip
            turned = [moved_G, moved_G @ rotation_z(np.pi)]
            assert np.abs(turned - R_WG[g]).max(axis=(1, 2)).min() < 1e-9
            assert np.abs(moved_O @ CUBE - R_WO[o]).max(axis=(1, 2)).min() < 1e-9


def test_classes_are_an_equivalence(classes):
    """The class is the same whichever member had been its representative."""
    for o, g in np.argwhere(np.ones((48, 18), dtype=bool))[::7]:
        like = np.zeros((48, 18), dtype=bool)
        for mirrored in np.unique(classes.mirrored):
            for half_turn in (False, True):
                like |= symmetry._scene_maps((o, g), mirrored, half_turn)[1]
        np.testing.assert_array_equal(like, classes.pair_class == classes.pair_class[o, g])


def test_a_representatives_first_map_is_the_identity(classes):
    for each in (classes, symmetry.rotation_classes(mirror=len(classes.mirrored) > 2)):
        for representative in map(tuple, each.representative):
            assert each.valid[(*representative, 0)] and not each.mirrored[0]
            np.testing.assert_allclose(each.S[(*representative, 0)], np.eye(3), atol=1e-12)


@pytest.mark.parametrize(("mirror", "n_classes"), [(True, 146), (False, 262)])
def test_rotations_are_alike_if_both_ends_of_the_turn_are(mirror, n_classes):
    classes = symmetry.rotation_classes(mirror=mirror)
    assert classes.n_classes == n_classes
    assert classes.n_members.sum() == 48 * 18 * 17
    stays = classes.pair_class[:, np.arange(18), np.arange(18)]
    assert (stays == -1).all()
    rng = np.random.default_rng(0)
    for o, g, h in rng.integers([48, 18, 18], size=(300, 3)):
        if g == h:
            continue
        representative = classes.representative[classes.pair_class[o, g, h]]
        R_O, R_G, R_H = R_WO[representative[0]], *R_WG[representative[1:]]
        for m in np.flatnonzero(classes.valid[o, g, h]):
            flip = MIRROR if classes.mirrored[m] else np.eye(3)
            scene = classes.S[o, g, h, m] @ flip
            # The turn in the world, hand and cube moving alike, is the member's own.
            turn = scene @ R_H @ R_G.T @ scene.T
            np.testing.assert_allclose(turn, R_WG[h] @ R_WG[g].T, atol=1e-9)
            assert np.abs(scene @ R_O @ flip @ CUBE - R_WO[o]).max(axis=(1, 2)).min() < 1e-9


def test_kinds_of_gripper_do_not_mix(classes):
    kind = np.repeat([0, 1, 2], [5, 5, 8])
    for number in range(classes.n_classes):
        grippers = np.nonzero(classes.pair_class == number)[1]
        assert len(set(kind[grippers])) == 1


def test_transport_of_nothing_is_nothing(classes):
    turn, p = symmetry.transport(np.eye(3), classes.S[classes.valid], False)
    np.testing.assert_allclose(turn, np.broadcast_to(np.eye(3), turn.shape), atol=1e-12)
    assert not p.any()


def test_transport_carries_turn_and_displacement():
    quarter = rotation_z(np.pi / 2)
    tilt = Rotation.from_rotvec([0.3, 0, 0]).as_matrix()
    turn, p = symmetry.transport(tilt, quarter, False, [0.01, 0.02, -0.03])
    np.testing.assert_allclose(turn, Rotation.from_rotvec([0, 0.3, 0]).as_matrix(), atol=1e-12)
    np.testing.assert_allclose(p, [-0.02, 0.01, -0.03], atol=1e-12)
    # In the mirror y → −y, turns about x and z change their sense.
    turn, p = symmetry.transport(rotation_z(0.2) @ tilt, np.eye(3), True, [0.01, 0.02, -0.03])
    expected = rotation_z(-0.2) @ Rotation.from_rotvec([-0.3, 0, 0]).as_matrix()
    np.testing.assert_allclose(turn, expected, atol=1e-12)
    np.testing.assert_allclose(p, [0.01, -0.02, -0.03], atol=1e-12)


def test_outcomes_that_depend_on_the_scene_alone_are_carried_exactly(classes):
    """A made-up physics that respects the symmetries: pads align the cube with the hand.

    The cube turns about the vertical by the smallest angle that squares it with the closing
    axis. What the member does must be what is carried over from its representative.
    """

    def settle(R_O, R_G):
        # Vertical turns only: compare yaw of the hand and of the cube's faces, modulo 90°.
        yaw_of_hand = np.arctan2(R_G[1, 1], R_G[0, 1])
        level = R_O[:, np.abs(R_O[2]) < 0.5][:, 0]
        yaw_of_cube = np.arctan2(level[1], level[0])
        quarter = np.pi / 2
        return rotation_z((yaw_of_hand - yaw_of_cube + quarter / 2) % quarter - quarter / 2)

    for o, g in np.ndindex(48, 18):
        representative = classes.representative[classes.pair_class[o, g]]
        delta = settle(R_WO[representative[0]], R_WG[representative[1]])
        angle = geodesic_angle(delta, np.eye(3))
        for m in np.flatnonzero(classes.valid[o, g]):
            turn, _ = symmetry.transport(delta, classes.S[o, g, m], classes.mirrored[m])
            expected = settle(R_WO[o], R_WG[g])
            if angle < np.radians(44.9):  # at 45° either way is the smallest
                np.testing.assert_allclose(turn, expected, atol=1e-9)
            else:
                assert geodesic_angle(turn, np.eye(3)) == pytest.approx(angle)


def test_a_pair_that_is_its_own_mirror_image_has_several_maps():
    classes = symmetry.symmetry_classes()
    assert classes.valid[0, 10].sum() == 4  # vertical: half turn and mirror
    assert classes.valid[0, 5].sum() == 2  # tilted to the front: mirror
    assert classes.valid[0, 7].sum() == 1  # oblique: nothing
