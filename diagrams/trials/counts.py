"""From trials to transition probabilities: each trial speaks for its whole symmetry class."""

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Sequence
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from diagrams.trials.record import Outcome, Pair, Trial
from models.rotations import rotation_vector_to_matrix
from models.task.discretise import nearest_orientation, off_table
from models.task.estimate import estimated_transitions
from models.task.kernel_rules import THESIS_RULES, thesis_kernel
from models.task.pairs import pair_key, split_key
from models.task.spaces import (
    GRID_X,
    GRID_Y,
    GRID_Z,
    LOST,
    N_STATES,
    POSITIONS,
    R_WO,
    REST_HEIGHT,
    Kind,
    decode_actions,
    decode_states,
    encode_states,
)
from models.task.symmetry import transport
from models.task.trial_classes import Pairs, TrialClasses


class Evidence(IntEnum):
    """Where a transition's probability comes from; task data know the same names, in this order."""

    MEASURED = 0
    KERNEL = 1
    ESTIMATED = 2


class TransitionEntries(NamedTuple):
    """The grasping task's (s, a, s') as counted; `irl.task.Transitions` is what any task data hold.

    Parallel arrays, sorted by state, action, next state.

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

    @property
    def key(self) -> np.ndarray:
        """Pair key of each entry, int64 ``[n]``."""
        return pair_key(self.state, self.action)

    def select(self, which: np.ndarray) -> "TransitionEntries":
        """Some of the entries, by a mask or by indices."""
        return TransitionEntries(*(column[which] for column in self))


def transition_entries(
    feasible: np.ndarray,
    trials: Iterable[Trial],
    classes: TrialClasses,
) -> TransitionEntries:
    """Fill every feasible pair: from its class's trials, else from the geometric estimate.

    A trial is carried to each member of its class by one of the scene maps; a member with
    several maps takes them in turn, since all are equally true. A fault counts for nothing.

    Args:
        feasible: bool ``[N_STATES or more, N_ACTIONS]``.
        trials: of pairs that stand for their classes.
        classes: which pairs share trials.
    """
    by_class = judged_by_class(
        sorted(trials, key=_by_repetition), lambda pair: pair.number(classes)
    )
    parts = [_class_entries(classes, number, tried) for number, tried in by_class.items()]
    parts = [part.select(feasible[part.state, part.action]) for part in parts]
    rest = feasible[:N_STATES].copy()
    for part in parts:
        rest[part.state, part.action] = False
    estimate = estimated_transitions(rest)
    n = estimate.state.size
    zero, estimated = np.zeros(n, dtype=np.int64), np.full(n, Evidence.ESTIMATED)
    parts.append(TransitionEntries(*estimate, zero, estimated))

    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    order = np.lexsort((columns[2], columns[1], columns[0]))
    types = (np.int32, np.int32, np.int32, np.float64, np.int64, np.uint8)
    return TransitionEntries(
        *(column[order].astype(kind) for column, kind in zip(columns, types, strict=True))
    )


def thesis_entries(
    feasible: np.ndarray, trials: Iterable[Trial], rules: Collection[str] = THESIS_RULES
) -> TransitionEntries:
    """Fill the pairs that trials speak for by the kernel of 5.9.1, and no others.

    A trial counts for every pair of its kernel class, with the cube's turn and displacement in
    the world as they were.

    Args:
        feasible: bool ``[N_STATES or more, N_ACTIONS]``.
        trials: of any pairs.
        rules: those of the kernel that hold.
    """
    by_class = judged_by_class(
        sorted(trials, key=_by_repetition),
        lambda pair: int(thesis_kernel(pair.state, pair.action, rules)),
    )
    state, action = np.nonzero(feasible[:N_STATES])
    number = thesis_kernel(state, action, rules)
    parts = []
    for each, tried in by_class.items():
        of_class = number == each
        pairs = Pairs(state[of_class][:, None], action[of_class][:, None])
        _, orientation, gripper = decode_states(pairs.state[:, 0])
        kind, target = decode_actions(pairs.action[:, 0])
        after = np.where((kind == Kind.GRASP) | (kind == Kind.ROTATE), target, gripper)
        turn, moved, held = _outcomes(tried)
        next_state = _next_states(pairs, orientation, after, turn[None], moved[None], held)
        parts.append(_count(pairs, next_state, tried))
    return TransitionEntries(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def judged_by_class(
    trials: Iterable[Trial], number: Callable[[Pair], int]
) -> dict[int, list[Trial]]:
    """Trials that judged something, by the number of their pair's class, ascending.

    Args:
        trials: in the order that those of a class keep; faults are left out.
        number: of a pair's class.
    """
    by_class: dict[int, list[Trial]] = defaultdict(list)
    for trial in trials:
        if trial.record.outcome != Outcome.FAULT:
            by_class[number(trial.pair)].append(trial)
    return dict(sorted(by_class.items()))


def count_pairs(entries: TransitionEntries) -> dict[str, dict[str, int]]:
    """Pairs by kind of action and evidence, e.g. ``["grasp"]["kernel"]``."""
    _, first = np.unique(entries.key, return_index=True)
    kind = decode_actions(entries.action[first]).kind
    evidence = entries.evidence[first]
    return {
        k.name.lower(): {
            e.name.lower(): int(np.count_nonzero((kind == k) & (evidence == e))) for e in Evidence
        }
        for k in Kind
    }


def trio_key(pair: np.ndarray, next_state: np.ndarray) -> np.ndarray:
    """One integer for a pair's key and a next state, *lost* included; sorts as the entries do."""
    return pair * (LOST + 1) + next_state


