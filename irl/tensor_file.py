"""Named arrays as one block of bytes: the safetensors format, without its library.

Eight bytes, little-endian, give the length of a JSON header; the header gives each array's type,
shape and place in the buffer that follows, and text under ``__metadata__``. The library writes
metadata in random order; here equal content gives equal bytes.

Source: the format's description, https://huggingface.co/docs/safetensors.
"""

import hashlib
import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from irl.errors import InputError
from irl.formats import distinct

_METADATA = "__metadata__"
_LARGEST_HEADER = 100_000_000
_DTYPES = {
    "BOOL": "|b1",
    "U8": "|u1",
    "I8": "|i1",
    "U16": "<u2",
    "I16": "<i2",
    "F16": "<f2",
    "U32": "<u4",
    "I32": "<i4",
    "F32": "<f4",
    "U64": "<u8",
    "I64": "<i8",
    "F64": "<f8",
}
_CODES = {dtype: code for code, dtype in _DTYPES.items()}


def to_bytes(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, str]) -> bytes:
    """Serialise; equal content gives equal bytes, whatever the order it comes in.

    Raises:
        InputError: if an array's type is none of the format's, or a name is ``__metadata__``.
    """
    header: dict[str, Any] = {_METADATA: dict(metadata)}
    buffer = bytearray()
    # Widest types first keeps every array aligned, as readers that map the file into memory expect.
    for name, value in sorted(arrays.items(), key=lambda item: (-item[1].dtype.itemsize, item[0])):
        dtype = value.dtype.newbyteorder("<")
        if dtype.str not in _CODES or name == _METADATA:
            raise InputError(f"tensors: {name!r} of type {value.dtype} cannot be written")
        begin = len(buffer)
        buffer += value.astype(dtype, copy=False).tobytes()
        header[name] = {
            "dtype": _CODES[dtype.str],
            "shape": list(value.shape),
            "data_offsets": [begin, len(buffer)],
        }
    text = json.dumps(header, sort_keys=True, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    return len(text).to_bytes(8, "little") + text + bytes(buffer)


def digest(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, str]) -> str:
    """SHA-256 of the content, in hexadecimal, whatever the order it comes in.

    Raises:
        InputError: as ``to_bytes``.
    """
    return hashlib.sha256(to_bytes(arrays, metadata)).hexdigest()


def from_bytes(data: bytes) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Read arrays and metadata; every length is checked before anything is read by it.

    Raises:
        InputError: if the bytes are not of the format. As in the library, the arrays must fill
            the buffer without gap or overlap.
    """
    size = int.from_bytes(data[:8], "little")
    if len(data) < 8 or size > min(len(data) - 8, _LARGEST_HEADER):
        raise InputError("tensors: the file is shorter than its header says")
    try:
        header = json.loads(data[8 : 8 + size].decode("utf-8"), object_pairs_hook=distinct)
    except (ValueError, RecursionError) as error:
        raise InputError(f"tensors: the header is not valid JSON ({error})") from error
    if not isinstance(header, dict):
        raise InputError("tensors: the header must be a JSON object")
    metadata = header.pop(_METADATA, {})
    if not isinstance(metadata, dict) or not all(isinstance(v, str) for v in metadata.values()):
        raise InputError(f"tensors: {_METADATA} must give text to names")
    buffer = memoryview(data)[8 + size :]
    places = {name: _place(name, entry) for name, entry in header.items()}
    filled = 0
    for name, (_, _, begin, end) in sorted(places.items(), key=lambda item: item[1][2:]):
        if begin != filled:
            raise InputError(f"tensors: {name!r} begins at byte {begin} instead of {filled}")
        filled = end
    if filled != len(buffer):
        raise InputError(f"tensors: {filled} bytes of arrays announced, {len(buffer)} found")
    try:
        arrays = {
            name: np.frombuffer(buffer[begin:end], dtype).reshape(shape).copy()
            for name, (dtype, shape, begin, end) in places.items()
        }
    except (ValueError, OverflowError) as error:  # a shape such as [0, 10**30]
        raise InputError(f"tensors: a shape that no array can have ({error})") from error
    return arrays, metadata


def _place(name: str, entry: Any) -> tuple[np.dtype, list[int], int, int]:
    """Type, shape, first byte and end of one array, as its header entry says.

    Raises:
        InputError: if the entry is malformed, or its bytes don't match type and shape.
    """
    if not isinstance(entry, dict) or entry.keys() != {"dtype", "shape", "data_offsets"}:
        raise InputError(f"tensors: {name!r} needs dtype, shape and data_offsets")
    code, shape, offsets = entry["dtype"], entry["shape"], entry["data_offsets"]
    if not isinstance(code, str) or code not in _DTYPES:
        raise InputError(f"{name!r} has dtype {code!r}", place="tensors", valid=_DTYPES)
    for numbers in (shape, offsets):
        if not isinstance(numbers, list) or any(type(n) is not int or n < 0 for n in numbers):
            raise InputError(f"tensors: {name!r} needs integers from 0 for shape and offsets")
    dtype = np.dtype(_DTYPES[code])
    if len(offsets) != 2 or offsets[1] - offsets[0] != math.prod(shape) * dtype.itemsize:
        raise InputError(f"tensors: {name!r} has offsets {offsets}, not the bytes of {shape}")
    return dtype, shape, *offsets
