"""What a person may mind about grasping, by name, and the factors that goals are told in.

Costs are per pair, from 0 to 1: a grip is what an action takes hold with, a layer where the cube is
expected to be carried. What is uncertain (*surprise*) every learner computes from its model.
"""

from collections.abc import Mapping

import numpy as np

from irl.mdp import TransitionModel
from models.task.spaces import (
    HORIZONTAL,
    N_STATES,
    N_YAWS,
    POSITIONS,
    R_WG,
    TILTED,
    Kind,
    decode_actions,
    decode_states,
)

LEFT_OUT = "tilt"
"""A cost of this kind is never told to a learner."""


def costs(model: TransitionModel) -> dict[str, np.ndarray]:
    """Costs of the pairs, each float64 ``[n_pairs]`` from 0 to 1, that learners are told of.

    * ``grip``: to take hold, by a grasp or a rotation, with the approach axis horizontal;
    * ``layer``: to carry the cube into the upper layer, or there: the share of outcomes;
    * ``turn``: to turn the gripper, by its angle over a half turn;
    * ``motion``: to carry the cube, by its distance over the longest one.
    """
    state, _, gripper = decode_states(model.pair_state)
    kind, target = decode_actions(model.pair_action)
    takes = (kind == Kind.GRASP) | (kind == Kind.ROTATE)
    upper = np.zeros(model.n_states)
    position = decode_states(np.arange(N_STATES)).position
    upper[:N_STATES] = position % 2
    turn, motion = np.zeros(model.n_pairs), np.zeros(model.n_pairs)
    turns, carries = kind == Kind.ROTATE, kind == Kind.TRANSLATE
    relative = np.einsum("nji,nji->n", R_WG[gripper[turns]], R_WG[target[turns]])
    turn[turns] = np.arccos(np.clip((relative - 1) / 2, -1, 1)) / np.pi
    way = POSITIONS[target[carries]] - POSITIONS[state[carries]]
    longest = np.linalg.norm(POSITIONS.max(axis=0) - POSITIONS.min(axis=0))
    motion[carries] = np.linalg.norm(way, axis=1) / longest
    return {
        "grip": (takes & np.isin(target, HORIZONTAL)).astype(np.float64),
        "layer": model.P @ upper,
        "turn": turn,
        "motion": motion,
    }


def nameless_cost(model: TransitionModel) -> np.ndarray:
    """The cost that no learner is told of: to take hold with a tilted gripper; ``[n_pairs]``."""
    kind, target = decode_actions(model.pair_action)
    takes = (kind == Kind.GRASP) | (kind == Kind.ROTATE)
    return (takes & np.isin(target, TILTED)).astype(np.float64)


def factors() -> Mapping[str, np.ndarray]:
    """What states have in common, int64 ``[N_STATES + 1]`` each; −1 for *lost* throughout.

    ``cell``, ``face`` (which face is up), ``yaw``, ``grip`` (horizontal, tilted, vertical, or −1
    for a free cube) and ``gripper`` (which of the 18, −1 for a free cube).
    """
    position, orientation, gripper = decode_states(np.arange(N_STATES + 1))
    kind = np.repeat([0, 1, 2, -1], [5, 5, 8, 1])  # the last is what −1 points at
    lost = position < 0
    return {
        "cell": position,
        "face": np.where(lost, -1, orientation // N_YAWS),
        "yaw": np.where(lost, -1, orientation % N_YAWS),
        "grip": kind[gripper],
        "gripper": gripper,
    }
