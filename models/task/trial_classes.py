"""Trial classes: which state–action pairs share their trials, and which pair is tried for them.

By `models.task.symmetry` and by xy-invariance (thesis 5.9.1), a class is

* of grasps: an (orientation, gripper) class, in any column;
* of translations: an (orientation, gripper) class, from any cell to any other. The hand does not
  turn, so where it goes matters only as far as it shakes the cube;
* of rotations: an (orientation, gripper, gripper afterwards) class, in any cell;
* of drops: an (orientation, gripper) class and a layer, in any column.

Numbers run through the kinds in this order. One pair stands for a class; for a translation they
are several, one for each way from cell to cell.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from models.task.spaces import (
    GRID_Z,
    N_POSITIONS,
    Indices,
    Kind,
    decode_actions,
    decode_states,
    encode_actions,
    encode_states,
)
from models.task.symmetry import SymmetryClasses, rotation_classes, symmetry_classes

TRIAL_POSITION = 8
"""Cell of the table's middle, lower layer, where classes are tried."""


class Pairs(NamedTuple):
    """State–action pairs, arrays of one shape.

    Attributes:
        state: state index.
        action: action index.
    """

    state: Indices
    action: Indices


@dataclass(frozen=True)
class TrialClasses:
    """All trial classes.

    Attributes:
        hands: classes of (orientation, gripper) pairs.
        turns: classes of (orientation, gripper, gripper afterwards) triples.
    """

    hands: SymmetryClasses
    turns: SymmetryClasses

    @property
    def n_classes(self) -> int:
        """Number of classes of all kinds."""
        return self._first(Kind.DROP) + len(GRID_Z) * self.hands.n_classes

    def number(self, state: ArrayLike, action: ArrayLike) -> Indices:
        """Class of each pair; shapes broadcast. Meaningful for `nominal_pairs` alone.

        Raises:
            ModelError: if an index is out of range.
        """
        position, orientation, gripper = decode_states(state)
        kind, target = decode_actions(action)
        hand = np.where(kind == Kind.GRASP, target, gripper)
        of_hand = self.hands.pair_class[orientation, hand]
        of_turn = self.turns.pair_class[orientation, gripper, target]
        first = np.array([self._first(Kind(k)) for k in Kind])[kind]
        layer = np.where(kind == Kind.DROP, position % len(GRID_Z), 0)
        within = np.where(kind == Kind.ROTATE, of_turn, of_hand + layer * self.hands.n_classes)
        return first + within

    def kind(self, number: int) -> Kind:
        """What kind of action a class is of."""
        return max(kind for kind in Kind if number >= self._first(kind))

    def symmetry(self, kind: Kind) -> SymmetryClasses:
        """The symmetry that classes of a kind come from."""
        return self.turns if kind == Kind.ROTATE else self.hands

    def within(self, number: int) -> tuple[int, int]:
        """Number within `symmetry`, and the layer of a drop (else 0)."""
        rest = number - self._first(self.kind(number))
        if self.kind(number) == Kind.ROTATE:
            return rest, 0
        layer, rest = divmod(rest, self.hands.n_classes)
        return rest, layer

    def tried(self, number: int, repetition: int) -> Pairs:
        """The pair that stands for a class in its n-th trial, two integers."""
        kind = self.kind(number)
        rest, layer = self.within(number)
        orientation, gripper, *after = self.symmetry(kind).representative[rest].tolist()
        if kind == Kind.GRASP:
            return _pair(TRIAL_POSITION, orientation, -1, kind, gripper)
        if kind == Kind.ROTATE:
            return _pair(TRIAL_POSITION, orientation, gripper, kind, after[0])
        if kind == Kind.DROP:
            return _pair(TRIAL_POSITION + layer, orientation, gripper, kind, 0)
        # 18 and 17 have no common divisor: 306 trials take each way from cell to cell once.
        origin = 7 * repetition % N_POSITIONS
        target = (origin + 1 + 5 * repetition % (N_POSITIONS - 1)) % N_POSITIONS
        return _pair(origin, orientation, gripper, kind, target)

    def members(self, number: int) -> tuple[Indices, Indices, Indices, Pairs]:
        """Every pair of a class, by what symmetry tells apart and by place.

        Returns:
            Orientation ``[m]``, gripper ``[m]``, gripper afterwards ``[m]`` (the same but for a
            rotation), and the pairs themselves ``[m, n_places]``.
        """
        kind = self.kind(number)
        rest, layer = self.within(number)
        found = np.argwhere(self.symmetry(kind).pair_class == rest)
        orientation, gripper, after = found[:, 0], found[:, 1], found[:, -1]
        origin, target = _places(kind, layer)
        hand = -1 if kind == Kind.GRASP else gripper[:, None]
        aim = target if kind == Kind.TRANSLATE else after[:, None]
        state = encode_states(origin, orientation[:, None], hand)
        action = np.broadcast_to(encode_actions(kind, aim), state.shape)
        return orientation, gripper, after, Pairs(state, action)

    def _first(self, kind: Kind) -> int:
        n = self.hands.n_classes
        return {
            Kind.GRASP: 0,
            Kind.TRANSLATE: n,
            Kind.ROTATE: 2 * n,
            Kind.DROP: 2 * n + self.turns.n_classes,
        }[kind]


def trial_classes(*, mirror: bool = True) -> TrialClasses:
    """Classes of all pairs.

    Args:
        mirror: whether mirror images count as one experiment.
    """
    return TrialClasses(symmetry_classes(mirror=mirror), rotation_classes(mirror=mirror))


def _pair(position: int, orientation: int, gripper: int, kind: Kind, target: int) -> Pairs:
    state = encode_states(position, orientation, gripper)
    return Pairs(*(part[()] for part in (state, encode_actions(kind, target))))


def _places(kind: Kind, layer: int) -> tuple[Indices, Indices]:
    """Cells where a class's pairs begin, and end as far as that is meant, ``[n_places]`` each."""
    every = np.arange(N_POSITIONS)
    if kind == Kind.TRANSLATE:
        origin, target = (a.ravel() for a in np.meshgrid(every, every, indexing="ij"))
        moves = origin != target
        return origin[moves], target[moves]
    if kind == Kind.DROP:
        return every[layer::2], every[::2]
    cells = every[::2] if kind == Kind.GRASP else every
    return cells, cells
