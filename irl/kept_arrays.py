"""A file of named arrays that says what it is: of what kind, for which task, and its own digest.

In the safetensors format (`irl.tensor_file`). Its metadata are text: ``kind``, ``schema_version``,
``task_hash`` and ``digest``, the SHA-256 of all else in the file, beside the kind's own.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from irl.errors import InputError
from irl.files import atomic_path
from irl.tensor_file import digest, from_bytes, to_bytes

SCHEMA_VERSION = "1"
"""Of most kinds; see `write_arrays`."""
_OWN = ("kind", "schema_version", "task_hash", "digest")


def write_arrays(
    path: Path,
    kind: str,
    arrays: Mapping[str, np.ndarray],
    told: Mapping[str, str],
    version: str = SCHEMA_VERSION,
) -> None:
    """Write arrays, whole or not at all; equal content gives equal bytes.

    Args:
        path: the file.
        kind: what they are.
        arrays: by name.
        told: metadata by name, ``task_hash`` among them.
        version: of the kind's schema.

    Raises:
        OSError: if the file cannot be written.
    """
    metadata = {**told, "kind": kind, "schema_version": version}
    metadata["digest"] = digest(arrays, metadata)
    with atomic_path(path) as temporary:
        temporary.write_bytes(to_bytes(arrays, metadata))


def read_arrays(
    path: Path,
    kind: str,
    told: tuple[str, ...],
    task_hash: str | None,
    versions: tuple[str, ...] = (SCHEMA_VERSION,),
) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Read what ``write_arrays`` wrote.

    Args:
        path: the file.
        kind: what it must hold.
        told: names that the metadata must have.
        task_hash: hash of the task data it must belong to; any if None.
        versions: of the kind's schema that can be read.

    Returns:
        Arrays and metadata by name.

    Raises:
        InputError: if the file is missing, damaged, of another kind, schema or task, or metadata
            are missing; names the file and the field.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"no such file of a {kind}", place=str(path))
    try:
        arrays, metadata = from_bytes(path.read_bytes())
    except (InputError, OSError) as error:
        raise InputError(f"not a readable {kind} ({error})", place=str(path)) from error
    for name, wanted in (("kind", (kind,)), ("schema_version", versions)):
        if metadata.get(name) not in wanted:
            raise InputError(
                f"field '{name}' is {metadata.get(name)!r:.40}", place=str(path), valid=wanted
            )
    for name in (*_OWN, *told):
        if name not in metadata:
            raise InputError(f"metadata field '{name}' is missing", place=str(path))
    if metadata.pop("digest") != digest(arrays, metadata):
        raise InputError("field 'digest' is not that of what the file holds", place=str(path))
    if task_hash is not None and metadata["task_hash"] != task_hash:
        raise InputError(
            f"field 'task_hash' is {metadata['task_hash'][:12]!r}…, learnt on another task than "
            f"{task_hash[:12]!r}…; give a {kind} learnt on this task",
            place=str(path),
        )
    return arrays, metadata
