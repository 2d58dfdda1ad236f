"""How many trials each class deserves, and which comes next (thesis 5.9).

A class is tried in blocks. After each block it is done if the share of its most frequent outcome
is known well enough, or the most trials were spent. That depends on the class's own trials alone,
so a finished campaign holds the same trials in whatever order they were run. Until then, classes
without any trial come first, then those whose share is known least.
"""

import math
from collections import Counter
from collections.abc import Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from diagrams.trials.record import Pair, TrialRecord
from models.errors import ModelError
from models.rotations import rotation_vector_to_matrix
from models.task.discretise import nearest_orientation
from models.task.spaces import GRID_X, GRID_Y, R_WO, decode_states

Label = Hashable
MOST_TRIALS = 1_000_000
"""Of a class, that a plan may ask for: more than a year of one processor."""
_Z = 1.959963984540054  # of a 95 % interval


@dataclass(frozen=True)
class Plan:
    """When a class has had enough trials."""

    width: float = 0.3
    """How wide the 95 % interval of the most frequent outcome's probability may be in the end."""
    block: int = 4
    """How many trials lie between two looks at it. A class has whole blocks only.
    So what it has in the end does not depend on the order in which trials ended."""
    least: int = 16
    """How many trials a class has at least."""
    most: int = 48
    """How many trials a class has at most."""

    def __post_init__(self) -> None:
        """Refuse what cannot be planned, by a ModelError that names the field and its choices."""
        if not 0.0 < self.width <= 1.0:
            raise ModelError(f"plan: width is {self.width}; give a share above 0, up to 1")
        if not 1 <= self.block <= self.least <= self.most <= MOST_TRIALS:
            raise ModelError(
                f"plan: block {self.block}, least {self.least}, most {self.most}; "
                f"give 1 ≤ block ≤ least ≤ most ≤ {MOST_TRIALS}"
            )

    def wanted(self, labels: Mapping[int, Label]) -> int:
        """How many trials a class needs, as far as its trials so far tell.

        Args:
            labels: outcome by repetition. Only those that form an unbroken run from 0 count.
        """
        known = list(_unbroken(labels))
        n = self.least
        while n < self.most and n <= len(known) and interval_width(known[:n]) > self.width:
            n += self.block
        return min(n, self.most)


def interval_width(labels: Iterable[Label]) -> float:
    """Width of Wilson's 95 % interval of the most frequent label's probability; 1 without any."""
    count = Counter(labels)
    n = count.total()
    if not n:
        return 1.0
    share = max(count.values()) / n
    spread = math.sqrt(share * (1 - share) / n + (_Z / (2 * n)) ** 2)
    return 2 * _Z * spread / (1 + _Z**2 / n)


def outcome_label(pair: Pair, record: TrialRecord) -> Label:
    """What makes two outcomes of one class differ: held or free, orientation, columns moved."""
    orientation = decode_states(pair.state).orientation
    R_WO_after = rotation_vector_to_matrix(record.turn) @ R_WO[orientation]
    x, y, _ = record.displacement
    columns = round(x / np.ptp(GRID_X[:2])), round(y / np.ptp(GRID_Y[:2]))
    return record.outcome, int(nearest_orientation(R_WO_after)[0]), columns


class Queue:
    """Hands out trials, the neediest class first."""

    def __init__(self, plan: Plan, classes: Iterable[int]) -> None:
        """Plan trials of these classes."""
        self._plan = plan
        self._labels: dict[int, dict[int, Label]] = {number: {} for number in classes}
        self._handed_out: dict[int, set[int]] = {number: set() for number in self._labels}

    @property
    def wanted(self) -> int:
        """Trials that all classes need, as far as is known."""
        return sum(self._plan.wanted(labels) for labels in self._labels.values())

    @property
    def done(self) -> int:
        """Trials that count towards `wanted`."""
        return sum(
            sum(r < self._plan.wanted(labels) for r in labels) for labels in self._labels.values()
        )

    def add(self, number: int, repetition: int, label: Label) -> None:
        """Take in the outcome of a trial, handed out here or known from before."""
        self._handed_out[number].add(repetition)
        self._labels[number][repetition] = label

    def next(self) -> tuple[int, int] | None:
        """Class and repetition of the trial to run next; None if all are done or on their way."""
        best: tuple[float, int, int, int] | None = None
        for number, labels in self._labels.items():
            handed_out = self._handed_out[number]
            wanted = self._plan.wanted(labels)
            if len(handed_out) >= wanted and handed_out.issuperset(range(wanted)):
                continue
            missing = next(r for r in range(wanted) if r not in handed_out)
            need = (-interval_width(labels.values()), len(handed_out), number, missing)
            best = need if best is None else min(best, need)
        if best is None:
            return None
        _, _, number, repetition = best
        self._handed_out[number].add(repetition)
        return number, repetition


def _unbroken(labels: Mapping[int, Label]) -> Iterator[Label]:
    repetition = 0
    while repetition in labels:
        yield labels[repetition]
        repetition += 1
