"""The single rules by which a trial of one pair counts for another, so that each can be tested.

Exact rules, each a scene map of `models.task.symmetry` that does one thing only. From the pair
that stands for a class,

* place: the same hand and cube in another column or, if the hand carries it, another cell;
* cube: the cube turned onto itself, another face up or another yaw by quarter turns;
* turn: the whole scene turned about the vertical;
* half turn: the gripper half a turn about its approach axis;
* mirror: the scene in a mirror.

Most pairs follow by several at once. The thesis' rules (5.9.1):

* columns: another x and y;
* quarter turns: the cube turned by quarter turns, what becomes of it the same *in the world*;
* upper layer: another gripper, in a translation to the upper layer.
"""

from collections.abc import Collection
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.task.spaces import (
    N_ACTIONS,
    N_GRIPPERS,
    N_ORIENTATIONS,
    R_WO,
    Indices,
    Kind,
    decode_actions,
    decode_states,
)
from models.task.symmetry import MIRROR, SAME, SymmetryClasses
from models.task.trial_classes import TrialClasses

EXACT_RULES = ("place", "cube", "turn", "half turn", "mirror")
COLUMNS, QUARTER_TURNS, UPPER_LAYER = THESIS_RULES = ("columns", "quarter turns", "upper layer")


def exact_rule(classes: TrialClasses, state: ArrayLike, action: ArrayLike) -> Indices:
    """Which rule alone relates each pair to the one that stands for its class.

    Args:
        classes: which pairs share trials.
        state: state indices ``[n]``.
        action: action indices ``[n]``, of pairs that `nominal_pairs` allows.

    Returns:
        Place in `EXACT_RULES`, −1 where it takes several, ``[n]``. A pair that stands for its
        class follows by "place", trivially.
    """
    _, orientation, gripper = decode_states(state)
    kind, target = decode_actions(action)
    hand = np.where(kind == Kind.GRASP, target, gripper)
    of_hand = _single_rules(classes.hands)[orientation, hand]
    # Where there is no target, or it is a cell, the entry is not used.
    of_turn = _single_rules(classes.turns)[orientation, gripper, target]
    return np.where(kind == Kind.ROTATE, of_turn, of_hand)


def thesis_kernel(
    state: ArrayLike, action: ArrayLike, rules: Collection[str] = THESIS_RULES
) -> Indices:
    """Class number of pairs that 5.9.1 counts together; shapes broadcast.

    By all rules, two of the 48 orientations are left (yaw a multiple of 90°, or 45° more). A
    translation keeps its target. Numbers are stable but not consecutive. Compare pairs that are
    feasible; *lost* has no class.

    Args:
        state: state indices.
        action: action indices.
        rules: those of `THESIS_RULES` that hold.

    Raises:
        ModelError: if an index is out of range.
    """
    position, orientation, gripper = decode_states(state)
    kind, target = decode_actions(action)
    raised = (kind == Kind.TRANSLATE) & (target % 2 == 1)
    hand = np.where(raised & (UPPER_LAYER in rules), -1, gripper) + 1
    face = orientation % 2 if QUARTER_TURNS in rules else orientation
    cell = position % 2 if COLUMNS in rules else position
    key = (cell * N_ORIENTATIONS + face) * (N_GRIPPERS + 1) + hand
    return key * N_ACTIONS + np.asarray(action, dtype=np.int64)


@cache
def _single_rules(symmetry: SymmetryClasses) -> Indices:
    """Place in `EXACT_RULES` of the one that gives each pair of a symmetry, −1 if none alone."""
    representative = symmetry.representative[symmetry.pair_class]
    R_before = R_WO[representative[..., 0]]
    shape = (N_ORIENTATIONS, *[1] * (symmetry.pair_class.ndim - 1), 3, 3)
    found = np.full(symmetry.pair_class.shape, -1)
    # Maps come as plain, with a half turn, mirrored, mirrored with a half turn.
    by_map = {0: ("place", "cube", "turn"), 1: ("half turn",), 2: ("mirror",)}
    for number, names in by_map.items():
        if number >= symmetry.mirrored.size:
            continue
        S = symmetry.S[..., number, :, :]
        flip = MIRROR if symmetry.mirrored[number] else np.eye(3)
        C = np.swapaxes(S @ flip @ R_before @ flip, -1, -2) @ R_WO.reshape(shape)
        scene_stays, cube_stays = _is_identity(S), _is_identity(C)
        for name in names:
            alone = symmetry.valid[..., number] & (symmetry.pair_class >= 0) & (found < 0)
            alone &= scene_stays if name != "turn" else ~scene_stays
            alone &= cube_stays if name != "cube" else ~cube_stays
            found[alone] = EXACT_RULES.index(name)
    return found


def _is_identity(R: np.ndarray) -> NDArray[np.bool_]:
    return np.asarray((np.abs(R - np.eye(3)) < SAME).all(axis=(-2, -1)))
