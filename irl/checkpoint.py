"""Checkpoints: work that was interrupted goes on where it was, bit by bit.

A checkpoint is one safetensors file: named arrays, and a JSON object with everything else.
It carries the *identity* of the work it belongs to (its settings and hashes of its inputs), so
that it cannot be mistaken for another's, and a digest, so that damage is noticed.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from irl.choices import check_range
from irl.errors import InputError, first_line
from irl.files import atomic_path
from irl.formats import distinct
from irl.identity import require_same_work
from irl.tensor_file import from_bytes, to_bytes

SCHEMA_VERSION = 2


@dataclass(frozen=True)
class Checkpoint:
    """Where work is saved, and how often.

    Attributes:
        path: the file. Work begins from it if it exists, and leaves it behind when done.
        every: iterations from one saving to the next.
    """

    path: Path
    every: int = 500

    def __post_init__(self) -> None:
        """Refuse an interval below 1.

        Raises:
            InputError: if ``every`` is below 1.
        """
        check_range("every", self.every, 1)


def fingerprint(*arrays: np.ndarray) -> str:
    """SHA-256 of arrays' types, shapes and values, in hexadecimal."""
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(f"{array.dtype.str}{array.shape}".encode())
        digest.update(np.ascontiguousarray(array).reshape(-1).data)
    return digest.hexdigest()


def rng_state(rng: np.random.Generator) -> dict[str, Any]:
    """What ``rng`` will draw next, as JSON can hold it."""
    return json.loads(json.dumps(rng.bit_generator.state, default=np.ndarray.tolist))


def restore_rng(rng: np.random.Generator, state: Mapping[str, Any]) -> None:
    """Let ``rng`` go on from ``state``, of the same kind of bit generator."""
    rng.bit_generator.state = state


def save(
    path: Path,
    arrays: Mapping[str, np.ndarray],
    state: Mapping[str, Any],
    identity: Mapping[str, Any],
) -> None:
    """Write a checkpoint, whole or not at all; the same content gives the same bytes.

    Args:
        path: the file.
        arrays: name → array.
        state: what is not an array, as JSON can hold it.
        identity: which work this is: settings and fingerprints by name.

    Raises:
        OSError: if the file cannot be written.
    """
    plain = {name: np.asarray(array) for name, array in arrays.items()}
    content = json.dumps({"identity": identity, "state": state}, sort_keys=True)
    header = {
        "schema_version": SCHEMA_VERSION,
        "content": content,
        "digest": _digest(content, plain),
    }
    with atomic_path(path) as temporary:
        temporary.write_bytes(to_bytes(plain, {"checkpoint": json.dumps(header, sort_keys=True)}))


def load(path: Path, identity: Mapping[str, Any]) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Read the arrays and the state of a checkpoint.

    Args:
        path: the file.
        identity: which work it must belong to, as given to ``save``.

    Raises:
        InputError: if the file is missing, damaged, of another schema, or of other work; then
            it says what differs.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such checkpoint")
    try:
        arrays, metadata = from_bytes(path.read_bytes())
        header = json.loads(metadata["checkpoint"], object_pairs_hook=distinct)
        version, content, digest = (header[k] for k in ("schema_version", "content", "digest"))
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        raise InputError(
            f"{path}: not a readable checkpoint ({first_line(error)}); delete it"
        ) from error
    if type(version) is not int or version != SCHEMA_VERSION:
        raise InputError(
            f"{path}: field 'schema_version' is {version!r}; supported: {SCHEMA_VERSION}"
        )
    if not isinstance(content, str) or digest != _digest(content, arrays):
        raise InputError(f"{path}: damaged, its content does not match its digest; delete it")
    try:
        found = json.loads(content, object_pairs_hook=distinct)
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"{path}: field 'content' is not valid JSON ({first_line(error)}); delete it"
        ) from error
    if not isinstance(found, dict) or not all(
        isinstance(found.get(name), dict) for name in ("identity", "state")
    ):
        raise InputError(
            f"{path}: field 'content' must have objects 'identity' and 'state'; delete it"
        )
    require_same_work(path, found["identity"], identity)
    return arrays, found["state"]


def _digest(content: str, arrays: Mapping[str, np.ndarray]) -> str:
    names = sorted(arrays)
    text = "\n".join([content, *(f"{name} {fingerprint(arrays[name])}" for name in names)])
    return hashlib.sha256(text.encode()).hexdigest()
