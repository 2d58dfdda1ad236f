"""What a state cannot say: how the cube truly lies in the hand, and what that costs the model.

A state names the nearest of 48 orientations. After a turn of the hand the cube may lie up to 45°
off it, and the next turn carries the true cube on, not the name. Here every grasp is followed by
two turns: by geometry, with the cube rigid in the hand, and by the model, which starts the second
turn from the name alone.
"""

import numpy as np

from diagrams.trials.counts import TransitionEntries
from diagrams.trials.initial_state import settle_in_hand
from models.rotations import geodesic_angle
from models.task.discretise import all_nearest_orientations
from models.task.estimate import TIE
from models.task.spaces import (
    LOST,
    N_GRIPPERS,
    N_ORIENTATIONS,
    R_WG,
    R_WO,
    Kind,
    decode_actions,
    decode_states,
)
from models.task.trial_classes import TRIAL_POSITION

BINS = {"up to 5°": (0.0, 5.0), "5° to 40°": (5.0, 40.0), "halfway, 40° to 45°": (40.0, 90.0)}
"""How far the cube is off its name after the first turn [degrees]."""
PROBABLE = 0.05


def two_turns(entries: TransitionEntries) -> dict[str, dict[str, float]]:
    """How well the model predicts the second turn, by how far the first left the cube off.

    Every grasp that the model has in the table's middle, and every two turns after it, count
    alike; where two orientations are equally near, each counts half.

    Returns:
        By the names of `BINS` and for ``all``: ``share`` of the histories, ``most_likely``, how
        often the model's likeliest orientation is the true one, and ``probable``, how often it
        gives the true one at least 5 %.
    """
    turns, grasps = _turn_table(entries), _grasps(entries)
    total = np.zeros((len(BINS), 3))
    for orientation, first in grasps:
        R_GO = settle_in_hand(R_WG[first].T @ R_WO[orientation])
        ends = all_nearest_orientations(R_WG @ R_GO, TIE)
        offs = np.degrees(geodesic_angle(R_WG @ R_GO, R_WO[ends.argmax(axis=-1)]))
        for second in np.flatnonzero(turns[first, :, orientation].any(axis=-1)):
            names, off = np.flatnonzero(ends[second]), offs[second]
            row = next(k for k, (low, high) in enumerate(BINS.values()) if low <= off < high)
            for name in names:
                model = turns[second, :, name]
                feasible = model.any(axis=-1)
                truth = ends[feasible] / ends[feasible].sum(axis=-1, keepdims=True)
                predicted = model[feasible]
                hit = truth[np.arange(len(truth)), predicted.argmax(axis=-1)]
                probable = (truth * (predicted >= PROBABLE)).sum(axis=-1)
                total[row] += np.array([len(truth), hit.sum(), probable.sum()]) / len(names)
    every = total.sum(axis=0)
    rows = {**dict(zip(BINS, total, strict=True)), "all": every}
    return {
        name: {
            "share": float(n / every[0]) if every[0] else 0.0,
            "most_likely": float(hit / n) if n else 0.0,
            "probable": float(probable / n) if n else 0.0,
        }
        for name, (n, hit, probable) in rows.items()
    }


def print_two_turns(result: dict[str, dict[str, float]]) -> None:
    """One line for each distance from the name."""
    print("\na grasp and two turns: how well the state's name predicts the second")
    print(f"{'off the name after the first':30} {'share':>7} {'likeliest':>10} {'probable':>9}")
    for name, row in result.items():
        print(f"{name:30} {row['share']:7.1%} {row['most_likely']:10.1%} {row['probable']:9.1%}")


def _turn_table(entries: TransitionEntries) -> np.ndarray:
    """Orientation afterwards, by gripper, gripper afterwards and orientation; held cubes only."""
    which = decode_actions(entries.action).kind == Kind.ROTATE
    before = decode_states(entries.state[which])
    target = decode_actions(entries.action[which]).target
    lost = entries.next_state[which] == LOST
    after = decode_states(np.where(lost, 0, entries.next_state[which]))
    mine = (before.position == TRIAL_POSITION) & (after.gripper == target) & ~lost
    table = np.zeros((N_GRIPPERS, N_GRIPPERS, N_ORIENTATIONS, N_ORIENTATIONS))
    place = before.gripper[mine], target[mine], before.orientation[mine], after.orientation[mine]
    np.add.at(table, place, entries.probability[which][mine])
    return table


def _grasps(entries: TransitionEntries) -> list[tuple[int, int]]:
    """Cube orientation and gripper of every grasp in the table's middle."""
    which = decode_actions(entries.action).kind == Kind.GRASP
    before = decode_states(entries.state[which])
    target = decode_actions(entries.action[which]).target
    mine = before.position == TRIAL_POSITION
    found = set(zip(before.orientation[mine].tolist(), target[mine].tolist(), strict=True))
    return sorted(found)
