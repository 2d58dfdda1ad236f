"""Named arrays in a zip: NumPy's npz, with equal bytes for equal content, read without trust.

What a file says of itself is looked at before anything is made as large as it says: how far each
member unpacks, and what type and shape its header declares.
"""

import io
import math
import tokenize
import zipfile
import zlib
from pathlib import Path

import numpy as np

from irl.errors import InputError, first_line

LARGEST = 4 * 2**30
"""Bytes that all members of a file may unpack to."""

# The earliest date a zip can hold: a real one would change the bytes at every writing.
_NO_DATE = (1980, 1, 1, 0, 0, 0)
_SUFFIX = ".npy"
_DAMAGE = (
    *(OSError, ValueError, EOFError, RuntimeError, TypeError, OverflowError, MemoryError),
    *(KeyError, IndexError, AttributeError, SyntaxError, NotImplementedError, tokenize.TokenError),
    *(zipfile.BadZipFile, zlib.error),
)
"""What NumPy and zipfile raise over damaged bytes; none of it says more than that they are."""


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
            entry = zipfile.ZipInfo(f"{name}{_SUFFIX}", date_time=_NO_DATE)
            entry.create_system = 3
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, data.getvalue(), zipfile.ZIP_DEFLATED, compresslevel=9)


def read_npz(path: Path) -> dict[str, np.ndarray]:
    """Read named arrays; nothing is unpickled.

    Raises:
        InputError: if the file is missing, damaged, holds a name twice or anything but plain
            arrays, or would unpack to more than ``LARGEST`` bytes.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    arrays: dict[str, np.ndarray] = {}
    place = str(path)
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            size = sum(member.file_size for member in members)
            if size > LARGEST:
                raise ValueError(f"it would unpack to {size} bytes, the most is {LARGEST}")
            for member in members:
                name = member.filename.removesuffix(_SUFFIX)
                place = f"{path}: field {name!r}"
                if not member.filename.endswith(_SUFFIX) or not name or set("/\\") & set(name):
                    raise ValueError("no name of an array")
                if name in arrays:
                    raise ValueError("it is there twice")
                arrays[name] = _array(archive.read(member))
    except _DAMAGE as error:
        raise InputError(f"cannot be read ({first_line(error)})", place=place) from error
    return arrays


def _array(data: bytes) -> np.ndarray:
    """The array of an npy file.

    Raises:
        ValueError: if it holds objects, or other bytes than its header says; and whatever else
            NumPy raises over damaged headers.
    """
    file = io.BytesIO(data)
    version = np.lib.format.read_magic(file)
    readers = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    if version not in readers:
        raise ValueError(f"npy version {version} is unknown")
    shape, fortran_order, dtype = readers[version](file)
    if dtype.hasobject:
        raise ValueError("it holds Python objects")
    body = memoryview(data)[file.tell() :]
    if any(n < 0 for n in shape) or math.prod(shape) * dtype.itemsize != len(body):
        raise ValueError(f"{len(body)} bytes are not the {dtype} {list(shape)} announced")
    flat = np.frombuffer(body, dtype)
    return flat.reshape(shape, order="F" if fortran_order else "C").copy()