def split_trio(key: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A pair's key and the next state, the inverse of `trio_key`."""
    pair, next_state = np.divmod(key, LOST + 1)
    return pair, next_state


def _by_repetition(trial: Trial) -> tuple[int, Pair]:
    """Order by repetition, so that equally true scene maps share the trials evenly."""
    return trial.repetition, trial.pair


def _class_entries(
    classes: TrialClasses, number: int, trials: Sequence[Trial]
) -> TransitionEntries:
    """Entries of every pair of a class."""
    turn, moved, held = _outcomes(trials)
    orientation, gripper, after, pairs = classes.members(number)
    use = _scene_maps(classes, number, orientation, gripper, after, len(trials))
    symmetry = classes.symmetry(classes.kind(number))
    member = (orientation, gripper, after)[: symmetry.pair_class.ndim]
    S = symmetry.S[member][np.arange(len(orientation))[:, None], use]
    turn, moved = transport(turn, S, symmetry.mirrored[use], moved)
    return _count(pairs, _next_states(pairs, orientation, after, turn, moved, held), trials)


def _outcomes(trials: Sequence[Trial]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The cube's turn ``[t, 3, 3]`` and displacement ``[t, 3]``, and whether it is held ``[t]``."""
    records = [trial.record for trial in trials]
    return (
        rotation_vector_to_matrix(np.array([record.turn for record in records])),
        np.array([record.displacement for record in records]),
        np.array([record.outcome == Outcome.HELD for record in records]),
    )


def _next_states(
    pairs: Pairs,
    orientation: np.ndarray,
    after: np.ndarray,
    turn: np.ndarray,
    moved: np.ndarray,
    held: np.ndarray,
) -> np.ndarray:
    """Where outcomes lead that are already carried to each member.

    Args:
        pairs: ``[m, places]``.
        orientation: the cube's ``[m]``.
        after: gripper orientation that holds the cube in the end, if it is held ``[m]``.
        turn: ``[m, t, 3, 3]``.
        moved: displacement ``[m, t, 3]``.
        held: ``[t]``.

    Returns:
        State indices ``[m, places, t]``.
    """
    new_orientation, _ = nearest_orientation(turn @ R_WO[orientation][:, None])
    # Where the hand is in the end; a cube it does not hold lies beneath, give or take.
    origin = decode_states(pairs.state).position
    kind, target = decode_actions(pairs.action)
    cell = np.where(kind == Kind.TRANSLATE, target, origin)[..., None]
    p_WO = POSITIONS[cell] + moved[:, None]
    p_WO[..., 2] = REST_HEIGHT
    ix = np.abs(GRID_X - p_WO[..., :1]).argmin(axis=-1)
    iy = np.abs(GRID_Y - p_WO[..., 1:2]).argmin(axis=-1)
    place = np.where(held, cell, len(GRID_Z) * (len(GRID_Y) * ix + iy))
    hand = np.where(held, after[:, None, None], -1)
    next_state = encode_states(place, new_orientation[:, None], hand)
    return np.where(~held & off_table(p_WO), LOST, next_state)


def _count(pairs: Pairs, next_state: np.ndarray, trials: Sequence[Trial]) -> TransitionEntries:
    """Entries out of next states ``[m, places, t]``."""
    pair = pair_key(pairs.state, pairs.action)
    trios, count = np.unique(trio_key(pair[..., None], next_state), return_counts=True)
    pair, next_state = split_trio(trios)
    state, action = split_key(pair)
    tried = [trial.pair.key for trial in trials]
    evidence = np.where(np.isin(pair, tried), Evidence.MEASURED, Evidence.KERNEL)
    return TransitionEntries(state, action, next_state, count / len(trials), count, evidence)


def _scene_maps(
    classes: TrialClasses,
    number: int,
    orientation: np.ndarray,
    gripper: np.ndarray,
    after: np.ndarray,
    n_trials: int,
) -> np.ndarray:
    """Which scene map carries each trial to each member of a class, int ``[m, n_trials]``."""
    symmetry = classes.symmetry(classes.kind(number))
    rest, _ = classes.within(number)
    use = np.empty((len(orientation), n_trials), dtype=np.int64)
    for row, member in enumerate(zip(orientation, gripper, after, strict=True)):
        key = tuple(int(part) for part in member[: symmetry.pair_class.ndim])
        maps = np.flatnonzero(symmetry.valid[key])
        # What was measured is left as it was; what is inferred spreads over all equal maps.
        representative = (symmetry.representative[rest] == key).all()
        use[row] = 0 if representative else maps[np.arange(n_trials) % maps.size]
    return use
