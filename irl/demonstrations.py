"""Demonstration sets: labelled pairs, where they come from, and where runs ended (§5.10)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from irl.demonstrations_csv import COLUMNS as _COLUMNS
from irl.demonstrations_csv import read, write
from irl.errors import InputError
from irl.integers import integers
from irl.labels import Labels
from irl.mdp import TransitionModel
from irl.runs import check_consistent, check_possible, impossible_moves

SOURCES = ("demonstrator", "generalised", "human")
_GENERALISED = SOURCES.index("generalised")


@dataclass(frozen=True, eq=False)
class Demonstrations:
    """Labelled pairs in the order they were given, contradictions included.

    What they say of each state, all together, is ``counted``.

    Attributes:
        trajectory: int64 ``[n]``, which trajectory a pair belongs to; a generalised pair has
            the trajectory and step of the pair it follows from.
        step: int64 ``[n]``, place within the trajectory.
        state: int64 ``[n]``.
        action: int64 ``[n]``.
        source: uint8 ``[n]``, an index into ``SOURCES``.
        ends: int64 ``[m, 3]``, where the demonstrator stopped, having nothing left to do:
            trajectory, step and state, one for a run at most, its step after all others. A run of
            an end alone says that there is nothing to do in that state. A run that was merely cut
            off has none.
    """

    trajectory: np.ndarray
    step: np.ndarray
    state: np.ndarray
    action: np.ndarray
    source: np.ndarray
    ends: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), dtype=np.int64))

    def __post_init__(self) -> None:
        """Check types and lengths, and that no two demonstrated pairs are one moment of one run.

        Raises:
            InputError: naming the field, or the trajectory and step that occur twice.
        """
        for column in _COLUMNS[:-1]:
            values = integers(getattr(self, column), f"demonstrations: field '{column}'")
            object.__setattr__(self, column, values)
        source = "demonstrations: field 'source'"
        sources = integers(self.source, source, below=len(SOURCES), dtype=np.uint8)
        object.__setattr__(self, "source", sources)
        lengths = {column: getattr(self, column).size for column in _COLUMNS}
        if len(set(lengths.values())) > 1:
            raise InputError(f"columns of one length wanted, got {lengths}", place="demonstrations")
        ends = integers(self.ends, "demonstrations: field 'ends'", columns=3)
        object.__setattr__(self, "ends", ends)
        check_consistent(self)

    @classmethod
    def from_pairs(
        cls,
        pairs: Iterable[tuple[int, int]],
        trajectory: int = 0,
        source: str = "demonstrator",
        end: int | None = None,
    ) -> "Demonstrations":
        """One trajectory of (state, action) pairs, steps counted from 0.

        Args:
            pairs: integers ``[n, 2]``: an array, or anything that gives pairs.
            trajectory: its number; runs that are to be kept together need different ones.
            source: who says so, a name in ``SOURCES``.
            end: the state in which there was nothing left to do, after all pairs; None if the run
                was cut off, or nobody knows.

        Raises:
            InputError: if ``pairs`` are not pairs of integers from 0, or ``source`` is unknown.
        """
        if source not in SOURCES:
            raise InputError(f"no source {source!r}", place="demonstrations", valid=SOURCES)
        plain = isinstance(pairs, np.ndarray) or not isinstance(pairs, Iterable)
        listed = pairs if plain else list(pairs)
        table = integers(listed, "demonstrations: (state, action) pairs", columns=2)
        n = len(table)
        return cls(
            trajectory=np.repeat(integers([trajectory], "trajectory"), n),
            step=np.arange(n, dtype=np.int64),
            state=table[:, 0],
            action=table[:, 1],
            source=np.full(n, SOURCES.index(source), dtype=np.uint8),
            ends=np.array([] if end is None else [[trajectory, n, end]]),
        )

    @classmethod
    def from_trajectories(
        cls,
        trajectories: Iterable[Iterable[tuple[int, int]]],
        ends: Iterable[int | None] | None = None,
    ) -> "Demonstrations":
        """Trajectories of (state, action) pairs, numbered from 0, conflicts included.

        Args:
            trajectories: the runs.
            ends: for each the state where it ended, as ``end`` of ``from_pairs``.
        """
        runs = list(trajectories)
        stops = [None] * len(runs) if ends is None else list(ends)
        if len(stops) != len(runs):
            raise InputError(f"{len(runs)} wanted, one a run, got {len(stops)}", place="ends")
        return cls.concatenate([cls.from_pairs(run, k, end=stops[k]) for k, run in enumerate(runs)])

    @classmethod
    def from_labels(
        cls, pairs: Iterable[tuple[int, int]], source: str = "demonstrator"
    ) -> "Demonstrations":
        """Pairs that say nothing of what comes next: each is a run of its own, numbered from 0.

        Args:
            pairs: integers ``[n, 2]``, (state, action).
            source: who says so, a name in ``SOURCES``.

        Raises:
            InputError: as ``from_pairs``.
        """
        run = cls.from_pairs(pairs, source=source)
        return replace(run, trajectory=run.step, step=np.zeros_like(run.step))

    @classmethod
    def empty(cls) -> "Demonstrations":
        """No demonstrations."""
        return cls.from_pairs([])

    @classmethod
    def concatenate(cls, parts: Sequence["Demonstrations"]) -> "Demonstrations":
        """All pairs of all parts, conflicts included.

        Raises:
            InputError: if two parts have runs of one number; number them from the start, as
                ``from_trajectories`` does.
        """
        some = parts or [cls.empty()]
        names = (*_COLUMNS, "ends")
        return cls(*(np.concatenate([getattr(part, c) for part in some]) for c in names))

    def __len__(self) -> int:
        """Number of labelled pairs."""
        return self.state.size

    def select(self, rows: np.ndarray) -> "Demonstrations":
        """The pairs at the given positions (integers, or bool ``[n]``).

        An end stays unless its run loses all its pairs.
        """
        columns = [getattr(self, column)[rows] for column in _COLUMNS]
        lost = np.setdiff1d(self.trajectory, columns[0])
        columns.append(self.ends[~np.isin(self.ends[:, 0], lost)])
        return Demonstrations(*columns)

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """The (state, action) pairs."""
        return list(zip(self.state.tolist(), self.action.tolist(), strict=True))

    @property
    def generalised(self) -> np.ndarray:
        """Which pairs follow from others instead of having been demonstrated; bool ``[n]``."""
        return self.source == _GENERALISED

    @cached_property
    def counted(self) -> Labels:
        """All labels with their counts; what was shown in a state outranks what was generalised."""
        return Labels.of(self.state, self.action, ~self.generalised)

    def resolved(self) -> "Demonstrations":
        """One label a state, see ``Labels.most_frequent``, in the order they were given."""
        return self.select(np.sort(self.counted.most_frequent().first))

    def corrected(self, answers: "Demonstrations") -> "Demonstrations":
        """Add answers; where one has a run's number, it is that question answered again.

        The former answer is then replaced, the whole run, with all that followed from it. A state
        that runs of different numbers pass through was shown more than once, and each counts.
        """
        anew = np.union1d(answers.trajectory, answers.ends[:, 0])
        kept = self.select(~np.isin(self.trajectory, anew))
        kept = replace(kept, ends=kept.ends[~np.isin(kept.ends[:, 0], anew)])
        return Demonstrations.concatenate([kept, answers])

    @property
    def in_order(self) -> np.ndarray:
        """Rows of the demonstrated pairs, int64: run after run, and each as its steps go."""
        shown = np.flatnonzero(~self.generalised)
        return shown[np.lexsort((self.step[shown], self.trajectory[shown]))]

    @property
    def last_of_runs(self) -> np.ndarray:
        """Which pairs are the last of their runs; bool ``[n]``, false for generalised ones."""
        ordered = self.in_order
        run = self.trajectory[ordered]
        last = np.zeros(len(self), dtype=bool)
        last[ordered[np.append(run[1:] != run[:-1], True)[: run.size]]] = True
        return last

    def ended_in(self, model: TransitionModel) -> np.ndarray:
        """The states that runs ended in; int64, ascending.

        Where a run does not say, the likeliest that its last action led to, unless somebody was
        seen to act there.
        """
        last = self.last_of_runs & ~np.isin(self.trajectory, self.ends[:, 0])
        pair = model.pair_index(self.state[last], self.action[last])
        likeliest = np.asarray(model.P[pair].argmax(axis=1)).ravel() if pair.size else pair
        return np.union1d(
            self.ends[:, 2], np.setdiff1d(likeliest, self.state[~self.generalised])
        ).astype(np.int64)

    @property
    def states_by_rank(self) -> np.ndarray:
        """The distinct states, int64: those shown before others, then as they were first given."""
        state = self.state[np.argsort(self.generalised, kind="stable")]
        return state[np.sort(np.unique(state, return_index=True)[1])]

    @property
    def n_states_demonstrated(self) -> int:
        """Number of distinct states that have a label."""
        return np.unique(self.state).size

    def demonstrated_fraction(self, n_states: int) -> float:
        """Distinct labelled states as a share of ``n_states`` (first row of Table 6.3)."""
        return self.n_states_demonstrated / n_states

    def check(self, model: TransitionModel, place: str = "demonstrations.csv") -> None:
        """Check that every pair can be executed, and that every move of a run is possible.

        Raises:
            InputError: naming ``place``, row and field of the first pair that cannot be executed,
                or trajectory, step and move of the first that the model says is impossible.
        """
        check_possible(self, model, place)

    def parted(self, model: TransitionModel) -> tuple["Demonstrations", int]:
        """These pairs, each run parted where the model says that a move is impossible.

        What comes after such a move becomes a run of its own, numbered after all there are.

        Args:
            model: the transition model; every pair must be feasible in it.

        Returns:
            The pairs in the same order, and the number of places where a run was parted.
        """
        impossible = impossible_moves(self, model)[:, 1]
        trajectory, ends = self.trajectory.copy(), self.ends.copy()
        highest = int(trajectory.max(initial=-1))
        for number, row in enumerate(impossible, start=highest + 1):
            run, step = self.trajectory[row], self.step[row]
            trajectory[(self.trajectory == run) & (self.step >= step)] = number
            ends[self.ends[:, 0] == run, 0] = number
        return replace(self, trajectory=trajectory, ends=ends), impossible.size

    def save(self, path: Path) -> None:
        """Write as CSV, whole or not at all; where a run ended is a row without an action."""
        columns = [getattr(self, column) for column in _COLUMNS[:-1]]
        write(path, columns, [SOURCES[k] for k in self.source], self.ends)

    @classmethod
    def load(cls, path: Path) -> "Demonstrations":
        """Read a CSV file.

        Raises:
            InputError: if it is missing or not CSV, or a column or value is wrong.
        """
        (trajectory, step, state, action), source, ends = read(path, SOURCES)
        try:
            return cls(trajectory, step, state, action, source, ends)
        except InputError as error:
            raise error.at(str(path)) from None
