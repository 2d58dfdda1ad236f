"""Which pairs follow from a demonstrated pair (thesis 5.10.1), as groups.

By the rule of its group, each pair of a group follows from every other. Rules of the thesis:

* `grasp_any_position`: the same orientation is grasped alike in every column;
* `translate_to_goal`: what is carried to the goal column from one column is from every other;
  each height of departure and of arrival is a group of its own;
* `drop_anywhere`: what is dropped in one column is in every other, taken literally: at the
  goal as far from it, and so often wrong;
* `rotate_any_position`: what is turned in one column is in every other.

They keep all else: orientation, gripper, height. Uncomfortable poses, before or after the
action, neither give nor receive. Two rules of our own:

* `translate_from_elsewhere`: `translate_to_goal` without departures in the goal column itself,
  from which the action only changes the height;
* `drop_any_height`: a drop in the same column, from the other layer.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from models.task.clusters import uncomfortable_poses
from models.task.pairs import feasible_pairs
from models.task.spaces import (
    GOAL_POSITION,
    Indices,
    Kind,
)

THESIS_RULES = (
    "grasp_any_position",
    "translate_to_goal",
    "drop_anywhere",
    "rotate_any_position",
)
OWN_RULES = ("translate_from_elsewhere", "drop_any_height")
RULES = THESIS_RULES + OWN_RULES
"""Rule names; `Groups.rule` indexes them."""


class Groups(NamedTuple):
    """Groups of pairs, parallel arrays sorted by group, then state, then action.

    A pair may be in a group of each rule. Every group has at least two pairs.

    Attributes:
        state: int32 ``[n]``.
        action: int32 ``[n]``.
        group: int32 ``[n]``, 0 … number of groups − 1.
        rule: uint8 ``[n]``, an index into `RULES`, one to a group.
    """

    state: NDArray[np.int32]
    action: NDArray[np.int32]
    group: NDArray[np.int32]
    rule: NDArray[np.uint8]


def generalisation_groups(feasible: NDArray[np.bool_]) -> Groups:
    """Groups of the `feasible_pairs`, by every rule.

    Args:
        feasible: which pairs the robot can do, as `feasible_pairs` takes it.

    Raises:
        ModelError: if ``feasible`` has another shape or is not boolean.
    """
    state, action, position, orientation, gripper, kind, target = feasible_pairs(feasible)
    free, layer, column = gripper < 0, position % 2, position // 2
    grasps, drops = kind == Kind.GRASP, kind == Kind.DROP
    rotates, translates = kind == Kind.ROTATE, kind == Kind.TRANSLATE

    pose_is_bad = uncomfortable_poses()
    next_gripper = np.where(grasps | rotates, target, gripper)
    next_position = np.where(translates, target, position)
    comfortable = ~pose_is_bad[next_position, next_gripper] & (
        free | ~pose_is_bad[position, gripper]
    )
    to_goal = translates & (target // 2 == GOAL_POSITION // 2)
    from_elsewhere = to_goal & (column != GOAL_POSITION // 2)

    # Rule → the pairs it speaks of, and what the pairs of a group have in common.
    rules = {
        "grasp_any_position": (grasps & comfortable, (orientation, target)),
        "translate_to_goal": (to_goal & comfortable, (layer, orientation, gripper, target)),
        "drop_anywhere": (drops & comfortable, (layer, orientation, gripper)),
        "rotate_any_position": (rotates & comfortable, (layer, orientation, gripper, target)),
        "translate_from_elsewhere": (
            from_elsewhere & comfortable,
            (layer, orientation, gripper, target),
        ),
        "drop_any_height": (drops, (column, orientation, gripper)),
    }
    parts, n_groups = [], 0
    for number, name in enumerate(RULES):
        applies, common = rules[name]
        rows, group = _groups_of_two_or_more(np.flatnonzero(applies), common)
        parts.append((rows, group + n_groups, np.full(rows.size, number)))
        n_groups += int(group.max(initial=-1)) + 1
    rows, group, rule = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Groups(
        state[rows].astype(np.int32),
        action[rows].astype(np.int32),
        group.astype(np.int32),
        rule.astype(np.uint8),
    )


def _groups_of_two_or_more(rows: Indices, common: tuple[Indices, ...]) -> tuple[Indices, Indices]:
    """Rows and their group numbers from 0, sorted by group; groups of one are left out."""
    if not rows.size:
        return rows, rows
    values = [column[rows] for column in common]
    key = np.ravel_multi_index(values, tuple(int(column.max()) + 1 for column in values))
    _, group, size = np.unique(key, return_inverse=True, return_counts=True)
    keep = size[group] > 1
    rows, (_, group) = rows[keep], np.unique(group[keep], return_inverse=True)
    order = np.argsort(group, kind="stable")
    return rows[order], group[order]
