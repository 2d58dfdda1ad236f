"""A lesson's rows: the table they stand in, the chain of digests over them, and one writer."""

import contextlib
import hashlib
import json
import os
import sqlite3
from collections.abc import Sequence
from pathlib import Path

from irl.errors import InputError
from irl.files import FileLock
from irl.lesson_events import Event, to_plain

SCHEMA_VERSION = 1
APPLICATION = 0x4C45534E
"""SQLite's mark of whose file it is: LESN."""
TABLES = (
    "CREATE TABLE event (number INTEGER PRIMARY KEY, at REAL NOT NULL, kind TEXT NOT NULL, "
    "content TEXT NOT NULL, token TEXT UNIQUE, digest TEXT NOT NULL)",
    "CREATE TRIGGER never_changed BEFORE UPDATE ON event "
    "BEGIN SELECT RAISE(ABORT, 'a lesson is only added to'); END",
    "CREATE TRIGGER never_deleted BEFORE DELETE ON event "
    "BEGIN SELECT RAISE(ABORT, 'a lesson is only added to'); END",
    "CREATE TRIGGER in_order BEFORE INSERT ON event "
    "WHEN NEW.number IS NOT (SELECT coalesce(max(number), 0) + 1 FROM event) "
    "BEGIN SELECT RAISE(ABORT, 'events are numbered from 1, without a gap'); END",
)


def to_row(number: int, at: float, event: Event, token: str | None, before: str) -> tuple:
    """An event's row; ``before`` is the digest of the row before it, empty before the first."""
    kind, values = to_plain(event)
    content = json.dumps(values, sort_keys=True, separators=(",", ":"), allow_nan=False)
    row = (number, at, kind, content, token)
    return (*row, digest_of(before, row))


def digest_of(before: str, row: Sequence) -> str:
    """Of a row and, by the digest before it, of all that went before."""
    return hashlib.sha256(json.dumps([before, *row]).encode()).hexdigest()


def connect(path: Path, writable: bool) -> sqlite3.Connection:
    """Connect to a file that is there."""
    how = "mode=rw" if writable else "mode=ro"
    wal = path.with_name(f"{path.name}-wal")
    if not writable and not wal.exists() and not os.access(path.parent, os.W_OK):
        how += "&immutable=1"  # where SQLite could put no file of its own beside it
    uri = f"{path.absolute().as_uri()}?{how}"
    return sqlite3.connect(uri, uri=True, timeout=5.0, check_same_thread=False)


def lock_path(path: Path) -> Path:
    """The file that the writer's lock is on."""
    # To open and close the lesson itself a second time would end the locks that SQLite has on it.
    return path.with_name(f"{path.name}-writer")


def writer_lock(path: Path) -> FileLock | None:
    """The lock, which ends with this process, however that ends; None where the disk has none.

    Raises:
        InputError: if another process has it.
    """
    while True:
        lock = FileLock(os.open(lock_path(path), os.O_RDWR | os.O_CREAT, 0o666))
        held = lock.acquire()
        if held is None:
            lock.release()
            return None
        if not held:
            lock.release()
            raise InputError(
                "another process is adding to it; wait for it, or name another", place=str(path)
            )
        # Whoever had it before may have removed the file since it was opened here.
        with contextlib.suppress(OSError):
            if os.path.samestat(os.fstat(lock.descriptor), lock_path(path).stat()):
                return lock
        lock.release()
