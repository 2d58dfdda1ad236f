"""Which pairs are one physical experiment: symmetry classes of grasps and drops.

The outcome of closing or opening a floating gripper on the cube does not change if

* the whole scene turns about the vertical, by any angle, or moves over the table;
* the cube is replaced by itself turned onto its faces (the 24 rotations C: its faces differ
  for the task, not for physics);
* the gripper turns half a turn Z = Rz(180°) about its approach axis (its camera aside);
* the whole scene is mirrored in the plane y = 0, by M = diag(1, −1, 1).

The same holds for carrying a cube from cell to cell, and for turning it from gripper orientation
g to h, if both ends of the motion are mapped alike.

A pair is a cube orientation o and a gripper orientation g, and for a rotation the one it leads
to, h; a drop has a layer besides, in which classes are separate. A pair (o', g') is like (o, g)
if there is a *scene map*: a rotation S about the vertical with, for some k in {0, 1} and some C,

    R_WG' = S·R_WG·Zᵏ  and  R_WO' = S·R_WO·C  (and R_WH' = S·R_WH·Zᵏ),

or, mirrored, the same with M·R_WG·M, M·R_WO·M and M·R_WH·M. Scene maps can be undone and joined,
so likeness is an equivalence. `transport` carries an outcome along such a map. Where there are
several to one pair, every one is as true: a pair that is its own mirror image has outcomes that
mirror each other, equally likely, so one trial counts for both.

`models.task.kernel_rules` takes the rules apart, and has the looser ones of 5.9.1.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.rotations import rotation_z
from models.task.spaces import (
    N_GRIPPERS,
    N_ORIENTATIONS,
    R_WG,
    R_WO,
    Array,
    Indices,
)

SAME = 1e-9
"""Largest difference of matrix entries of equal rotations. Table 4.2's rounded yaws do not
matter: the two orientations concerned are exact mirror images and like no other."""
MIRROR = np.diag([1.0, -1.0, 1.0])
HALF_TURN = rotation_z(np.pi)


@dataclass(frozen=True, eq=False)
class SymmetryClasses:
    """Classes of pairs, and the scene maps from their representatives.

    ``[...]`` stands for ``[48, 18]``, orientation and gripper, or for rotations
    ``[48, 18, 18]``, orientation and gripper before and after.

    Attributes:
        pair_class: class of each pair, int ``[...]``, numbered by representative; −1 for a
            rotation to where the gripper is.
        representative: first pair of each class, int ``[n_classes, 2 or 3]``.
        S: rotation about the vertical of each scene map from the representative of the pair's
            class to the pair ``[..., n_maps, 3, 3]``.
        valid: which of these maps there are, at least one, bool ``[..., n_maps]``; map 0 of a
            representative is the identity.
        mirrored: whether a map mirrors the scene before it turns it, bool ``[n_maps]``.
    """

    pair_class: Indices
    representative: Indices
    S: Array
    valid: NDArray[np.bool_]
    mirrored: NDArray[np.bool_]

    @property
    def n_classes(self) -> int:
        """Number of classes: of grasps, of translations, of drops from one layer; of rotations."""
        return len(self.representative)

    @property
    def n_members(self) -> Indices:
        """Number of pairs in each class ``[n_classes]``."""
        return np.bincount(self.pair_class[self.pair_class >= 0], minlength=self.n_classes)


def symmetry_classes(*, mirror: bool = True) -> SymmetryClasses:
    """Classes of the 48 × 18 pairs of grasps, translations and drops.

    Args:
        mirror: whether mirror images count as one experiment.
    """
    return _classes((N_ORIENTATIONS, N_GRIPPERS), mirror)


def rotation_classes(*, mirror: bool = True) -> SymmetryClasses:
    """Classes of the 48 × 18 × 17 rotations; arguments as for `symmetry_classes`."""
    return _classes((N_ORIENTATIONS, N_GRIPPERS, N_GRIPPERS), mirror)


def transport(
    delta_R: ArrayLike, S: ArrayLike, mirrored: ArrayLike, p: ArrayLike = (0.0, 0.0, 0.0)
) -> tuple[Array, Array]:
    """Carry the outcome of a representative's trial over to a member of its class.

    Args:
        delta_R: turn of the cube in the world, R_WO_after·R_WO_beforeᵀ, ``[..., 3, 3]``.
        S: rotation of the member's scene map ``[..., 3, 3]``.
        mirrored: whether that map mirrors ``[...]``.
        p: displacement of the cube in the world, or its place from the tool centre point,
            ``[..., 3]`` in metres.

    Returns:
        The member's turn, with R_WO'_after = turn·R_WO'_before, and its displacement.
    """
    mirrored = np.asarray(mirrored, dtype=bool)
    S = np.asarray(S, dtype=np.float64)
    scene = S @ np.where(mirrored[..., None, None], MIRROR, np.eye(3))
    turn = scene @ np.asarray(delta_R, dtype=np.float64) @ np.swapaxes(scene, -1, -2)
    return turn, np.einsum("...ij,...j->...i", scene, np.asarray(p, dtype=np.float64))


@cache
def _classes(shape: tuple[int, ...], mirror: bool) -> SymmetryClasses:
    kinds = [(mirrored, half) for mirrored in (False, True)[: 1 + mirror] for half in (False, True)]
    pair_class = np.full(shape, -1)
    valid = np.zeros((*shape, len(kinds)), dtype=bool)
    S = np.zeros((*valid.shape, 3, 3))
    representatives: list[tuple[int, ...]] = []
    for pair in np.ndindex(*shape):
        stays = len(pair) > 2 and pair[1] == pair[2]
        if pair_class[pair] >= 0 or stays:
            continue
        for number, (mirrored, half_turn) in enumerate(kinds):
            turn, related = _scene_maps(pair, mirrored, half_turn)
            turn = turn.reshape(1, N_GRIPPERS, *[1] * (len(shape) - 2), 3, 3)
            S[..., number, :, :] = np.where(related[..., None, None], turn, S[..., number, :, :])
            valid[..., number] |= related
            pair_class[related] = len(representatives)
        representatives.append(pair)
    mirrors = np.array([mirrored for mirrored, _ in kinds])
    return SymmetryClasses(pair_class, np.array(representatives), S, valid, mirrors)


def _scene_maps(
    pair: tuple[int, ...], mirrored: bool, half_turn: bool
) -> tuple[Array, NDArray[np.bool_]]:
    """The one S that takes the pair's gripper to each other, and the pairs it then is like.

    Returns:
        S ``[18, 3, 3]`` by gripper, meaningful where bool ``[48, 18]``, or ``[48, 18, 18]`` for
        a rotation, is true.
    """
    orientation, *grippers = pair
    flip = MIRROR if mirrored else np.eye(3)
    turn = HALF_TURN if half_turn else np.eye(3)
    moved = [flip @ R_WG[gripper] @ flip @ turn for gripper in grippers]
    S = R_WG @ moved[0].T
    vertical = (np.abs(S[:, :, 2] - [0.0, 0.0, 1.0]) < SAME).all(axis=-1)
    # C = (S·R_WO)ᵀ·R_WO' turns the cube onto its faces if its entries are 0 and ±1.
    C = np.swapaxes(S @ flip @ R_WO[orientation] @ flip, -1, -2) @ R_WO[:, None]
    onto_faces = (np.abs(C - np.rint(C)) < SAME).all(axis=(-2, -1))
    like = vertical & onto_faces
    for R_WH in moved[1:]:
        arrives = (np.abs((S @ R_WH)[:, None] - R_WG) < SAME).all(axis=(-2, -1))
        like = like[..., None] & arrives
    return S, like
