"""The lesson file: everything a person said, in order, with what was shown; SQLite, append-only.

What was appended survives a kill of the program and a loss of power before `append` returns. A
chain of digests over all rows tells whether anything was changed. A file that cannot be read, or
is of other work, is refused by name and left as it is.
"""

import contextlib
import json
import os
import platform
import sqlite3
import stat
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from importlib import metadata
from pathlib import Path

from irl.demonstrations import Demonstrations
from irl.errors import InputError, first_line
from irl.files import FileLock
from irl.formats import distinct
from irl.lesson_events import Began, Event, from_plain
from irl.lesson_rows import (
    APPLICATION,
    SCHEMA_VERSION,
    TABLES,
    connect,
    digest_of,
    lock_path,
    to_row,
    writer_lock,
)
from irl.lesson_taught import from_rows

_REMEDY = "it is left as it is; name another file, or restore this one"


def versions() -> dict[str, str]:
    """Of what decides the bits of a policy."""
    return {
        "python": platform.python_version(),
        **{name: metadata.version(name) for name in ("numpy", "scipy", "torch")},
    }


class Lesson:
    """One lesson on disk. One process at a time may add to it; any number may read meanwhile.

    Attributes:
        path: of the file.
        events: all events; number k is ``events[k - 1]``.
        times: when each was added, in seconds since 1970.
    """

    def __init__(
        self, path: Path, *, writable: bool = True, clock: Callable[[], float] = time.time
    ) -> None:
        """Open a lesson, which must be there.

        Args:
            path: of the file.
            writable: whether to add to it.
            clock: tells seconds since 1970.

        Raises:
            InputError: if it is missing, no lesson, damaged, changed, of another schema version, or
                being added to by another process.
        """
        self.path, self._clock = Path(path), clock
        self.events: list[Event] = []
        self.times: list[float] = []
        self._tokens: set[str] = set()
        self._digest = ""
        self._lock: FileLock | None = None
        self._connection: sqlite3.Connection | None = None
        if not self.path.exists():
            raise InputError("no such lesson", place=str(self.path))
        if not stat.S_ISREG(self.path.stat().st_mode):
            raise InputError("not a regular file; a lesson wanted", place=str(self.path))
        try:
            with self._told():
                if writable:
                    self._lock = writer_lock(self.path)
                self._connection = connect(self.path, writable)
                self._read()
                if writable:  # only now, since a file of somebody else's stays as it is
                    self._connection.execute("PRAGMA journal_mode = WAL")
                    self._connection.execute("PRAGMA synchronous = FULL")
                    # Pages: what is written ahead stays smaller than the lesson.
                    self._connection.execute("PRAGMA wal_autocheckpoint = 200")
        except BaseException:
            self.close()
            raise

    @classmethod
    def begin(cls, path: Path, began: Began, *, clock: Callable[[], float] = time.time) -> "Lesson":
        """Make a lesson, whole or not at all, and open it.

        Raises:
            InputError: if there is a file of that name, or none can be made.
        """
        path = Path(path)
        taken = InputError("there is a file of that name; it is left as it is", place=str(path))
        if os.path.lexists(path):
            raise taken
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{path.name}.", dir=path.parent) as folder:
            made = Path(folder) / path.name
            with contextlib.closing(sqlite3.connect(made)) as connection, connection:
                connection.execute(f"PRAGMA application_id = {APPLICATION}")
                connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
                for statement in TABLES:
                    connection.execute(statement)
                row = to_row(1, float(clock()), began, None, "")
                connection.execute("INSERT INTO event VALUES (?, ?, ?, ?, ?, ?)", row)
            with made.open("rb+") as file:
                os.fsync(file.fileno())
            try:
                os.link(made, path)  # which, other than renaming, replaces nothing
            except FileExistsError:
                raise taken from None
        return cls(path, clock=clock)

    # --- Reading ----------------------------------------------------------------------------

    @property
    def began(self) -> Began:
        """The first event."""
        first = self.events[0]
        assert isinstance(first, Began)
        return first

    @property
    def initial(self) -> Demonstrations:
        """The demonstrations before the first question."""
        return from_rows(self.began.initial, self.began.ends)

    @property
    def mark(self) -> str:
        """The digest of all events, which no other lesson has."""
        return self._digest

    def require_task(self, task_hash: str) -> None:
        """Refuse a lesson about another task.

        Raises:
            InputError: naming both hashes.
        """
        if self.began.task_hash != task_hash:
            raise InputError(
                f"is about the task {self.began.task_hash[:12]!r}…, not about {task_hash[:12]!r}…; "
                "give the task data that it was taught with",
                place=str(self.path),
            )

    def _read(self) -> None:
        assert self._connection is not None
        # The first statement that looks at the file, which may be none of SQLite's.
        told = [self._pragma(name) for name in ("application_id", "user_version")]
        if told[0] != APPLICATION:
            raise InputError(f"is not a lesson; {_REMEDY}", place=str(self.path))
        if told[1] != SCHEMA_VERSION:
            raise InputError(
                f"schema version {told[1]} cannot be read; valid: {SCHEMA_VERSION}",
                place=str(self.path),
            )
        found = self._connection.execute("SELECT sql FROM sqlite_master WHERE sql IS NOT NULL")
        if sorted(sql for (sql,) in found) != sorted(TABLES):
            raise InputError(
                f"its tables or triggers are not those of a lesson; {_REMEDY}", place=str(self.path)
            )
        (sound,) = self._connection.execute("PRAGMA quick_check(1)").fetchone()
        if sound != "ok":
            raise InputError(
                f"damaged ({first_line(ValueError(sound))}); {_REMEDY}", place=str(self.path)
            )
        rows = self._connection.execute(
            "SELECT number, at, kind, content, token, digest FROM event ORDER BY number"
        ).fetchall()  # an unfinished reading would keep the file open
        for number, row in enumerate(rows, start=1):
            self._take(number, row)
        if not self.events or not isinstance(self.events[0], Began):
            raise InputError(f"event 1 must be 'began'; {_REMEDY}", place=str(self.path))

    def _pragma(self, name: str) -> int:
        assert self._connection is not None
        return self._connection.execute(f"PRAGMA {name}").fetchone()[0]

    def _take(self, number: int, row: tuple) -> None:
        place = f"{self.path}: event {number}"
        _, at, kind, content, token, digest = row
        texts = isinstance(kind, str) and isinstance(content, str)
        if row[0] != number or not isinstance(at, float) or not texts:
            raise InputError(f"not as a lesson has it; {_REMEDY}", place=place)
        if digest != digest_of(self._digest, row[:5]):
            raise InputError(f"was changed, or one before it; {_REMEDY}", place=place)
        try:
            event = from_plain(kind, json.loads(content, object_pairs_hook=distinct))
        except (ValueError, AttributeError) as error:
            raise InputError(f"{first_line(error)}; {_REMEDY}", place=place) from None
        self._keep(event, at, token, digest)

    def _keep(self, event: Event, at: float, token: str | None, digest: str) -> None:
        self.events.append(event)
        self.times.append(at)
        self._digest = digest
        if token is not None:
            self._tokens.add(token)

    # --- Adding -----------------------------------------------------------------------------

    def append(self, events: Event | Sequence[Event], token: str | None = None) -> int | None:
        """Add one event, or several that belong together, all or none; on disk on return.

        Args:
            events: to add.
            token: of what was shown, or of a message: what comes under a token a second time, such
                as by a double press or a message sent again, is nothing new.

        Returns:
            The number of the first; None if the token was used before.

        Raises:
            InputError: if the file cannot be written.
        """
        if token is not None and token in self._tokens:
            return None
        if self._connection is None:
            raise InputError("was closed", place=str(self.path))
        several = [events] if not isinstance(events, Sequence) else list(events)
        first, digest, rows = len(self.events) + 1, self._digest, []
        at = float(self._clock())
        for number, event in enumerate(several, start=first):
            rows.append(to_row(number, at, event, token if number == first else None, digest))
            digest = rows[-1][-1]
        with self._told(), self._connection:
            self._connection.executemany("INSERT INTO event VALUES (?, ?, ?, ?, ?, ?)", rows)
        for event, row in zip(several, rows, strict=True):
            self._keep(event, row[1], row[4], row[5])
        return first

    def used(self, token: str) -> bool:
        """Whether something came under that token."""
        return token in self._tokens

    @contextlib.contextmanager
    def _told(self) -> Iterator[None]:
        """Tell what SQLite and the disk complain of with the file's name."""
        try:
            yield
        except (sqlite3.Error, OSError, UnicodeError) as error:
            told = " ".join(str(error).split())[:200]
            raise InputError(
                f"not usable as a lesson ({told}); {_REMEDY}", place=str(self.path)
            ) from error

    def close(self) -> None:
        """Close the file; further additions fail."""
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()
        lock, self._lock = self._lock, None
        if lock is not None:
            with contextlib.suppress(OSError):
                lock_path(self.path).unlink()
            lock.release()

    def __enter__(self) -> "Lesson":
        """The lesson itself."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Close the file."""
        self.close()
