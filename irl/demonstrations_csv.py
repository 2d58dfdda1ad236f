"""The file of a demonstration set: ``demonstrations.csv``, a row a pair.

Where a run ended is a row without an action.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from irl.errors import InputError
from irl.files import atomic_path
from irl.formats import read_csv, write_csv

COLUMNS = ["trajectory", "step", "state", "action", "source"]


def write(
    path: Path, columns: Sequence[np.ndarray], source: Sequence[str], ends: np.ndarray
) -> None:
    """Write a set, whole or not at all.

    Args:
        path: the file.
        columns: of ``COLUMNS`` all but the last, integers ``[n]`` each.
        source: the last, ``[n]``.
        ends: int ``[m, 3]``, where runs ended: trajectory, step and state.
    """
    listed = [column.tolist() for column in columns]
    pairs = zip(*listed, source, strict=True)
    last = {run: row for row, run in enumerate(listed[0])}
    placed: list[tuple[int, tuple]] = list(enumerate(pairs))
    placed += [
        (last.get(run, len(source)), (run, step, state, "", "demonstrator"))
        for run, step, state in ends.tolist()
    ]
    rows = [row for _, row in sorted(placed, key=lambda each: each[0])]
    with atomic_path(path) as temporary:
        write_csv(temporary, COLUMNS, rows)


def read(path: Path, sources: Sequence[str]) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
    """Read a set.

    Args:
        path: the file.
        sources: what may stand in the column ``source``.

    Returns:
        Columns int64 ``[n]``, of ``COLUMNS`` all but the last; the last as indices into
        ``sources``, uint8 ``[n]``; and where runs ended, ``[m, 3]``: trajectory, step and state.

    Raises:
        InputError: if it is missing or not CSV, or a column or value is wrong.
    """
    header, rows = read_csv(path)
    if header != COLUMNS:
        raise InputError(f"{path}: columns must be {COLUMNS}, are {header}")
    for number, row in enumerate(rows):
        for k, name in enumerate(COLUMNS[:-1]):
            number_there = row[k].isascii() and row[k].isdigit() and len(row[k]) < 19
            if not number_there and (name, row[k]) != ("action", ""):
                raise InputError(
                    f"{path}: row {number}, field '{name}' must be an integer from 0, is {row[k]!r}"
                )
    for number, row in enumerate(rows):
        if row[-1] not in sources:
            raise InputError(
                f"row {number}, field 'source' is {row[-1]!r}", place=str(path), valid=sources
            )
    pairs = [row for row in rows if row[3]]
    columns = [np.array([int(row[k]) for row in pairs], dtype=np.int64) for k in range(4)]
    source = np.array([sources.index(row[-1]) for row in pairs], dtype=np.uint8)
    ends = np.array([[int(cell) for cell in row[:3]] for row in rows if not row[3]])
    return columns, source, ends
