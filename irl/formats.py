"""The package's plain text formats: JSON and CSV; ``irl.npz`` has that of arrays.

Equal content gives equal bytes, so a hash names a file's content; a file that cannot be read
gives one line that names it. Writers are not atomic: wrap them in ``irl.files.atomic_path``.
"""

import csv
import io
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from irl.errors import InputError, first_line


def distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object of pairs, for ``json.loads``.

    Raises:
        ValueError: if a name occurs twice: which of its values counts is anyone's guess.
    """
    names = [name for name, _ in pairs]
    for k, name in enumerate(names):
        if name in names[:k]:
            raise ValueError(f"the name {name!r:.40} occurs twice in one object")
    return dict(pairs)


def read_text(path: Path) -> str:
    """The text of a UTF-8 file.

    Raises:
        InputError: if it is missing, not a file, or not UTF-8.
    """
    if path.exists() and not path.is_file():  # a pipe would be waited for
        raise InputError(f"{path}: not a file")
    try:
        return path.read_bytes().decode("utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text (byte {error.start})") from error


def write_json(path: Path, value: dict[str, Any]) -> None:
    """Write an object as JSON, one field a line.

    Raises:
        ValueError: if it holds NaN or infinity, which are not JSON.
    """
    lines = [
        f"{json.dumps(name, ensure_ascii=False)}: "
        f"{json.dumps(item, ensure_ascii=False, allow_nan=False)}"
        for name, item in value.items()
    ]
    Path(path).write_bytes(("{\n" + ",\n".join(lines) + "\n}\n").encode())


def read_json(path: Path) -> Any:
    """Read strict JSON.

    Raises:
        InputError: if the file is missing or not JSON (NaN and infinity are not JSON), or an
            object has a name twice.
    """

    def refuse(constant: str) -> None:
        raise ValueError(f"{constant} is not a JSON number")

    text = read_text(Path(path))
    try:
        return json.loads(text, parse_constant=refuse, object_pairs_hook=distinct)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not valid JSON ({first_line(error)})") from error


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a header and rows, with LF line ends on every platform."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    Path(path).write_bytes(text.getvalue().encode())


def read_csv(path: Path) -> tuple[list[str], list[list[str]]]:
    """Read a CSV file: the header, and rows as long as the header.

    Raises:
        InputError: if the file is missing, not CSV, without a header of distinct names, or a
            row's length differs from the header's.
    """
    try:
        rows = list(csv.reader(io.StringIO(read_text(Path(path)), newline=""), strict=True))
    except csv.Error as error:
        raise InputError(f"{path}: not valid CSV ({first_line(error)})") from error
    if not rows or not rows[0] or len(set(rows[0])) != len(rows[0]):
        raise InputError(f"{path}: the first line must name the columns, each once")
    header, *body = rows
    for number, row in enumerate(body):
        if len(row) != len(header):
            raise InputError(
                f"{path}: row {number} has {len(row)} columns, the header has {len(header)}"
            )
    return header, body
