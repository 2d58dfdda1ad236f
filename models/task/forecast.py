"""What an action would lead to from where cube and hand truly are, not from the state's name.

A state names the nearest of 48 orientations. A held cube keeps its pose in the hand all the same,
so that turns which compose to nothing return both the cube and its name, however often they are
made. Here poses are carried on, and a name is given only to what a policy is asked about.

* grasp: the hand goes to the cube where it lies; the fingers turn the nearest pair of faces
  towards the pads, but seldom flush: `ALIGNED`; the cube is held in its column's lower cell;
* translate, rotate: the cube is rigid in the hand;
* drop: the cube comes to lie on the nearest face, or tumbles on (`models.task.drops`).

Many scenes at once: one row each.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.maps.gripper_poses import RETREAT
from models.rotations import rotation_vector_to_matrix
from models.task.discretise import nearest_column
from models.task.drops import rests
from models.task.spaces import (
    GRID_Z,
    LOST,
    N_ACTIONS,
    N_STATES,
    POSITIONS,
    R_WG,
    R_WO,
    VERTICAL,
    Array,
    Indices,
    Kind,
    decode_actions,
    decode_states,
    encode_states,
)

ALIGNED = np.radians(
    [
        (0.0, 0.0),
        (4.0, 1.0),
        (8.0, 2.5),
        (12.0, 5.5),
        (16.0, 7.5),
        (20.0, 13.0),
        (24.0, 14.5),
        (28.0, 23.0),
        (32.0, 28.0),
        (36.0, 34.5),
        (40.0, 39.5),
        (45.0, 45.0),
    ]
)
"""Angle from a face's normal to the closing axis before and after the fingers have closed [rad].

Means of nine trials each with the floating gripper, three in each of three hands, friction 0.6 to
0.9: a cube that is 12° off is turned half flush, one that is 36° off stays (RESULTS.md).
"""
SPREAD, SPREAD_WITHIN = np.radians(4.0), np.radians((14.0, 30.0))
"""By how much single trials differ from that either way, and where they do [rad]."""
LEAST = 0.02
"""Probability below which a course of events is not followed further."""


NOTHING_BLOCKED = np.zeros((len(POSITIONS), N_ACTIONS), dtype=bool)


class Scenes(NamedTuple):
    """Where cube and hand are; arrays with one row a scene.

    Attributes:
        position: cell 0…17 of the hand that holds the cube, or of the free cube ``[n]``; −1 where
            the cube is lost.
        hand: gripper orientation 0…17, −1 where the cube is free ``[n]``.
        R_WO: the cube's orientation ``[n, 3, 3]``.
        p_WO: its centre ``[n, 3]`` [m].
    """

    position: Indices
    hand: Indices
    R_WO: Array
    p_WO: Array

    def select(self, which: NDArray[np.bool_] | Indices) -> "Scenes":
        """Some of the scenes, by a mask or by indices."""
        position, hand, R_WO, p_WO = self
        return Scenes(position[which], hand[which], R_WO[which], p_WO[which])

    @property
    def state(self) -> Indices:
        """What each is called: index of the state, `LOST` where the cube is ``[n]``."""
        name = encode_states(np.maximum(self.position, 0), nearest_names(self.R_WO), self.hand)
        return np.where(self.position < 0, LOST, name)


class Outcomes(NamedTuple):
    """What may come of actions; arrays with one row an outcome.

    Attributes:
        origin: which scene it came from, ascending ``[m]``.
        probability: those of a scene sum to 1 ``[m]``.
        scenes: where cube and hand are then ``[m]``.
    """

    origin: Indices
    probability: Array
    scenes: Scenes


def free_scene(state: int, R_WO: ArrayLike, p_WO: ArrayLike) -> Scenes:
    """One scene of a cube on the table at a measured pose, called ``state``."""
    position = decode_states(np.array([state])).position
    return Scenes(position, np.array([-1]), np.asarray(R_WO)[None], np.asarray(p_WO)[None])


def held_scene(state: int, R_GO: ArrayLike, p_GO: ArrayLike) -> Scenes:
    """One scene of a cube in the hand, which is in the middle of the cell that ``state`` names."""
    position, _, hand = decode_states(np.array([state]))
    R = R_WG[hand]
    return Scenes(position, hand, R @ np.asarray(R_GO), POSITIONS[position] + R @ np.asarray(p_GO))


def nearest_names(R: Array) -> Indices:
    """Nearest of the 48 orientations to rotations ``[n, 3, 3]`` that are known to be some."""
    return (R.reshape(-1, 9) @ R_WO.reshape(-1, 9).T).argmax(axis=1)


def outcomes(scenes: Scenes, action: ArrayLike) -> Outcomes:
    """What each scene's action may lead to.

    Args:
        scenes: one row each; none of them lost.
        action: index of an action that suits its scene: a grasp of a free cube, any other of a
            held one ``[n]``.
    """
    kind, target = decode_actions(np.asarray(action))
    parts = []
    for each, course in _COURSES.items():
        (rows,) = np.nonzero(kind == each)
        if rows.size:
            found = course(scenes.select(rows), target[rows])
            parts.append((rows[found.origin], found.probability, *found.scenes))
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    origin, probability = columns[:2]
    order = np.argsort(origin, kind="stable")
    return Outcomes(origin[order], probability[order], Scenes(*columns[2:]).select(order))


def arrival(
    scenes: Scenes,
    first: ArrayLike,
    policy: Indices,
    goals: NDArray[np.bool_],
    within: int,
    blocked: NDArray[np.bool_] = NOTHING_BLOCKED,
) -> Array:
    """Probability of reaching a goal by a first action and then by a policy.

    Args:
        scenes: one row each.
        first: the first action of each ``[n]``.
        policy: each state's action after it, −1 where there is none ``[N_STATES or more]``.
        goals: which states are goals ``[N_STATES or more]``.
        within: most actions, the first among them.
        blocked: which actions are known not to be possible in a cell as the cube is in the hand
            now, until it is let go ``[18, N_ACTIONS]``.

    Returns:
        ``[n]``.
    """
    arrived = np.zeros(len(scenes.hand))
    origin, weight = np.arange(arrived.size), np.ones(arrived.size)
    action = np.asarray(first)
    kept = scenes.hand >= 0  # as it is in the hand now
    for _ in range(within):
        if not origin.size:
            break
        came, probability, scenes = outcomes(scenes, action)
        origin, weight = origin[came], weight[came] * probability
        kept = kept[came] & (scenes.hand >= 0)
        state = scenes.state
        there = goals[state]
        np.add.at(arrived, origin[there], weight[there])
        action = np.where(state < N_STATES, policy[np.minimum(state, N_STATES - 1)], -1)
        stops = kept & blocked[np.maximum(scenes.position, 0), np.maximum(action, 0)]
        on = ~there & (action >= 0) & (weight >= LEAST) & ~stops
        origin, weight, action, scenes = origin[on], weight[on], action[on], scenes.select(on)
        kept = kept[on]
    return arrived


def _grasp(scenes: Scenes, hand: Indices) -> Outcomes:
    """Close the fingers, which turns the cube about their own level axis's normal, and lift."""
    R_GO = np.swapaxes(R_WG[hand], -1, -2) @ scenes.R_WO
    closing = R_GO[:, 1]  # the closing axis in the cube's frame
    normal = _nearest_axis(closing)
    axis = np.cross(closing, normal)
    sine = np.linalg.norm(axis, axis=-1)
    off = np.arctan2(sine, (closing * normal).sum(axis=-1))
    left = np.interp(off, *ALIGNED.T)
    uncertain = (off > SPREAD_WITHIN[0]) & (off < SPREAD_WITHIN[1])
    origin = np.repeat(np.arange(hand.size), 1 + uncertain)
    sign = np.zeros(origin.size)
    sign[uncertain[origin]] = np.tile([-1.0, 1.0], int(uncertain.sum()))
    turned = (off - left)[origin] - sign * SPREAD
    axis = axis / np.maximum(sine, 1e-12)[:, None]
    # The closing axis turns onto the normal in the cube's frame as the cube turns the other way.
    turn = rotation_vector_to_matrix(-np.clip(turned, 0.0, off[origin])[:, None] * axis[origin])
    hand, position = hand[origin], scenes.position[origin]
    R_GO = R_GO[origin] @ turn
    p_GO = np.where(np.isin(hand, VERTICAL), 0.0, RETREAT)[:, None] * np.array([0.0, 0.0, 1.0])
    return Outcomes(
        origin, np.where(uncertain, 0.5, 1.0)[origin], _held(position, hand, R_GO, p_GO)
    )


