"""From trials to transition probabilities: each trial speaks for its whole symmetry class."""

from collections import defaultdict
from collections.abc import Iterable
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from diagrams.trial_record import Outcome, Pair, TrialRecord
from models.rotations import rotation_vector_to_matrix
from models.task.discretise import nearest_orientation, off_table
from models.task.estimate import estimated_transitions
from models.task.spaces import (
    GRID_X,
    GRID_Y,
    LOST,
    N_ACTIONS,
    N_STATES,
    N_XY,
    POSITIONS,
    R_WO,
    REST_HEIGHT,
    Kind,
    decode_actions,
    encode_actions,
    encode_states,
)
from models.task.symmetry import SymmetryClasses, transport


class Evidence(IntEnum):
    """Where a transition's probability comes from."""

    MEASURED = 0
    KERNEL = 1
    ESTIMATED = 2


class TransitionEntries(NamedTuple):
    """Parallel arrays, one entry per (s, a, s'), sorted by state, action, next state.

    Attributes:
        state: int32 ``[n]``.
        action: int32 ``[n]``.
        next_state: int32 ``[n]``.
        probability: float64 ``[n]``; those of a pair sum to 1.
        count: int64 ``[n]``, trials behind the entry; 0 where it is estimated.
        evidence: uint8 ``[n]``, an `Evidence`.
    """

    state: np.ndarray
    action: np.ndarray
    next_state: np.ndarray
    probability: np.ndarray
    count: np.ndarray  # type: ignore[assignment]
    evidence: np.ndarray


TRIAL_XY = 4
"""Column of the table's middle, where trials happen."""


def transition_entries(
    feasible: np.ndarray,
    trials: Iterable[tuple[Pair, int, TrialRecord]],
    classes: SymmetryClasses,
) -> TransitionEntries:
    """Fill every feasible pair: from its class's trials, else from the geometric estimate.

    A trial of a class's representative is carried to each member by one of its scene maps; a
    member with several maps takes them in turn, since all are equally true. A fault counts for
    nothing.

    Args:
        feasible: bool ``[N_STATES or more, N_ACTIONS]``.
        trials: (pair, repetition, record), the pairs representatives of ``classes``.
        classes: which pairs share trials.
    """
    grouped: dict[tuple[int, Kind, int], list[tuple[int, TrialRecord]]] = defaultdict(list)
    for pair, repetition, record in trials:
        if record.outcome != Outcome.FAULT:
            number = int(classes.pair_class[pair.orientation, pair.gripper])
            grouped[number, pair.kind, pair.layer].append((repetition, record))

    tried = [
        _class_entries(classes, number, kind, layer, [r for _, r in sorted(records, key=_first)])
        for (number, kind, layer), records in sorted(grouped.items())
    ]
    columns = (
        [np.concatenate(column) for column in zip(*tried, strict=True)]
        if tried
        else [np.zeros(0, dtype=np.int64) for _ in range(6)]
    )
    entries = TransitionEntries(*columns)
    allowed = feasible[entries.state, entries.action]
    entries = TransitionEntries(*(column[allowed] for column in entries))

    rest = feasible[:N_STATES].copy()
    rest[entries.state, entries.action] = False
    estimate = estimated_transitions(rest)
    n = estimate.state.size
    columns = [
        np.concatenate([ours, theirs])
        for ours, theirs in zip(
            entries,
            (*estimate, np.zeros(n, dtype=np.int64), np.full(n, Evidence.ESTIMATED)),
            strict=True,
        )
    ]
    order = np.lexsort((columns[2], columns[1], columns[0]))
    types = (np.int32, np.int32, np.int32, np.float64, np.int64, np.uint8)
    return TransitionEntries(
        *(column[order].astype(kind) for column, kind in zip(columns, types, strict=True))
    )


def count_pairs(entries: TransitionEntries) -> dict[str, dict[str, int]]:
    """Pairs by kind of action and evidence, e.g. ``["grasp"]["kernel"]``."""
    key = entries.state.astype(np.int64) * N_ACTIONS + entries.action
    _, first = np.unique(key, return_index=True)
    kind = decode_actions(entries.action[first]).kind
    evidence = entries.evidence[first]
    return {
        k.name.lower(): {
            e.name.lower(): int(np.count_nonzero((kind == k) & (evidence == e))) for e in Evidence
        }
        for k in Kind
    }


def _first(item: tuple[int, TrialRecord]) -> int:
    return item[0]


def _class_entries(
    classes: SymmetryClasses,
    number: int,
    kind: Kind,
    layer: int,
    records: list[TrialRecord],
) -> TransitionEntries:
    """Entries of every member of a class, in every column of the table."""
    turn = rotation_vector_to_matrix(np.array([record.turn for record in records]))
    moved = np.array([record.displacement for record in records])
    held = np.array([record.outcome == Outcome.HELD for record in records])
    parts = [
        _member_entries(classes, (int(o), int(g)), kind, layer, (turn, moved, held))
        for o, g in np.argwhere(classes.pair_class == number)
    ]
    return TransitionEntries(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _member_entries(
    classes: SymmetryClasses,
    member: tuple[int, int],
    kind: Kind,
    layer: int,
    outcomes: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> TransitionEntries:
    """Entries of one (orientation, gripper) pair, in every column of the table."""
    orientation, hand = member
    turn, moved, held = outcomes
    representative = (classes.representative == member).all(axis=1).any()
    maps = np.flatnonzero(classes.valid[member])
    # What was measured is left as it was; what is inferred spreads over all equal maps.
    turns = np.zeros(len(held), dtype=int) if representative else np.arange(len(held)) % maps.size
    use = maps[turns]
    turn, moved = transport(turn, classes.S[member][use], classes.mirrored[use], moved)
    after, _ = nearest_orientation(turn @ R_WO[orientation])

    column = np.arange(N_XY)[:, None]
    p = POSITIONS[2 * column] + moved
    p[..., 2] = REST_HEIGHT
    ix = np.abs(GRID_X - p[..., :1]).argmin(axis=-1)
    iy = np.abs(GRID_Y - p[..., 1:2]).argmin(axis=-1)
    # A held cube is where the gripper is, and that went to the cell's centre.
    place = np.where(held, 2 * column, 2 * (3 * ix + iy))
    next_state = encode_states(place, after, np.where(held, hand, -1))
    next_state = np.where(~held & off_table(p), LOST, next_state)

    if kind == Kind.GRASP:
        state = encode_states(2 * column, orientation, -1)
        action = encode_actions(kind, hand)
    else:
        state = encode_states(2 * column + layer, orientation, hand)
        action = encode_actions(kind, 0)
    key = np.broadcast_to(state, next_state.shape).astype(np.int64) * (N_STATES + 1) + next_state
    keys, count = np.unique(key, return_counts=True)
    state, next_state = np.divmod(keys, N_STATES + 1)
    evidence = np.full(keys.size, Evidence.KERNEL)
    if representative:
        here = state == encode_states(
            2 * TRIAL_XY + layer, orientation, hand if kind == Kind.DROP else -1
        )
        evidence[here] = Evidence.MEASURED
    return TransitionEntries(
        state,
        np.full(keys.size, int(action)),
        next_state,
        count / len(held),
        count,
        evidence,
    )
