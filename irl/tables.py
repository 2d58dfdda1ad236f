"""Demonstrations from tables: a pandas frame, or a CSV file as Excel and pandas write it.

A frame is recognised by its attributes; pandas need not be installed. Which column means what is
said by `Columns`; what a table does not say, such as where runs end, is asked for, not guessed.
"""

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from irl.choices import check_choice
from irl.demonstrations import SOURCES, Demonstrations
from irl.errors import InputError, first_line
from irl.formats import read_text

_WHOLE = 2**53  # above it floats skip integers
_DIGITS = 18  # so many fit into int64


@dataclass(frozen=True)
class Columns:
    """Which column of a table means what; None says that there is none, and what that means.

    Attributes:
        trajectory: the number or name of a row's run. None: all rows are one run.
        step: a row's place within its run, integers. None: the rows of a run follow one another
            in the order of the table.
        state: index of the state.
        action: index of the action; may be empty in the last row of a run, where it ended.
    """

    trajectory: str | None = "trajectory"
    step: str | None = "step"
    state: str = "state"
    action: str = "action"


def from_frame(
    frame: Any, columns: Columns | None = None, *, source: str = "demonstrator"
) -> Demonstrations:
    """Demonstrations from a data frame, one row a state and an action.

    Args:
        frame: a pandas frame, or whatever has ``columns`` and gives an array-like for each name,
            or a mapping from names to arrays. Its index and its other columns don't count.
        columns: which column means what; by default what ``Columns`` says.
        source: who says so, a name in ``irl.demonstrations.SOURCES``.

    Returns:
        The pairs in the order of the table; runs with numbers keep these, named ones are numbered
        from 0 as they first occur.

    Raises:
        InputError: naming the column that is missing, there twice, or of another kind, and the row.
    """
    names = [*frame] if isinstance(frame, Mapping) else getattr(frame, "columns", None)
    if names is None:
        raise InputError(
            f"{type(frame).__name__} has no columns; a data frame or a mapping of arrays wanted",
            place="frame",
        )
    names = [str(name) for name in names]
    columns = columns or Columns()
    _check_names(names, columns, "frame")
    cells = {
        field: np.asarray(frame[name]).tolist()
        for field, name in vars(columns).items()
        if name is not None
    }
    if len({len(column) for column in cells.values()}) > 1:
        raise InputError("columns of one length wanted", place="frame")
    return _Table(cells, columns, "frame").demonstrations(source)


def from_csv(
    path: Path, columns: Columns | None = None, *, source: str = "demonstrator"
) -> Demonstrations:
    """Demonstrations from a CSV file: UTF-8 with or without a byte-order mark.

    Commas or, as Excel writes in many countries, semicolons divide the columns. Blank lines at the
    end, a column without a name (a frame's index) and other columns don't count.
    ``Demonstrations.load`` is the stricter door, for files that ``save`` wrote.

    Args:
        path: the file.
        columns: which column means what; by default what ``Columns`` says.
        source: who says so, a name in ``irl.demonstrations.SOURCES``.

    Returns:
        As ``from_frame``.

    Raises:
        InputError: naming the file, and the line and column at fault. A line that is blank
            between others is refused, for it may mean the end of a run.
    """
    place, columns = str(path), columns or Columns()
    text = read_text(Path(path)).removeprefix("\ufeff")
    header_line = text.split("\n", 1)[0]
    divider = ";" if ";" in header_line and "," not in header_line else ","
    try:
        lines = [
            [cell.strip() for cell in line]
            for line in csv.reader(io.StringIO(text, newline=""), delimiter=divider, strict=True)
        ]
    except csv.Error as error:
        raise InputError(f"not valid CSV ({first_line(error)})", place=place) from error
    while lines and not any(lines[-1]):
        lines.pop()
    if not lines:
        raise InputError("the first line must name the columns, the file is empty", place=place)
    names, *rows = lines
    _check_names(names, columns, place)
    for number, row in enumerate(rows, start=2):
        if not any(row):
            raise InputError(
                f"line {number} is blank, with more after it; number the runs in a column, and "
                "take the line out",
                place=place,
            )
        if len(row) != len(names):
            raise InputError(
                f"line {number} has {len(row)} columns, the header has {len(names)}", place=place
            )
    cells = {
        field: [row[names.index(name)] for row in rows]
        for field, name in vars(columns).items()
        if name is not None
    }
    return _Table(cells, columns, place, "line", first=2).demonstrations(source)


