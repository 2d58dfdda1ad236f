"""The package's plain file formats: JSON, CSV and npz.

Equal content gives equal bytes, so a hash names a file's content; a file that cannot be read
gives one line that names it. Writers are not atomic: wrap them in ``irl.files.atomic_path``.
"""

import csv
import io
import json
import zipfile
import zlib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from irl.errors import InputError, first_line

# The earliest date a zip can hold: a real one would change the bytes at every writing.
_NO_DATE = (1980, 1, 1, 0, 0, 0)


def _text(path: Path) -> str:
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
        InputError: if the file is missing or not JSON (NaN and infinity are not JSON).
    """

    def refuse(constant: str) -> None:
        raise ValueError(f"{constant} is not a JSON number")

    text = _text(Path(path))
    try:
        return json.loads(text, parse_constant=refuse)
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
        rows = list(csv.reader(io.StringIO(_text(Path(path)), newline=""), strict=True))
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


def write_npz(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """Write named arrays as a compressed npz, in the order of their names.

    Raises:
        ValueError: if an array holds Python objects.
    """
    with zipfile.ZipFile(path, "w") as archive:
        for name in sorted(arrays):
            # order="C" and little-endian, so that equal values are equal bytes.
            array = np.asarray(arrays[name], order="C")
            array = array.astype(array.dtype.newbyteorder("<"), copy=False)
            data = io.BytesIO()
            np.lib.format.write_array(data, array, allow_pickle=False)
            entry = zipfile.ZipInfo(f"{name}.npy", date_time=_NO_DATE)
            entry.create_system = 3
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, data.getvalue(), zipfile.ZIP_DEFLATED, compresslevel=9)


def read_npz(path: Path) -> dict[str, np.ndarray]:
    """Read named arrays; nothing is unpickled.

    Raises:
        InputError: if the file is missing, damaged, or holds anything but plain arrays.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    arrays = {}
    name = ""
    try:
        with zipfile.ZipFile(path) as archive:
            for name in archive.namelist():
                data = io.BytesIO(archive.read(name))
                array = np.lib.format.read_array(data, allow_pickle=False)
                arrays[name.removesuffix(".npy")] = array
    except (
        OSError,
        ValueError,
        EOFError,
        RuntimeError,
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        place = f"{path}: field {name.removesuffix('.npy')!r}" if name else f"{path}:"
        raise InputError(f"{place} cannot be read ({first_line(error)})") from error
    return arrays
