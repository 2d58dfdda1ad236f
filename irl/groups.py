"""Groups of neighbouring entries: what the pairs of one state come to together.

The transition model keeps its feasible pairs sorted by state, so a state's own actions are
neighbours, and a maximum or a sum over them is one pass over an array, however many actions each
state has. ``TransitionModel.groups`` are its pairs by state; states without actions have no group.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True, eq=False)
class Groups:
    """Consecutive groups that cover an array ``[n]``; none is empty.

    Attributes:
        first: int64 ``[m]``, where each group begins, ascending from 0.
        size: n, the number of entries.
    """

    first: np.ndarray
    size: int

    @classmethod
    def of_sorted(cls, key: np.ndarray) -> "Groups":
        """Group equal neighbours of ``key`` ``[n]``."""
        begins = np.ones(key.size, dtype=bool)
        begins[1:] = key[1:] != key[:-1]
        return cls(np.flatnonzero(begins), key.size)

    @classmethod
    def of_widths(cls, widths: np.ndarray) -> "Groups":
        """Groups of so many entries each, ``[m]``, all at least 1."""
        ends = np.cumsum(widths, dtype=np.int64)
        return cls(ends - widths, int(ends[-1]) if ends.size else 0)

    def __len__(self) -> int:
        """Number of groups."""
        return self.first.size

    @cached_property
    def widths(self) -> np.ndarray:
        """Number of entries of each group, int64 ``[m]``."""
        return np.diff(self.first, append=self.size)

    @cached_property
    def segment(self) -> np.ndarray:
        """The group that each entry belongs to, int64 ``[n]``."""
        return np.repeat(np.arange(self.first.size), self.widths)

    def spread(self, of_group: np.ndarray) -> np.ndarray:
        """Each entry's share in a number for each group: ``[m]`` to ``[n]``."""
        return of_group[self.segment]

    def maximum(self, values: np.ndarray) -> np.ndarray:
        """Largest of each group: ``[n]`` to ``[m]``."""
        width = len(self) and self.size // len(self)
        if not width or (self.widths != width).any():
            return np.maximum.reduceat(values, self.first)
        largest = values[::width].copy()
        for k in range(1, width):  # column by column: several times as fast
            np.maximum(largest, values[k::width], out=largest)
        return largest

    def sum(self, values: np.ndarray) -> np.ndarray:
        """Sum of each group: ``[n]`` to ``[m]``."""
        return np.add.reduceat(values, self.first)

    def log_sum_exp(self, values: np.ndarray) -> np.ndarray:
        """Logarithm of Σ exp of each group, without overflow: ``[n]`` to ``[m]``.

        An entry of −∞ counts nothing; each group needs one that is finite.
        """
        peak = self.maximum(values)
        return np.log(self.sum(np.exp(values - self.spread(peak)))) + peak

    def log_softmax(self, values: np.ndarray) -> np.ndarray:
        """Logarithm of each entry's share in its group's Σ exp: ``[n]`` to ``[n]``."""
        return values - self.spread(self.log_sum_exp(values))

    def first_equal(self, values: np.ndarray, of_group: np.ndarray) -> np.ndarray:
        """The first entry of each group that equals the group's number, such as its maximum.

        Args:
            values: ``[n]``.
            of_group: ``[m]``, each found in its group.

        Returns:
            Places in ``values``, int64 ``[m]``.
        """
        equal = np.flatnonzero(values == self.spread(of_group))
        return equal[np.searchsorted(self.segment[equal], np.arange(len(self)))]


def alike(mark: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Equal entries of ``mark`` ``[n]``: where each kind is first, and what kind every one is."""
    _, first, kind = np.unique(mark, return_index=True, return_inverse=True)
    return first, kind