def _check_names(names: list[str], columns: Columns, place: str) -> None:
    remedy = {
        "trajectory": "; if all rows are one run, say so: Columns(trajectory=None)",
        "step": "; if the rows of a run are in order, say so: Columns(step=None)",
    }
    for field, name in vars(columns).items():
        if name is None or names.count(name) == 1:
            continue
        if name in names:
            raise InputError(f"column {name!r} is there {names.count(name)} times", place=place)
        raise InputError(
            f"no column {name!r}; name the one of the {field}: Columns({field}=…)"
            f"{remedy.get(field, '')}",
            place=place,
            valid=[n for n in names if n] or ["none"],
        )


@dataclass(frozen=True)
class _Table:
    """The columns that count, each a list of numbers or text, by the field they are for."""

    cells: Mapping[str, list[Any]]
    columns: Columns
    place: str
    row: str = "row"
    first: int = 0

    def demonstrations(self, source: str) -> Demonstrations:
        """The rows that have an action, as pairs."""
        check_choice("source", source, SOURCES)
        state = self.numbers("state")
        # A run's end: the state without an action. No action has the number −1.
        action = self.numbers("action", gap=-1)
        run = self.runs()
        step = self.places(run) if self.columns.step is None else self.numbers("step")
        order = np.lexsort((step, run))
        goes_on = np.zeros(run.size, dtype=bool)
        goes_on[order[:-1]] = run[order[1:]] == run[order[:-1]]
        for k in np.flatnonzero((action < 0) & goes_on)[:1]:
            raise self.error(k, "action", "is empty, but its run goes on")
        shown = action >= 0
        label = np.full(int(shown.sum()), SOURCES.index(source), dtype=np.uint8)
        try:
            return Demonstrations(run[shown], step[shown], state[shown], action[shown], label)
        except InputError as error:
            raise error.at(self.place) from None

    def error(self, k: int, field: str, reason: str) -> InputError:
        """A mistake in row ``k`` of the column for ``field``."""
        name = getattr(self.columns, field)
        return InputError(
            f"{self.row} {k + self.first}, column {name!r} {reason}", place=self.place
        )

    def numbers(self, field: str, gap: int | None = None) -> NDArray[np.int64]:
        """A column of integers from 0, ``gap`` standing for an empty cell; refused if None."""
        values = []
        for k, cell in enumerate(self.cells[field]):
            value = gap if _empty(cell) else _whole(cell)
            if value is None:
                raise self.error(k, field, f"must be an integer from 0, is {_shown(cell)}")
            values.append(value)
        return np.array(values, dtype=np.int64)

    def runs(self) -> NDArray[np.int64]:
        """Each row's run: its number, or, of runs with names, one in order of appearance."""
        if self.columns.trajectory is None:
            return np.zeros(len(self.cells["state"]), dtype=np.int64)
        cells = self.cells["trajectory"]
        if not any(
            isinstance(cell, str) and not _empty(cell) and _whole(cell) is None for cell in cells
        ):
            return self.numbers("trajectory")
        for k, cell in enumerate(cells):
            if _empty(cell):
                raise self.error(k, "trajectory", "is empty")
        number = {name: k for k, name in enumerate(dict.fromkeys(map(str, cells)))}
        return np.array([number[str(cell)] for cell in cells], dtype=np.int64)

    def places(self, run: NDArray[np.int64]) -> NDArray[np.int64]:
        """Each row's place within its run, rows being in order and runs one after the other."""
        begins = np.r_[True, run[1:] != run[:-1]][: run.size]
        first = np.flatnonzero(begins)
        _, earliest = np.unique(run[first], return_index=True)
        for k in np.setdiff1d(first, first[earliest])[:1]:
            raise self.error(
                k, "trajectory", "takes up a run that had ended; give a column of steps"
            )
        return np.arange(run.size) - first[np.cumsum(begins) - 1]


def _empty(cell: Any) -> bool:
    """Whether nothing is there: no text, None, or a number that is not one."""
    if isinstance(cell, float):
        return math.isnan(cell)
    # Pandas' own mark is known by its type's name; compared with anything it gives itself.
    return type(cell).__name__ in ("NoneType", "NAType") or (isinstance(cell, str) and not cell)


def _whole(cell: Any) -> int | None:
    """The integer from 0 that a cell holds, also as 3.0: a frame's column with a gap is floats."""
    if isinstance(cell, str):
        text = cell.removesuffix(".0")
        return int(text) if text.isascii() and text.isdigit() and len(text) <= _DIGITS else None
    if isinstance(cell, float):
        return int(cell) if 0 <= cell < _WHOLE and cell == int(cell) else None
    if isinstance(cell, int) and not isinstance(cell, bool):
        return cell if 0 <= cell < 10**_DIGITS else None
    return None


def _shown(cell: Any) -> str:
    return "empty" if _empty(cell) else f"{cell!r:.40}"