def _translate(scenes: Scenes, cell: Indices) -> Outcomes:
    return _certain(_held(cell, scenes.hand, *_in_hand(scenes)))


def _rotate(scenes: Scenes, hand: Indices) -> Outcomes:
    return _certain(_held(scenes.position, hand, *_in_hand(scenes)))


def _drop(scenes: Scenes, target: Indices) -> Outcomes:
    del target
    came = rests(scenes.R_WO, scenes.p_WO, POSITIONS[scenes.position][:, 2] > GRID_Z.mean())
    free = np.full(came.origin.size, -1)
    return Outcomes(
        came.origin,
        came.probability,
        Scenes(nearest_column(came.p_WO), free, came.R_WO, came.p_WO),
    )


_COURSES = {
    Kind.GRASP: _grasp,
    Kind.TRANSLATE: _translate,
    Kind.ROTATE: _rotate,
    Kind.DROP: _drop,
}


def _certain(scenes: Scenes) -> Outcomes:
    n = scenes.hand.size
    return Outcomes(np.arange(n), np.ones(n), scenes)


def _held(position: Indices, hand: Indices, R_GO: Array, p_GO: Array) -> Scenes:
    R = R_WG[hand]
    p_WO = POSITIONS[position] + np.einsum("nij,nj->ni", R, p_GO)
    return Scenes(position, hand, R @ R_GO, p_WO)


def _in_hand(scenes: Scenes) -> tuple[Array, Array]:
    """The cube's pose in the hand: R_GO ``[n, 3, 3]`` and p_GO ``[n, 3]`` [m]."""
    R_GW = np.swapaxes(R_WG[scenes.hand], -1, -2)
    p = scenes.p_WO - POSITIONS[scenes.position]
    return R_GW @ scenes.R_WO, np.einsum("nij,nj->ni", R_GW, p)


def _nearest_axis(v: Array) -> Array:
    """The axis nearest to each of ``v [n, 3]``, signed."""
    axis = np.zeros_like(v)
    rows, nearest = np.arange(len(v)), np.abs(v).argmax(axis=-1)
    axis[rows, nearest] = np.where(v[rows, nearest] < 0.0, -1.0, 1.0)
    return axis
